"""Fitted modes as a component: modal where the shapes are real, else states."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.io.atomic import sha256, write_npz
from jointlib.io.toml_file import write_toml
from jointlib.modal_fit.fitted_modes import FittedModes

from ..components.component import Component
from ..components.modal import Modal
from ..components.state_space import StateSpace


def component_of(fitted: FittedModes, name: str) -> Component:
    """The modes, and one or more residual modes beyond the band, as a `Modal` or a `StateSpace`.

    Raises
    ------
    InputError
        Where no driving point was measured, or no mode was found.
    """
    fit = fitted.shape_fit
    if fit is None:
        raise InputError(f"{name}: {fitted.notes[-1] if fitted.notes else 'the size of the shapes is not known'}")
    if not len(fit.omega) and not len(fit.ends):
        raise InputError(f"{name}: no mode found in the band, expected responses with a resonance")
    dofs = fitted.responses.dofs
    if fit.is_complex:
        return StateSpace(name, dofs, *_states(fitted))
    frequency, ratio, shapes = _real_modes(fitted)
    return Modal(name, dofs, frequency, ratio, shapes)


def write_component(path: Path, fitted: FittedModes, files: Sequence[Path] = ()) -> tuple[Path, ...]:
    """The component file, and for states ``X.npz`` beside it; a machine names it by ``file``.

    Read back it has the same receptance bit for bit.
    """
    stem = path.name.removesuffix(".toml").removesuffix(".component")
    component_of(fitted, stem)  # refused before anything is written
    fit = fitted.shape_fit
    assert fit is not None
    noted: dict[str, Any] = {
        "program": f"jointlib {version('jointlib')}",
        "band": [float(fitted.responses.frequency[0]), float(fitted.responses.frequency[-1])],
        "fit_error": fitted.fit_error,
        "frequency_error": fitted.frequency_error.tolist(),
        "damping_ratio_error": fitted.damping_ratio_error.tolist(),
        "residual_modes": (fit.ends[:, 0] / (2 * np.pi)).tolist(),
        "files": [{"file": file.name, "sha256": sha256(file)} for file in files],
    }
    if fitted.notes:
        noted["notes"] = list(fitted.notes)
    written = [path]
    table: dict[str, Any]
    if fit.is_complex:
        arrays = path.with_name(f"{stem}.npz")
        A, B, C = _states(fitted)
        write_npz(arrays, {"A": A, "B": B, "C": C})
        written.append(arrays)
        table = {"kind": "state-space", "dofs": list(fitted.responses.dofs), "file": arrays.name}
        noted["frequency"], noted["damping_ratio"] = fitted.frequency.tolist(), fitted.damping_ratio.tolist()
    else:
        assert fitted.shapes_error is not None
        frequency, ratio, shapes = _real_modes(fitted)
        table = {
            "kind": "modal",
            "dofs": list(fitted.responses.dofs),
            "frequency": frequency.tolist(),
            "damping_ratio": ratio.tolist(),
            "shapes": shapes.tolist(),
        }
        for key, error in (
            ("frequency_error", fitted.frequency_error),
            ("damping_ratio_error", fitted.damping_ratio_error),
        ):
            if len(error) and np.all(np.isfinite(error)):  # residual modes have none
                table[key] = [*error.tolist(), *[0.0] * (len(frequency) - len(error))]
        noted["shapes_error"] = fitted.shapes_error.tolist()
    write_toml(path, "component", {**table, "provenance": noted})
    return tuple(written)


def _real_modes(fitted: FittedModes) -> tuple[Array, Array, Array]:
    """Hz, ζ and mass-normalised shapes, residual modes last."""
    fit = fitted.shape_fit
    assert fit is not None
    beyond = fit.ends[:, 0] / (2 * np.pi)
    size = np.where(fit.ends[:, 0] > 0, fit.ends[:, 0], 1.0)
    return (
        np.concatenate([fitted.frequency, beyond]),
        np.concatenate([fitted.damping_ratio, fit.ends[:, 1] / size]),
        np.concatenate([fit.shapes.real, fit.beyond], axis=1),
    )


def _states(fitted: FittedModes) -> tuple[Array, Array, Array]:
    """A, B, C: the real and imaginary part of a state z of every mode, ż = λz + ψᵀf/(2jω_d), x = 2 Re(ψz)."""
    fit = fitted.shape_fit
    assert fit is not None
    psi = np.concatenate([fit.shapes, fit.beyond], axis=1)
    omega, decay = np.concatenate([fit.omega, fit.ends[:, 0]]), np.concatenate([fit.decay, fit.ends[:, 1]])
    places, count = psi.shape
    A, B, C = np.zeros((2 * count, 2 * count)), np.zeros((2 * count, places)), np.zeros((places, 2 * count))
    for r in range(count):
        at = slice(2 * r, 2 * r + 2)
        if omega[r] == 0:  # a free motion: position and velocity
            A[at, at] = [[0.0, 1.0], [0.0, 0.0]]
            B[2 * r + 1], C[:, 2 * r] = psi[:, r].real, psi[:, r].real
            continue
        turn = np.sqrt(omega[r] ** 2 - decay[r] ** 2)
        into = psi[:, r] / (2j * turn)
        A[at, at] = [[-decay[r], -turn], [turn, -decay[r]]]
        B[at] = [into.real, into.imag]
        C[:, at] = 2 * np.stack([psi[:, r].real, -psi[:, r].imag], axis=1)
    return A, B, C
