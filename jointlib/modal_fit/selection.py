"""Which poles of a stabilisation chart are modes: those without which the responses cannot be explained."""

from __future__ import annotations

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray, Index
from jointlib.modal_fit.basis import Ends
from jointlib.modal_fit.poles import PoleFit, fit_poles
from jointlib.modal_fit.responses import Responses
from jointlib.modal_fit.stabilisation import Chart

_CHANCE = 1e-4
"""Probability that noise alone makes a mode in a set of responses."""
_CLOSE = 4.0
"""Decays within which two modes may be one."""
_CLEAR = 30.0
_HEAVY = 0.5
"""Damping ratio above which a pole is no mode."""
_OUTSIDE = 0.03
_CERTAIN = 3.0
"""Standard errors by which a residue at a driving point is below zero for certain."""
_UNKNOWN = 0.5
"""Variance of the logarithm of a decay above which nothing is known of it."""
_SHARP = 1e-3
"""Half-power half-width over the distance of lines below which a mode is a single line."""
_START = 24
_MOST = 80
"""Modes of one fit at most."""
_DAMPINGS = (0.003, 0.01, 0.03)
_NEAR = 8.0
"""Half-power half-widths of a mode within which it is looked for."""
_ROUNDS = 12
_WIDTHS = (5, 21)


def threshold(responses: Responses, extra: int = 0) -> float:
    """By how much the misfit must fall for a mode to be more than chance anywhere in the band.

    A mode has a frequency, a damping and a residue for each response; a misfit falls by χ² of as many degrees of
    freedom if it is chance, and there are as many places for it as lines.
    """
    count = len(responses.pairs) + 2 + extra
    return float(scipy.special.chdtri(count, _CHANCE / len(responses.frequency)))


def selected(responses: Responses, chart: Chart, ends: Ends, most: int | None = None) -> PoleFit:
    """Modes from the gatherings of a chart, refined together, without what is not needed, and what the chart missed."""
    seeds = [g.pole for g in chart.gatherings[:_START]]
    omega, decay = np.array([abs(p) for p in seeds]), np.array([-p.real for p in seeds])
    fit = fit_poles(responses, omega, np.maximum(decay, 1e-4 * omega), ends, _ROUNDS)
    for _ in range(2):  # what is needless can be told only once nothing is missing
        while len(fit.omega) < _MOST and (more := _with_missing(responses, fit, ends)) is not None:
            fit = more
        fit = _without_needless(responses, fit_poles(responses, fit.omega, fit.decay, ends), ends)
    if most is not None:
        while len(fit.omega) > most:
            fit = _dropped(responses, fit, int(np.argmin(fit.strength)), ends)
    return _in_order(fit)


SHARE = 1e-3
"""Of |H|, below which no error of a line is taken to be; see `jointlib.modal_fit.fit.fit_modes`."""
DOUBT = 5.0
"""Times that, where it is decided what a mode is: an error that a hundred lines share looks like one."""


def chosen(responses: Responses, chart: Chart, ends: Ends, most: int | None = None) -> tuple[PoleFit, Ends]:
    """`selected` modes, and residual modes where the lines tell that they are."""
    poles = selected(responses, chart, ends, most)
    placed, where = placed_ends(responses, poles, ends)
    return (poles, ends) if placed is poles else (selected(responses, chart, where, most), where)


def scale(responses: Responses, fit: PoleFit) -> float:
    """Variance that is seen over that which is stated, at least 1."""
    free = responses.count - fit.residues.size - 2 * len(fit.omega)
    return max(1.0, fit.misfit / max(free, 1))


def _dropped(responses: Responses, fit: PoleFit, k: int, ends: Ends, rounds: int = _ROUNDS) -> PoleFit:
    keep = np.arange(len(fit.omega)) != k
    return fit_poles(responses, fit.omega[keep], fit.decay[keep], ends, rounds)


def _without_needless(responses: Responses, fit: PoleFit, ends: Ends) -> PoleFit:
    """One mode after the other is taken out as long as the rest explains the responses as well."""
    needed = threshold(responses)
    cleared: set[float] = set()
    while len(fit.omega):
        wrong = _impossible(responses, fit)
        if len(wrong):
            fit = _dropped(responses, fit, int(wrong[np.argmin(fit.strength[wrong])]), ends)
            continue
        limit = needed * scale(responses, fit)
        doubtful = [
            int(k)
            for k in np.argsort(fit.strength)
            if (fit.strength[k] < _CLEAR * limit or _has_twin(fit, int(k)))
            and float(f"{fit.omega[k]:.5g}") not in cleared
        ]
        for k in doubtful:
            tried = _dropped(responses, fit, k, ends, 2)
            if tried.misfit - fit.misfit < _CLEAR * limit:  # else more rounds would not make up for it
                tried = _dropped(responses, fit, k, ends)
            if tried.misfit - fit.misfit < limit:
                fit = tried
                break
            cleared.add(float(f"{fit.omega[k]:.5g}"))
        else:
            return fit
    return fit


