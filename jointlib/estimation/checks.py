"""What a frequency response of a passive linear structure must obey, and what its first lines say."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from jointlib.errors import InputError
from jointlib.estimation.result import EstimatedFRF, pairs_both_ways

_RELATED = 0.1
"""Coherence without what chance adds to it, in the median, below which force and motion are not related."""
_POOR = 0.8
_SIGMAS = 4.0
_MOST = 0.9
_UNEQUAL = 0.1
_LOW = 8
_MOVED = 0.002
"""Share by which the highest peak of another level must lie elsewhere to be called another frequency."""


def refuse_unrelated(source: str, frf: EstimatedFRF) -> None:
    """Refuse a response in which nothing follows the force."""
    if frf.averages <= 1:
        return
    n = frf.averages
    related = 1 - (1 - float(np.median(frf.coherence))) * n / (n - 1)
    if related < _RELATED:
        raise InputError(
            f"{source}: {frf.name}: coherence is {max(related, 0.0):.2g} in the median, so the motion does not follow "
            "the force; expected the sensor and the force on one structure, and enough force"
        )


def refuse_turned(source: str, frf: EstimatedFRF) -> None:
    """Refuse a driving point that yields energy: Im of its receptance is negative everywhere."""
    if frf.drive != frf.response:
        return
    wrong, clear = _wrong(frf)
    if clear and wrong > _MOST * clear:
        raise InputError(
            f"{source}: {frf.name}: Im H > 0 at the driving point, so it would yield energy; one of the two channels "
            "has the wrong sign, then say gain = -1 on it"
        )


def _wrong(frf: EstimatedFRF) -> tuple[int, int]:
    """Lines of a driving point where Im H is clearly above zero, and where it is clearly told from it."""
    H = frf.receptance
    deviation = 0.02 * np.abs(H) if frf.deviation is None else frf.deviation
    clear = np.abs(H.imag) > np.maximum(_SIGMAS * deviation, 0.02 * np.abs(H))
    return int(np.sum(clear & (H.imag > 0))), int(np.sum(clear))


def said_of(frfs: Sequence[EstimatedFRF]) -> list[str]:
    """Sentences on driving points, reciprocity, levels and averages."""
    said = []
    for f in frfs:
        if f.averages <= 1:
            said.append(
                f"{f.name}: one average; its coherence is 1 whatever was measured, and its variance is not known."
            )
        elif np.median(f.coherence) < _POOR:
            said.append(f"{f.name}: coherence is {float(np.median(f.coherence)):.2f} in the median; noise is large.")
        if f.drive == f.response:
            said += _driving_point(f)
    for a, b in pairs_both_ways(frfs):
        apart = float(np.linalg.norm(a.receptance - b.receptance) / np.linalg.norm(a.receptance))
        noise = 0.0
        if a.deviation is not None and b.deviation is not None:
            noise = float(np.sqrt(np.sum(a.deviation**2 + b.deviation**2)) / np.linalg.norm(a.receptance))
        if apart > max(_UNEQUAL, 3 * noise):
            said.append(
                f"{a.name} and back differ by {apart:.0%} of their norm, expected reciprocal responses; the hits may "
                "be beside the sensors, or a direction be turned."
            )
    return said + _levels(frfs)


def _driving_point(f: EstimatedFRF) -> list[str]:
    said = []
    wrong, clear = _wrong(f)
    if wrong > 0.02 * clear:
        at = f.frequency[np.flatnonzero(f.receptance.imag > 0)]
        said.append(
            f"{f.name}: Im H > 0 on {wrong} of {clear} lines where its sign is clear, {at[0]:.5g} to {at[-1]:.5g} Hz; "
            "a driving point takes energy in, so force and sensor may not be at one point, or a delay is between them."
        )
    low = slice(0, min(_LOW, len(f.frequency)))
    start, omega2 = f.receptance[low], (2 * np.pi * f.frequency[low]) ** 2
    real, imaginary = float(np.median(start.real)), float(np.median(np.abs(start.imag)))
    if abs(real) > 3 * imaginary:
        if real > 0:
            said.append(f"{f.name}: its first lines are a stiffness of {1e-6 / real:.3g} N/um.")
        else:
            mass = float(np.median(-1 / (omega2 * start.real)))
            said.append(f"{f.name}: its first lines are a mass of {mass:.3g} kg, as of a free body.")
    return said


def _levels(frfs: Sequence[EstimatedFRF]) -> list[str]:
    """Whether the highest peak lies elsewhere at another level."""
    said = []
    for pair in dict.fromkeys((f.response, f.drive) for f in frfs):
        same = sorted((f for f in frfs if (f.response, f.drive) == pair), key=lambda f: f.force)
        peaks = [(f, float(f.frequency[np.argmax(np.abs(f.receptance))])) for f in same]
        for (a, low), (b, high) in pairwise(peaks):
            step = float(np.max(np.diff(a.frequency)))
            if abs(high - low) > max(_MOVED * low, 1.5 * step):
                said.append(
                    f"{a.response} from {a.drive}: its highest peak moves from {low:.5g} Hz ({a.condition}) to "
                    f"{high:.5g} Hz "
                    f"({b.condition}) with the level: a joint is not linear."
                )
    return said
