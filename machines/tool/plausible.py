"""Whether a tool-point receptance can be one: its sign, its quantity and its static stiffness."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError

from .tool_model import ToolModel, Undamped
from .tool_point import ToolPoint

_NEARLY_ALL = 0.9
_RISING = 1.0
_LEVEL = -0.5
_UNDAMPED = 1e-8
"""Damping ratio of a mode that loses nothing but by rounding: its resonance lies between any two lines."""
_SHARE = 1e-6
"""Of the static compliance of the most compliant mode: what the tool feels of others."""


def sign_warnings(point: ToolPoint, measured: bool = True) -> tuple[str, ...]:
    """What the signs of G say; with e^(+jωt) a passive structure has Im G ≤ 0 at the driven point.

    The phase of a driven receptance runs from 0 to −180°, that of an accelerance from 180° to 0, that of a mobility
    from 90° to −90°. Data that are one of the others, conjugate, or of reversed sign are refused, each by its name.
    """
    direct = np.einsum("fii->fi", point(point.lines))
    for axis, G in zip(point.axes, direct.T, strict=True):
        _refuse(f"tool point {axis}", point.lines, G)
    wrong = direct.imag > 1e-3 * np.abs(direct)
    count = int(np.count_nonzero(wrong.any(axis=1)))
    if count == 0 or not measured:  # a sum of modes without the highest is not passive to the last digit
        return ()
    return (f"Im G is positive on {count} of {len(direct)} lines, so there is noise or a wrong sign in it.",)


def refuse_undamped(model: ToolModel) -> None:
    """Raise where the tool feels a mode without any damping: no depth of cut is stable, or told by a search."""
    swings = np.flatnonzero(model.poles.imag > 0)
    poles = model.poles[swings]
    size = np.linalg.norm(model.inputs, axis=1)[swings] * np.linalg.norm(model.outputs, axis=1)[swings] / np.abs(poles)
    ratio = np.abs(poles.real) / np.abs(poles)
    found = np.flatnonzero((ratio < _UNDAMPED) & (size > _SHARE * np.max(size, initial=0.0)))
    if len(found):
        raise Undamped(poles[found[np.argmax(size[found])]])


def _refuse(where: str, lines: Array, G: ComplexArray) -> None:
    """Raise for what no receptance looks like, told by phase and by the slope of log G at the lowest lines."""
    size = float(np.sum(np.abs(G.imag)))
    leading = slice(0, max(3, len(lines) // 20))
    first = G[leading]
    if size == 0 or not np.all(np.abs(first) > 0):
        return
    slope = np.polyfit(np.log(lines[leading]), np.log(np.abs(first)), 1)[0]
    starts_negative = float(np.sum(first.real)) < -0.5 * float(np.sum(np.abs(first)))
    if float(np.sum(G.imag)) > _NEARLY_ALL * size:
        if starts_negative and slope > _RISING:
            raise InputError(
                f"{where}: the data rise with the square of frequency and are in phase with the force at high "
                "frequency, as an accelerance does; expected a receptance in m/N: divide by -ω²"
            )
        if starts_negative:
            raise InputError(f"{where}: the data are those of a receptance with the sign reversed; expected +m per +N")
        raise InputError(
            f"{where}: Im G is positive throughout, so the data use e^(-jωt); expected their complex conjugate"
        )
    if float(np.sum(G.real)) > _NEARLY_ALL * float(np.sum(np.abs(G.real))) and float(np.sum(first.imag)) > 0.5 * float(
        np.sum(np.abs(first))
    ):
        raise InputError(f"{where}: the data look like a mobility; expected a receptance in m/N: divide by jω")
    if starts_negative and slope > _LEVEL:
        raise InputError(
            f"{where}: Re G is negative at the lowest frequencies, a negative static stiffness; "
            "expected a machine that stands by itself"
        )