def _impossible(responses: Responses, fit: PoleFit, settled: bool = True) -> Index:
    """Modes outside the band, with too much damping, or that yield energy at every driving point; and where all are
    found (``settled``) those of whose damping nothing is known."""
    low, high = 2 * np.pi * responses.frequency[0], 2 * np.pi * responses.frequency[-1]
    margin = _OUTSIDE * (high - low)
    bad = (fit.decay > _HEAVY * fit.omega) | (fit.omega < low - margin) | (fit.omega > high + margin)
    unknown = np.diag(fit.covariance)[len(fit.omega) :] * (scale(responses, fit) if settled else 0.0) > _UNKNOWN
    step = 2 * np.pi * float(np.min(np.diff(responses.frequency)))
    bad |= unknown | (fit.decay < _SHARP * step)
    driving = [k for k, (o, i) in enumerate(responses.pairs) if o == i]
    if driving:
        size = np.sqrt(scale(responses, fit) if settled else 1.0)
        bad |= np.all(fit.residues[driving, : len(fit.omega)] < -_CERTAIN * size * fit.residue_error[driving], axis=0)
    return np.flatnonzero(bad)


def _has_twin(fit: PoleFit, k: int) -> bool:
    apart = np.abs(fit.omega - fit.omega[k])
    apart[k] = np.inf
    return bool(np.min(apart, initial=np.inf) < _CLOSE * fit.decay[k])


def _with_missing(responses: Responses, fit: PoleFit, ends: Ends) -> PoleFit | None:
    """The fit with one more mode where the error is largest; None where that is no more than chance."""
    limit = threshold(responses)
    error = (responses.value - fit.value(responses.s, ends, responses.cut)) / responses.deviation
    power = np.mean(np.abs(error) ** 2, axis=0)
    firsts = [_one_more(fit, responses, error, ratio) for ratio in _DAMPINGS]
    at = {int(np.argmax(np.convolve(power, np.ones(width) / width, mode="same"))) for width in _WIDTHS}
    for line in sorted(at):
        firsts += _in_two(fit, 2 * np.pi * float(responses.frequency[line]))
    tried = [fit_poles(responses, omega, decay, ends, 4) for omega, decay in firsts]
    best = min(tried, key=lambda one: one.misfit)
    best = fit_poles(responses, best.omega, best.decay, ends, _ROUNDS)
    sound = not len(_impossible(responses, best, settled=False))
    return best if sound and fit.misfit - best.misfit > limit * scale(responses, best) else None


def _one_more(fit: PoleFit, responses: Responses, error: ComplexArray, ratio: float) -> tuple[Array, Array]:
    """One mode more, of this damping ratio, where it would take most out of the errors while all others stay.

    What b takes out of the errors e, both over the deviation, is Σ (Re Σ b*·e)²/Σ|b|², the first sum over responses,
    the others over lines within some half-power widths.
    """
    f = responses.frequency
    places = np.geomspace(f[0], f[-1], max(2, int(np.log(f[-1] / f[0]) / ratio)))
    first = np.searchsorted(f, places * (1 - _NEAR * ratio))
    last = np.searchsorted(f, places * (1 + _NEAR * ratio), side="right")
    taken = np.zeros(len(places))
    for k, (place, low, high) in enumerate(zip(places.tolist(), first.tolist(), last.tolist(), strict=True)):
        omega = 2 * np.pi * place
        s = responses.s[low:high]
        b = omega**2 / (s**2 + 2 * ratio * omega * s + omega**2) / responses.deviation[:, low:high]
        size = np.sum(np.abs(b) ** 2, axis=1)
        taken[k] = np.sum(np.sum((b.conj() * error[:, low:high]).real, axis=1) ** 2 / np.maximum(size, 1e-300))
    omega = 2 * np.pi * places[int(np.argmax(taken))]
    return np.append(fit.omega, omega), np.append(fit.decay, ratio * omega)


def _in_two(fit: PoleFit, omega: float) -> list[tuple[Array, Array]]:
    """The mode beside an angular frequency as two of them, less and more apart; a mode there where there is none."""
    if not len(fit.omega):
        return [(np.array([omega]), np.array([_DAMPINGS[1] * omega]))]
    near = int(np.argmin(np.abs(fit.omega - omega)))
    found = []
    for apart in (0.5, 1.5):
        both = fit.omega.copy()
        both[near] -= apart * fit.decay[near]
        added = fit.omega[near] + apart * fit.decay[near]
        found.append((np.append(both, added), np.append(fit.decay, fit.decay[near])))
    return found


def _in_order(fit: PoleFit) -> PoleFit:
    order = np.argsort(fit.omega)
    residues = np.concatenate([fit.residues[:, :-2][:, order], fit.residues[:, -2:]], axis=1)
    both = np.concatenate([order, len(order) + order])
    covariance = fit.covariance[np.ix_(both, both)]
    return PoleFit(
        fit.omega[order],
        fit.decay[order],
        residues,
        fit.misfit,
        fit.strength[order],
        fit.residue_error[:, order],
        covariance,
    )


def placed_ends(responses: Responses, fit: PoleFit, ends: Ends) -> tuple[PoleFit, Ends]:
    """The residual modes where the lines tell that they are nearer to the band than assumed, one after the other."""
    free = max(responses.count - fit.residues.size - 2 * len(fit.omega), 1)
    if fit.misfit < free + 3 * np.sqrt(2 * free):
        return fit, ends  # there is nothing to be gained
    for finer in (False, False, True, True):
        best, where = fit, ends
        for other in ends.around() if finer else ends.nearer(responses.frequency):
            tried = fit_poles(responses, fit.omega, fit.decay, other, 2)
            if tried.misfit < best.misfit:
                best, where = tried, other
        if fit.misfit - best.misfit < threshold(responses) * scale(responses, best):
            continue
        fit, ends = fit_poles(responses, best.omega, best.decay, where, _ROUNDS), where
    return fit, ends
