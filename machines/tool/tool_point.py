"""The tool point: its receptance wherever a lobe solver asks for it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from jointlib.arrays import Array, ArrayLike, ComplexArray
from jointlib.errors import FrequencyMismatch, InputError
from jointlib.frf import FRF

Receptance: TypeAlias = Callable[[Array], ComplexArray]
"""G(frequency in Hz, shape (nf,)) in m/N, shape (nf, n, n): a modal model, or a machine at a frozen amplitude."""

AXES = (("x",), ("y",), ("x", "y"))
_SINGULAR = 1e-10


@dataclass(frozen=True, eq=False)
class ToolPoint:
    """Receptance at the tool tip inside a band.

    Parameters
    ----------
    receptance
        G(f) in m/N; exact for a model, interpolated for measured lines.
    lines
        Where the search starts, in Hz, ascending and positive; the first and the last one bound the band.
        A resonance that leaves no trace on these lines is not found.
    axes
        Machine directions of the rows and columns: x is the feed, y the normal to it. A direction left out is rigid.
    sampled
        Whether the receptance is known on the lines only.
    """

    receptance: Receptance
    lines: Array
    axes: tuple[str, ...]
    sampled: bool

    def __call__(self, frequency: Array) -> ComplexArray:
        value = np.asarray(self.receptance(frequency), dtype=complex)
        expected = (len(frequency), len(self.axes), len(self.axes))
        if value.shape != expected:
            raise InputError(f"tool point: the receptance has shape {value.shape}, expected {expected}")
        if not np.all(np.isfinite(value)):
            at = frequency[np.argmin(np.isfinite(value).all(axis=(1, 2)))]
            raise InputError(f"tool point: the receptance is not finite at {at:g} Hz")
        return value

    def along(self, direction: ArrayLike) -> ToolPoint:
        """The same tool point, free to move along one direction only, given by its components on x and y."""
        share = share_along(self.axes, direction)
        return ToolPoint(
            lambda f: np.einsum("i,fij,j->f", share, self(f), share)[:, None, None], self.lines, ("x",), self.sampled
        )


def share_along(axes: Sequence[str], direction: ArrayLike) -> Array:
    """Components on the axes that move of a direction given by those on x and y; `InputError` where it has none."""
    share = np.asarray(direction, dtype=float)[["xy".index(axis) for axis in axes]]
    if not np.linalg.norm(share) > 1e-9:
        raise InputError(f"tool point: no axis along the chip thickness, it moves along {', '.join(axes)}")
    return share


def tool_point(
    receptance: FRF | Receptance, axes: Sequence[str] | None = None, frequency: ArrayLike | None = None
) -> ToolPoint:
    """Tool point from a sampled FRF or from a function G(f).

    An FRF must be square and collocated; between its lines the inverse of the receptance is interpolated.
    Without ``axes`` its names must end in ``.x`` or ``.y``; ``frequency`` (Hz) narrows its band. A function needs
    ``frequency``, the lines in Hz where the search starts; its axes are x, or x and y, unless ``axes`` says otherwise.
    """
    if isinstance(receptance, FRF):
        if receptance.outputs != receptance.inputs:
            raise InputError(
                f"tool point: the FRF has outputs {', '.join(receptance.outputs)} and inputs "
                f"{', '.join(receptance.inputs)}, expected the same ones in the same order"
            )
        named = _checked_axes(axes if axes is not None else _axes_from_names(receptance.outputs))
        lines = receptance.frequency
        if frequency is not None:
            band = _checked_lines(np.asarray(frequency, dtype=float))[[0, -1]]
            lines = np.union1d(lines[(lines >= band[0]) & (lines <= band[1])], band)
        return ToolPoint(_interpolant(receptance), _checked_lines(lines), named, sampled=True)
    if not callable(receptance):
        raise InputError(f"tool point: found {type(receptance).__name__}, expected an FRF or a function of frequency")
    if frequency is None:
        raise InputError("tool point: a receptance function needs the frequencies in Hz where the search starts")
    lines = _checked_lines(np.asarray(frequency, dtype=float))
    if axes is None:
        axes = ("x",) if np.shape(receptance(lines[:1]))[-1:] == (1,) else ("x", "y")
    return ToolPoint(receptance, lines, _checked_axes(axes), sampled=False)


def _interpolant(frf: FRF) -> Receptance:
    """Linear interpolation of the inverse matrix, which is nearly straight across a resonance where G is not.

    A matrix that is singular on some line (one mode seen from two directions) is interpolated entry by entry
    through 1/G_ij, and an entry that vanishes somewhere directly.
    """
    G, f = np.asarray(frf.receptance, dtype=complex), frf.frequency
    if not np.all(np.isfinite(G)):
        raise InputError("tool point: the FRF holds values that are not finite")

    def interpolate(values: ComplexArray, at: Array) -> ComplexArray:
        if at.size and (np.min(at) < f[0] or np.max(at) > f[-1]):
            raise FrequencyMismatch(
                f"tool point: asked for {np.min(at):g} to {np.max(at):g} Hz, have {f[0]:g} to {f[-1]:g} Hz"
            )
        left = np.clip(np.searchsorted(f, at, side="right") - 1, 0, len(f) - 2)
        share = ((at - f[left]) / (f[left + 1] - f[left])).reshape(-1, *(1,) * (values.ndim - 1))
        return np.asarray((1 - share) * values[left] + share * values[left + 1])

    size = np.einsum("fii->fi", np.abs(G)).prod(axis=1)
    if G.shape[1] == 2:
        size = size + np.abs(G[:, 0, 1] * G[:, 1, 0])
    if np.all(np.abs(np.linalg.det(G)) > _SINGULAR * size):
        inverse = np.linalg.inv(G)
        return lambda at: _inverse(interpolate(inverse, at))
    direct = ~np.all(np.abs(G) > 0, axis=0)
    source = np.where(direct, G, 1 / np.where(direct, 1, G))

    def entrywise(at: Array) -> ComplexArray:
        value = interpolate(source, at)
        return np.where(direct, value, 1 / np.where(direct, 1, value))

    return entrywise


def _inverse(matrices: ComplexArray) -> ComplexArray:
    """Inverses of many matrices of one or two rows."""
    if matrices.shape[1] == 1:
        return 1 / matrices
    a, b, c, d = (matrices[:, i, j] for i in (0, 1) for j in (0, 1))
    return np.moveaxis(np.array([[d, -b], [-c, a]]) / (a * d - b * c), 2, 0)


def _axes_from_names(names: tuple[str, ...]) -> tuple[str, ...]:
    axes = tuple(name.rpartition(".")[2] for name in names)
    if any(axis not in ("x", "y") for axis in axes):
        raise InputError(
            f"tool point: the names {', '.join(names)} do not say which is the feed x and which its normal y; pass axes"
        )
    return axes


def _checked_axes(axes: Sequence[str]) -> tuple[str, ...]:
    if tuple(axes) not in AXES:
        raise InputError(f"tool point: axes are {', '.join(axes) or 'none'}, expected x, y, or x and y in this order")
    return tuple(axes)


def _checked_lines(lines: Array) -> Array:
    if lines.ndim != 1 or not np.all(np.isfinite(lines)) or np.any(np.diff(lines) <= 0):
        raise InputError("tool point: the frequencies must be a finite, ascending list in Hz")
    positive = lines[lines > 0]
    if len(positive) < 3:
        raise InputError(f"tool point: {len(positive)} positive frequencies are too few, expected 3 or more")
    return np.asarray(positive)
