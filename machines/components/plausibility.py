"""What a receptance of a passive linear structure must obey: reciprocity and passivity, said with the frequencies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ..indices import Mask

_UNEQUAL = 0.05
"""Two transfer receptances that differ by more than this share of their size are not reciprocal."""
_UNLIKE = 0.5
"""A difference of this share of the norm is no matter of noise."""
_YIELDING = 0.5
"""Share by which energy that comes out must outweigh what goes in before a record counts as upside down."""
_RISING = 1.0
"""Slope of log H over log f at the first lines above which a record is no receptance."""
_NOISE = 1e-9
_SIGMAS = 3.0


def spans(frequency: Array, failing: Mask) -> str:
    """Runs of lines as words: ``120 to 135 Hz and 410 Hz``, at most four of them."""
    at = np.flatnonzero(failing)
    runs = np.split(at, np.flatnonzero(np.diff(at) > 1) + 1)
    said = [f"{frequency[r[0]]:.5g}" + (f" to {frequency[r[-1]]:.5g}" if len(r) > 1 else "") + " Hz" for r in runs[:4]]
    more = len(runs) - len(said)
    return ", ".join(said) + (f" and {more} more ranges" if more > 0 else "")


def broken(frequency: Array, H: ComplexArray, dofs: Sequence[str], variance: Array | None = None) -> list[str]:
    """What no machine can be computed with: a driving point that yields energy, a pair that has nothing in common.

    A driving point is judged by the energy over the whole band, Σ Re(jωH), to which resonances contribute most; a
    pair by the norm of its difference over the larger of its norms. What three deviations of a known variance explain
    counts for nothing.
    """
    said = []
    for i in range(len(dofs)):
        power = frequency * H[:, i, i].imag
        doubt = 0.0 if variance is None else _SIGMAS * float(np.linalg.norm(frequency * np.sqrt(variance[:, i, i])))
        if np.sum(power) - doubt > _YIELDING * np.sum(np.abs(power)):
            said.append(
                f"the driving point {dofs[i]} yields energy over the band as a whole (Im H > 0 at its resonances), "
                f"expected a passive record; {_cause(frequency, H[:, i, i])}"
            )
        for j in range(i):
            pair = H[:, i, j], H[:, j, i]
            size = max(float(np.linalg.norm(one)) for one in pair)
            doubt = 0.0 if variance is None else _SIGMAS * float(np.sqrt(np.sum(variance[:, i, j] + variance[:, j, i])))
            share = (float(np.linalg.norm(pair[0] - pair[1])) - doubt) / max(size, 1e-300)
            if share > _UNLIKE:
                said.append(
                    f"{dofs[i]} from {dofs[j]} and back differ by {share:.2g} of their norm, expected reciprocal "
                    "records; one may have another sign, unit, or pair of points"
                )
    return said


def _cause(frequency: Array, H: ComplexArray) -> str:
    """What may be wrong with a driving point that yields energy: an accelerance starts at −ω²/k."""
    first = slice(0, max(3, len(H) // 20))
    size = np.abs(H[first])
    rising = bool(np.all(size > 0)) and np.polyfit(np.log(frequency[first]), np.log(size), 1)[0] > _RISING
    if rising and np.sum(H[first].real) < 0:
        return (
            "it rises with the square of frequency from below zero as an accelerance does, "
            'then say quantity = "accelerance"'
        )
    return "it may count time as exp(-jωt), then say conjugate = true, or carry the wrong sign"


def not_reciprocal(frequency: Array, H: ComplexArray, dofs: Sequence[str], variance: Array | None = None) -> list[str]:
    """Pairs whose H_ij and H_ji (m/N) differ by more than 5 % of their size, and by more than three deviations."""
    said = []
    for i in range(len(dofs)):
        for j in range(i):
            apart = np.abs(H[:, i, j] - H[:, j, i])
            allowed = _UNEQUAL * (np.abs(H[:, i, j]) + np.abs(H[:, j, i])) / 2
            if variance is not None:
                allowed = np.maximum(allowed, _SIGMAS * np.sqrt(variance[:, i, j] + variance[:, j, i]))
            failing = apart > np.maximum(allowed, _NOISE * np.max(np.abs(H[:, i, j]), initial=0.0))
            if np.any(failing):
                share = np.linalg.norm(apart) / max(float(np.linalg.norm(H[:, i, j])), 1e-300)
                said.append(
                    f"{dofs[i]} from {dofs[j]} and back are not reciprocal at {spans(frequency, failing)} "
                    f"(difference in norm {share:.2g})."
                )
    return said


def not_passive(frequency: Array, H: ComplexArray, dofs: Sequence[str], variance: Array | None = None) -> list[str]:
    """Driving points with Im H > 0, that is a mobility jωH of negative real part: energy would come out."""
    said = []
    for i in range(len(dofs)):
        value = H[:, i, i]
        allowed = _NOISE * np.abs(value)
        if variance is not None:
            allowed = np.maximum(allowed, _SIGMAS * np.sqrt(variance[:, i, i]))
        failing = value.imag > allowed
        if np.any(failing):
            said.append(
                f"the driving point {dofs[i]} yields energy (real part of its mobility below 0, Im H > 0) at "
                f"{spans(frequency, failing)}."
            )
    return said
