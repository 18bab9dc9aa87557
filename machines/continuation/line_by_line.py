"""Solutions line by line, by the amplitude map or Newton's method: branches, receptances, peaks."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import Outcome
from jointlib.frf import FRF, ReceptanceKind

from ..harmonic_balance.assembly import Assembly
from ..operating.branches import Branch, Chain, Stability, chains
from ..operating.folds import fold_lines
from ..operating.peaks import Peak
from ..operating.resonances import known_between, resonances
from ..operating.smooth_peaks import round_tops_of_outputs
from ..operating.solutions import Solutions, by_amplitude_map, by_newton
from .curve_results import Followed

_AROUND = np.sinh(np.linspace(-3.0, 3.0, 33))
"""Lines round a peak, in half-power half widths."""
_ROUNDS = 3
"""In which lines close in on the tops of the outputs."""
_APART = 0.55
"""Of the spacing of its own lines, what a peak has to the nearest line of another at most."""


def by_lines(assembly: Assembly, forces: Array, lines: Array, refine: bool, axis: int | None) -> list[Followed]:
    """Per force everything on the lines (Hz), and on more round the peaks and at folds where ``refine``.

    ``axis`` is the number of amplitudes of the map, None for Newton's method.
    """
    found, peaks = solved(assembly, forces, lines, refine, axis)
    labelled = axis is not None or not assembly.nonlinear
    out = []
    for f, force in enumerate(forces.tolist()):
        own = tuple(p for p in peaks if p.force == force)
        branches = _branches(assembly, found, f, labelled)
        out.append(Followed(branches, _frf(assembly, found, f, force), own, _outcome(found, f, list(own))))
    return out


def solved(
    assembly: Assembly, forces: Array, lines: Array, refine: bool, axis: int | None, found: Solutions | None = None
) -> tuple[Solutions, list[Peak]]:
    """Solutions and peaks; arguments as for `by_lines`, ``found`` what is known on the lines already."""
    mapped = axis is not None

    def solve(at: Array) -> Solutions:
        return by_newton(assembly, forces, at) if axis is None else by_amplitude_map(assembly, forces, at, axis)

    found = solve(lines) if found is None else found
    peaks = resonances(assembly, forces, found, mapped)
    if refine:
        extra = _around(peaks)
        extra = extra[(extra > lines[0]) & (extra < lines[-1]) & ~np.isin(extra, lines)]
        if len(extra):
            found = found.merged(solve(extra))
        between = known_between(assembly, lines)
        for last in (*(False,) * _ROUNDS, True) if between and not mapped else ():
            extra = round_tops_of_outputs(assembly, found, last)
            found = found.merged(solve(extra)) if len(extra) else found
    if mapped:
        closing = fold_lines(assembly, forces, found)
        if len(closing):
            found = found.merged(replace(solve(closing), regular=np.zeros(len(closing), dtype=bool)))
    return found, peaks


def _around(peaks: list[Peak]) -> Array:
    """Lines round the peaks; where those of one stand close enough for another, they serve both."""
    out = np.array([-np.inf, np.inf])
    for p in sorted((p for p in peaks if p.width > 0), key=lambda p: p.frequency):
        own = p.frequency + p.width * _AROUND
        place = np.searchsorted(out, own)
        gap = np.minimum(own - out[place - 1], out[place] - own)
        out = np.union1d(out, own[gap > _APART * np.gradient(own)])
    return out[1:-1]


def _branches(assembly: Assembly, found: Solutions, f: int, labelled: bool) -> tuple[Branch, ...]:
    rows = np.flatnonzero(found.force == f)
    reasons = tuple(found.reasons[f])
    joints = len(assembly.joints)
    out = []
    for chain in chains(found.line[rows], found.size[rows], found.rising[rows], found.cut[f], reasons):
        members = rows[chain.members]
        motion = found.motion[members]
        out.append(
            Branch(
                found.frequency[found.line[members]],
                motion[:, :joints],
                motion[:, joints:],
                _stability(chain, labelled),
                chain.ends,
                chain.outcome,
            )
        )
    return tuple(out)


def _stability(chain: Chain, labelled: bool) -> Stability:
    if not chain.rising:
        return Stability.UNSTABLE
    return Stability.FOLD_STABLE if labelled else Stability.UNKNOWN


def _frf(assembly: Assembly, found: Solutions, f: int, force: float) -> FRF:
    rows = np.flatnonzero(found.force == f)
    lines, first = np.unique(found.line[rows], return_index=True)
    value: ComplexArray = np.full((len(found.frequency), len(assembly.outputs), 1), np.nan, dtype=complex)
    value[lines, :, 0] = found.motion[rows[first], len(assembly.joints) :] / force
    kind = ReceptanceKind.OPERATING if assembly.nonlinear else ReceptanceKind.LINEAR
    frf = FRF(found.frequency, value, assembly.outputs, assembly.inputs, kind)
    return replace(frf, frequency=frf.frequency[found.regular], receptance=value[found.regular])


def _outcome(found: Solutions, f: int, peaks: list[Peak]) -> Outcome:
    """The commonest reason why a solution is missing, else why a peak is."""
    missing = Counter(found.reasons[f, found.cut[f]].tolist())
    missing = missing or Counter(p.outcome for p in peaks if p.outcome not in (Outcome.CONVERGED, Outcome.PEAK_AT_EDGE))
    return max(missing, key=lambda o: (missing[o], o.name)) if missing else Outcome.CONVERGED
