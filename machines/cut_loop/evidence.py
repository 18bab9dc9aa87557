"""How likely the verdicts and chatter frequencies of test cuts are, given where a border lies.

A cut is a coin whose side depends on its distance from the border: P(stable) = Φ((ln b_lim − ln b)/σ) with σ about a
tenth, the scatter of judgement and material, drawn for each sample. Chatter beyond the border is not always heard: it
stays small where teeth leave the cut, and the forced vibration of a deep cut drowns it, the more the further the teeth
shake the tool, as at a speed whose teeth pass with a mode. Nothing like it happens on the other side. Two verdicts in a
hundred are slips of whoever wrote them down. Chatter is heard at the frequency of the multiplier or a whole number of
tooth frequencies beside it, within a third of a percent at the border and more the further the cut lies beyond. There
it begins at the frequency of the multiplier of its own depth, and where edges leave the cut it grows back towards that
of the border, at which the cut that is left just keeps it up: it may lie anywhere between. One in ten is that of
another border, which a cut far beyond its own can meet first, and may be anywhere; where the teeth shake the tool up to
six in ten are.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from scipy.special import ndtr, ndtri

from jointlib.arrays import Array
from jointlib.cuts.tried_cut import TriedCut

from ..indices import Mask

SCATTER, _SPREAD = 0.1, 0.35
"""σ in the middle, and the deviation of its logarithm over the samples."""
_SLIP, ELSEWHERE, _SHAKEN, _FAR = 0.02, 0.1, 0.5, 4.0
"""Of the verdicts that are slips; of the frequencies that may be anywhere, and how many more are where the forced
vibration is as many feeds."""
_CLEAR, _FAINT = (3.4, 2.5, 0.1, 0.25, 0.3, 0.01), (2.4, 1.15, 0.0, 0.02, 0.15, -0.05)
"""What of chatter is heard only deeper, where it has to be clear, and where any sign of it tells a marginal cut, by the
forced vibration of ρ feeds per tooth: the share 1/(1 + e^a/(1 + ρ)^b) of the places, by c + d·ln(1 + ρ) in ln depth,
with a deviation e, and where all others begin. Fitted to 600 simulated borders (modes, immersions, teeth, speeds and
forces at random, nothing undeclared; 22 depths each from 0.85 to 2.6 times the border, told by their sound), with wider
deviations than these have: a shop is no simulation. Held against 180 of another program."""
_DEEPER = ndtri((np.arange(8) + 0.5) / 8)
"""Deviations of the depth at which it is heard, each as likely as the others."""
_NEAR = 1.5
"""Deviations of σ from the border within which a cut is marginal."""
_HEARD, _GROWN, _BETWEEN = 0.003, 0.01, 5
"""Of the chatter frequency: how well it is heard and told at the border, and what it moves as chatter grows beyond it,
where edges leave the cut, for a depth e times that of the border; and at how many places from there to the frequency of
its own depth it is looked for. Held against 219 frequencies of 23 simulated campaigns whose borders are known."""


def scatter(z: Array) -> Array:
    """σ of each sample from standard normal numbers."""
    return np.asarray(SCATTER * np.exp(_SPREAD * z))


def stable(apart: Array, sigma: Array, shaken: Array | float = 0.0) -> Array:
    """P(stable) of cuts by ln(b_lim/b), the scatter of the verdicts, and the forced vibration in feeds per tooth."""
    return _with_slips(_short(apart, sigma, shaken, _CLEAR))


def sound(apart: Array, sigma: Array) -> Array:
    """P(stable) of cuts whether or not anybody would hear their chatter."""
    return _with_slips(ndtr(apart / sigma))


def _with_slips(chance: Array) -> Array:
    """P(a cut is called stable) by that of its being so."""
    return np.asarray(_SLIP + (1 - 2 * _SLIP) * chance)


def _short(apart: Array, sigma: Array, shaken: Array | float, of: tuple[float, ...]) -> Array:
    """P(the border at which chatter is heard lies deeper than a cut)."""
    _, _, by, more, about, begins = of
    feeds, late = np.log1p(shaken), _late(shaken, of)
    deeper = ndtr((apart + by + more * feeds) / np.hypot(about, sigma))
    return np.asarray((1 - late) * ndtr((apart + begins) / sigma) + late * deeper)


def _late(shaken: Array | float, of: tuple[float, ...]) -> Array:
    """The share of places at which chatter is heard only deeper."""
    return np.asarray(1 / (1 + np.exp(of[0] - of[1] * np.log1p(shaken))))


def of_verdicts(verdicts: Sequence[str], apart: Array, sigma: Array, shaken: Array) -> Array:
    """ln P(verdicts of cuts at one place), (draws,), by ln(b_lim/b), (draws, cuts), the scatter of the verdicts,
    (draws,), and the forced vibration in feeds per tooth, (cuts,).

    How much deeper chatter is heard is the same for all of them: three cuts that chatter unheard are hardly less likely
    than one.
    """
    late = {of: _late(shaken, of) for of in (_CLEAR, _FAINT)}
    edges = np.unique(np.concatenate([[0.0, 1.0], *late.values()]))
    by_state: dict[tuple[int, bool, bool], Array] = {}
    chance = np.zeros(len(sigma))
    for low, high in pairwise(edges):
        of_all = np.ones((len(sigma), 1))
        for i, verdict in enumerate(verdicts):
            state = i, bool(high <= late[_CLEAR][i]), bool(high <= late[_FAINT][i])
            if state not in by_state:
                by_state[state] = _called(verdict, apart[:, i, None], sigma[:, None], np.log1p(shaken[i]), *state[1:])
            of_all = of_all * by_state[state]
        chance += (high - low) * np.mean(of_all, axis=1)
    return np.asarray(np.log(chance))


def _called(verdict: str, apart: Array, sigma: Array, feeds: float, clear: bool, faint: bool) -> Array:
    """P(verdict), (draws, deviations), where what is ``clear``, and where a ``faint`` sign is heard only deeper."""
    if verdict == "marginal":
        not_clear = _heard_deeper(apart + _NEAR * sigma, sigma, feeds, _CLEAR, clear)
        inside = not_clear - _heard_deeper(apart - _NEAR * sigma, sigma, feeds, _FAINT, faint)
        return np.asarray(_SLIP + (1 - _SLIP) * np.maximum(inside, 0.0))
    chance = _with_slips(_heard_deeper(apart, sigma, feeds, _CLEAR, clear))
    return np.asarray(chance if verdict == "stable" else 1 - chance)


def _heard_deeper(apart: Array, sigma: Array, feeds: float, of: tuple[float, ...], late: bool) -> Array:
    _, _, by, more, about, begins = of
    return np.asarray(ndtr((apart + (by + more * feeds + about * _DEEPER if late else begins)) / sigma))


def replayed(apart: Array, sigma: Array, shaken: Array, rng: np.random.Generator) -> Mask:
    """Whether the cuts of a place would be called stable, drawn once for each draw of a machine, (draws, cuts)."""
    _, _, by, more, about, begins = _CLEAR
    late = rng.uniform(size=(len(sigma), 1)) < _late(shaken, _CLEAR)
    deeper = by + more * np.log1p(shaken) + about * rng.choice(_DEEPER, size=(len(sigma), 1))
    chance = _with_slips(ndtr((apart + np.where(late, deeper, begins)) / sigma[:, None]))
    return np.asarray(rng.uniform(size=chance.shape) < chance)


def apart(heard: float, frequency: Array, tooth: float, flip: bool) -> Array:
    """Hz between a chatter frequency and the nearest line of chatter at a border; nan where there is none."""
    if flip:
        frequency = np.where(np.isfinite(frequency), tooth / 2, np.nan)
    beside = np.mod(heard - frequency, tooth)
    mirrored = np.mod(heard + frequency, tooth)
    folded = [np.minimum(one, tooth - one) for one in (beside, mirrored)]
    return np.minimum(*folded)


def of_frequency(
    heard: float,
    border: Array,
    own: Array,
    apart_from: Array,
    tooth: float,
    flip: bool,
    shaken: float = 0.0,
) -> Array:
    """ln of the density, times half a tooth frequency, of a chatter frequency in Hz, at ln(b_lim/b) ``apart_from``.

    It may lie anywhere from that of the ``border`` to that of its ``own`` depth; ``shaken`` is the forced vibration in
    feeds per tooth.
    """
    width = (_HEARD + _GROWN * np.minimum(np.abs(apart_from), 1.0)) * heard
    way = np.mod(own - border + tooth / 2, tooth) - tooth / 2
    d = [apart(heard, border + share * way, tooth, flip) for share in np.linspace(0, 1, _BETWEEN)]
    bell = _peak(width, tooth) * np.mean(np.exp(-0.5 * (np.nan_to_num(d, nan=np.inf) / width) ** 2), axis=0)
    elsewhere = ELSEWHERE + _SHAKEN * min(shaken / _FAR, 1.0)
    return np.asarray(np.log(elsewhere + (1 - elsewhere) * bell))


def _peak(width: Array | float, tooth: float) -> Array:
    """Of the density, times half a tooth frequency."""
    return np.asarray(2 / np.sqrt(2 * np.pi) / width * tooth / 4)


def judged(cuts: Sequence[TriedCut]) -> Mask:
    """Which cuts are clearly stable or chatter, so that a prediction of them is right or wrong."""
    return np.array([cut.verdict in ("stable", "chatter") for cut in cuts])
