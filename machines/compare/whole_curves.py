"""Two frequency responses as a whole: whether they have one shape, and whether a unit lies between them."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import ComplexArray
from jointlib.lab.unit_smell import smell_of

_ALIKE = 0.9
"""FRAC from which on a record has the shape of the prediction."""


def frac(a: ComplexArray, b: ComplexArray) -> float:
    """|Σ a b*|² / (Σ|a|² Σ|b|²) over the lines, from 0 to 1.

    Heylen and Lammens, "FRAC: a consistent way of comparing frequency response functions", Int. Conf. on
    Identification in Engineering Systems, Swansea 1996; Allemang, Sound and Vibration 37(8) (2003) 14–23.
    """
    energy = float(np.sum(np.abs(a) ** 2) * np.sum(np.abs(b) ** 2))
    return float(np.abs(np.vdot(b, a)) ** 2 / energy) if energy else 0.0


def unit_smell(measured: ComplexArray, predicted: ComplexArray) -> str:
    """What a record is that has the shape of the prediction but a size that is a matter of units; empty if it is not.

    The factor of least squares, Σ a b* / Σ|b|², tells; its sign tells that of a force or of a displacement.
    """
    energy = float(np.sum(np.abs(predicted) ** 2))
    if not energy or frac(measured, predicted) < _ALIKE:
        return ""
    factor = np.vdot(predicted, measured) / energy
    size, turned = float(np.abs(factor)), bool(factor.real < -_ALIKE * np.abs(factor))
    smell = smell_of(size)
    if smell is not None:
        far, words = smell
        also = " and of reversed sign" if turned else ""
        return f"has the shape of the prediction and is {far}{also}: that smells of a unit ({words})."
    if turned:
        return "has the shape of the prediction and the opposite sign: look at the sign of its force or displacement."
    return ""
