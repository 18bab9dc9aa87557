"""State-space component: A, B, C, D with forces in and displacements out."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.io.finite_elements.matrix_files import read_arrays
from jointlib.io.toml import Section

from .component import Component, FirstOrder, checked_dofs
from .plausibility import not_passive, not_reciprocal

_BLOCK = 2**21
_SLOW = 1e-6
"""A pole counts as unstable beyond this share of the fastest: rounding moves the double zero of a free body."""
_LINES = 200


@dataclass(frozen=True, eq=False)
class StateSpace(Component):
    """H = C (jω − A)⁻¹ B + D in m/N: forces (N) on the dofs in, their displacements (m) out, time in s.

    Unstable models are refused. That a model has direct compliance (D ≠ 0), is not reciprocal or yields energy at a
    driving point is among its `remarks`.

    Parameters
    ----------
    A, B, C, D
        (n, n), (n, dofs), (dofs, n) and (dofs, dofs); D left out is zero.
    """

    name: str
    dofs: tuple[str, ...]
    A: Array
    B: Array
    C: Array
    D: Array | None = None

    kind: ClassVar[str] = "state-space"

    def __post_init__(self) -> None:
        where = f"component {self.name!r}"
        dofs = checked_dofs(where, self.dofs)
        object.__setattr__(self, "dofs", dofs)
        states, ports = np.shape(self.A)[0] if np.ndim(self.A) else 0, len(dofs)
        D = np.zeros((ports, ports)) if self.D is None else self.D
        shapes = {"A": (states, states), "B": (states, ports), "C": (ports, states), "D": (ports, ports)}
        for key, value in {"A": self.A, "B": self.B, "C": self.C, "D": D}.items():
            matrix = np.array(value, dtype=float)
            if matrix.shape != shapes[key]:
                raise InputError(
                    f"{where}: {key} has shape {matrix.shape}, expected {shapes[key]} for {states} states "
                    f"and {ports} dofs"
                )
            if not np.all(np.isfinite(matrix)):
                raise InputError(f"{where}: {key} holds values that are not finite")
            object.__setattr__(self, key, matrix)
        worst = self._poles[np.argmax(self._poles.real)] if states else -1.0
        if worst.real > _SLOW * np.max(np.abs(self._poles), initial=0.0):
            raise InputError(
                f"{where}: A has a pole at {worst.real:.4g} {worst.imag:+.4g}j rad/s, expected a stable model, none "
                "with a positive real part"
            )

    @classmethod
    def from_section(cls, section: Section) -> StateSpace:
        name, dofs, path = section.text("name"), section.words("dofs"), section.path("file")
        try:
            arrays = read_arrays(Path(path))
        except InputError as error:
            raise InputError(f"{section.where}: {error}") from None
        for key in "ABC":
            if key not in arrays:
                raise InputError(
                    f"{section.where}: {path} holds {', '.join(arrays) or 'nothing'}, expected A, B, C and D"
                )
        A, B, C = (np.atleast_2d(arrays[key]) for key in "ABC")
        D = np.atleast_2d(arrays["D"]) if "D" in arrays else np.zeros((len(C), B.shape[1]))
        ins = _picked(section.take("inputs", None), B.shape[1], f"{section.where}: inputs")
        outs = _picked(section.take("outputs", None), len(C), f"{section.where}: outputs")
        if D.shape != (len(C), B.shape[1]):
            raise InputError(f"{section.where}: D has shape {D.shape}, expected {(len(C), B.shape[1])}")
        return cls(name, dofs, A, B[:, ins], C[outs], D[np.ix_(outs, ins)])

    @cached_property
    def _poles(self) -> Any:
        return np.linalg.eigvals(self.A)

    @cached_property
    def _balanced(self) -> tuple[Array, Array, Array]:
        balanced, scale = scipy.linalg.matrix_balance(self.A)
        return np.asarray(balanced, dtype=float), np.linalg.inv(scale) @ self.B, self.C @ np.asarray(scale, dtype=float)

    def between(self, omega: Array, rows: Array, columns: Array) -> ComplexArray:
        A, B, C = self._balanced
        assert self.D is not None
        out = np.empty((len(omega), len(rows), len(columns)), dtype=complex)
        step = max(1, _BLOCK // max(len(A), 1) ** 2)
        for start in range(0, len(omega), step):
            s = 1j * omega[start : start + step, None, None]
            inner = np.linalg.solve(s * np.eye(len(A)) - A, (B @ columns.T).astype(complex))
            out[start : start + step] = (rows @ C) @ inner + rows @ self.D @ columns.T
        return out

    def second_order(self) -> None:
        return None

    def first_order(self) -> FirstOrder:
        assert self.D is not None
        return FirstOrder(*self._balanced, self.D)

    def remarks(self) -> tuple[str, ...]:
        said = []
        if np.any(self.D):
            said.append("D is not zero: a force moves it at once, as residual flexibility does.")
        fast = np.abs(self._poles[np.abs(self._poles) > 0])
        if len(fast):
            lines = np.geomspace(0.3 * fast.min(), 3 * fast.max(), _LINES) / (2 * np.pi)
            H = self.receptance(2 * np.pi * lines)
            said += not_reciprocal(lines, H, self.dofs) + not_passive(lines, H, self.dofs)
        return tuple(f"{self.name}: {sentence}" for sentence in said)


def _picked(value: object, size: int, where: str) -> list[int]:
    """Columns of B or rows of C that belong to the dofs, counted from 1 in files; default: all in order."""
    if value is None:
        return list(range(size))
    if not isinstance(value, list) or not all(type(v) is int and 1 <= v <= size for v in value):
        raise InputError(f"{where} is {value!r}, expected a list of whole numbers from 1 to {size}")
    return [v - 1 for v in value]
