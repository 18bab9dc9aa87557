"""What curves of solutions say: branches between folds, the receptance at each force, peaks and how each ends."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import Outcome
from jointlib.frf import FRF, ReceptanceKind

from ..blocks import blocks
from ..harmonic_balance.assembly import Assembly
from ..harmonic_balance.cycle import Harmonics
from ..harmonic_balance.harmonics import overtones_of, with_mean
from ..indices import Mask
from ..operating.branches import Branch, End, Stability, without_repeats
from ..operating.peaks import Peak
from ..operating.resonances import NO_MOTION, distinct
from ..operating.tops import apart, tops
from .all_curves import Starts, follow
from .arclength import Path, Stop
from .solution_curves import Curve, first_harmonics

_ENDS = {Stop.RANGE: End.RANGE, Stop.LIMIT: End.LIMIT, Stop.GAVE_UP: End.LOST, Stop.CLOSED: End.FOLD}
_HALF_POWER = np.sqrt(0.5)
_VOTES = 9
"""Points between two folds that tell whether one was passed."""


@dataclass(frozen=True, eq=False)
class Followed:
    """All that was found at one force."""

    branches: tuple[Branch, ...]
    frf: FRF
    peaks: tuple[Peak, ...]
    outcome: Outcome


@dataclass(frozen=True, eq=False)
class _Seen:
    """A curve with its motions: of all joints and then of the outputs in m, (n, motions)."""

    curve: Curve
    frequency: Array
    """Hz, (n,)."""
    motion: ComplexArray
    overtones: ComplexArray
    mean: Array

    @property
    def size(self) -> Array:
        """Amplitude of the largest nonlinear joint in m."""
        return np.asarray(np.max(np.abs(self.curve.z[:, 0]), axis=1))


def by_arc_length(
    assembly: Assembly, forces: Array, lines: Array, harmonics: Harmonics, starts: Starts
) -> list[Followed]:
    """Per force the curves through all starts between the first and the last of the lines (Hz)."""
    low, high = 2 * np.pi * float(lines[0]), 2 * np.pi * float(lines[-1])
    path = Path(assembly, with_mean(harmonics, assembly.biased is not None), low, high)
    curves = follow(path, forces, starts, 2 * np.pi * lines)
    return [followed(path, float(F), found, lines) for F, found in zip(forces, curves, strict=True)]


def followed(path: Path, force: float, curves: Sequence[Curve], lines: Array) -> Followed:
    """Branches, receptance, peaks and outcome of the curves at one force (N); ``lines`` in Hz belong in the FRF."""
    # A start past a limit is a single point, and no solution that may be used.
    seen = [_seen(path, force, curve, lines) for curve in curves if len(curve.p) > 1]
    peaks = _peaks(path, force, seen)
    missing = [outcome for s in seen for _, outcome in s.curve.ends if outcome is not Outcome.CONVERGED]
    missing = missing or [p.outcome for p in peaks if p.outcome not in (Outcome.CONVERGED, Outcome.PEAK_AT_EDGE)]
    count = Counter(missing if seen else [Outcome.STALLED])
    outcome = max(count, key=lambda o: (count[o], o.name)) if count else Outcome.CONVERGED
    branches = without_repeats([branch for s in seen for branch in _branches(path, force, s)])
    branches.sort(key=lambda b: (b.frequency[0], np.max(np.abs(b.joint[0]))))
    return Followed(tuple(branches), _frf(path, force, seen, lines), tuple(peaks), outcome)


def _seen(path: Path, force: float, curve: Curve, lines: Array) -> _Seen:
    frequency = np.where(curve.line >= 0, lines[curve.line], curve.p / (2 * np.pi))
    each = len(path.harmonics) * path.assembly.entries
    parts = [_read(path, force, curve.z[some], curve.p[some]) for some in blocks(len(curve.p), each)]
    motion, overtones, mean = (np.concatenate(part) for part in zip(*parts, strict=True))
    return _Seen(curve, frequency, motion, overtones, mean)


def _upright(path: Path, force: float, z: ComplexArray, p: Array) -> Mask:
    """True where the determinant of the Jacobian at fixed frequency has its sign at rest: no fold was passed."""
    balance = path.balance(p, np.full(len(p), force))
    return np.asarray(~balance.tangent(balance.forces(z)).turned(slice(None)))


def _read(path: Path, force: float, z: ComplexArray, p: Array) -> tuple[ComplexArray, ComplexArray, Array]:
    """First and further harmonics, and mean forces, at some points of a curve."""
    other = np.full(len(p), force)
    forces = path.forces(z, p, other)
    joints, higher = len(path.assembly.joints), overtones_of(path.harmonics)
    overtones, coordinates = np.empty((len(p), len(higher), joints), dtype=complex), path.assembly.coordinates
    for k, h in enumerate(higher, start=1):
        pull = coordinates.together(forces.force[:, k])
        overtones[:, k - 1] = path.assembly.moved(h * p, np.zeros(len(p)), pull)[:, :joints]
        overtones[:, k - 1, list(path.assembly.nonlinear)] = coordinates.motions(z[:, k])
    motion = first_harmonics(path, z, p, other, forces)
    mean, biased = np.empty((len(p), 0)), path.assembly.biased
    if biased is not None:
        shift = path.assembly.coordinates.motions(z[:, -1]).real
        mean = biased.stands + biased.carried_on(shift, forces.force[:, -1].real)
    return motion, overtones, mean


def _branches(path: Path, force: float, seen: _Seen) -> list[Branch]:
    """Pieces of a curve between its folds; those of a closed one begin and end at folds."""
    curve, n = seen.curve, len(seen.curve.p)
    folds = np.flatnonzero(curve.fold)
    order = np.arange(n)
    if curve.closed and len(folds):
        # The last point repeats the first.
        order = np.concatenate([np.arange(folds[0], n - 1), np.arange(folds[0] + 1)])
        cuts = np.flatnonzero(curve.fold[order])
    else:
        cuts = np.concatenate([[0], folds[(folds > 0) & (folds < n - 1)], [n - 1]])
    several = len(path.assembly.nonlinear) > 1
    out = []
    for a, b in pairwise(cuts.tolist()):
        rows = order[a : b + 1]
        ends, why = [], Outcome.CONVERGED
        for at, side in ((a, 0), (b, 1)):
            edge = at in (0, n - 1) and not curve.closed
            stop, outcome = curve.ends[side] if edge else (Stop.CLOSED, Outcome.CONVERGED)
            ends.append(_ENDS[stop])
            why = outcome if outcome is not Outcome.CONVERGED else why
        if curve.p[rows[0]] > curve.p[rows[-1]]:
            rows, ends = rows[::-1], ends[::-1]
        inner = rows[1:-1] if len(rows) > 2 else rows
        some = inner[np.unique(np.linspace(0, len(inner) - 1, min(len(inner), _VOTES)).astype(int))]
        upright = 2 * np.sum(_upright(path, force, curve.z[some], curve.p[some])) >= len(some)
        label = Stability.UNSTABLE if not upright else Stability.UNKNOWN if several else Stability.FOLD_STABLE
        joints = len(path.assembly.joints)
        out.append(
            Branch(
                seen.frequency[rows],
                seen.motion[rows, :joints],
                seen.motion[rows, joints:],
                label,
                (ends[0], ends[1]),
                why,
                with_mean(path.harmonics, False),
                seen.overtones[rows],
                seen.mean[rows],
            )
        )
    return out


def _beside(seen: Sequence[_Seen], value: Sequence[Array], p: float) -> Array:
    """A quantity of all curves wherever they pass p, by interpolation between neighbouring points."""
    found = []
    for s, v in zip(seen, value, strict=True):
        a, b = s.curve.p[:-1], s.curve.p[1:]
        on = np.flatnonzero((np.minimum(a, b) <= p) & (p <= np.maximum(a, b)))
        share = (p - a[on]) / np.where(b[on] != a[on], b[on] - a[on], 1.0)
        found.append(v[on] + share * (v[on + 1] - v[on]))
    return np.concatenate(found)


def _frf(path: Path, force: float, seen: Sequence[_Seen], lines: Array) -> FRF:
    """On every line, and on the points of the curves, the solution with the smallest joint motion."""
    assembly = path.assembly
    joints = len(assembly.joints)
    kind = ReceptanceKind.OPERATING
    frequency, value = lines, np.full((len(lines), len(assembly.outputs), 1), np.nan, dtype=complex)
    best = np.full(len(lines), np.inf)
    extra: dict[float, ComplexArray] = {}
    sizes = [s.size for s in seen]
    # A curve that never turns back, and beside which there is none, is the smallest everywhere.
    alone = len(seen) == 1 and bool(np.all(np.diff(seen[0].curve.p) > 0))
    for s, size in zip(seen, sizes, strict=True):
        for i in np.flatnonzero(s.curve.line >= 0):
            k = s.curve.line[i]
            if size[i] < best[k]:
                best[k], value[k, :, 0] = size[i], s.motion[i, joints:] / force
        for i in np.flatnonzero((s.curve.line < 0) & ~s.curve.fold):
            if alone or size[i] <= np.min(_beside(seen, sizes, float(s.curve.p[i]))) * (1 + 1e-9):
                extra[float(s.frequency[i])] = s.motion[i, joints:] / force
    new = np.array(sorted(set(extra) - set(lines.tolist())))
    if len(new):
        frequency = np.concatenate([lines, new])
        value = np.concatenate([value, np.array([extra[f] for f in new.tolist()])[:, :, None]])
        order = np.argsort(frequency)
        frequency, value = frequency[order], value[order]
    return FRF(frequency, value, assembly.outputs, assembly.inputs, kind)


def _peaks(path: Path, force: float, seen: Sequence[_Seen]) -> list[Peak]:
    """Tops of the largest solution of every joint, the largest values before a limit, else the largest at an edge."""
    count = len(with_mean(path.harmonics, False))
    between = _between(path, force, seen)
    most = max((float(np.max(np.abs(s.motion))) for s in seen), default=0.0)
    peaks: list[Peak] = []
    for k, connection in enumerate(path.assembly.machine.flexible):
        values = [np.abs(s.motion[:, k]) for s in seen]
        largest = max((float(np.max(v)) for v in values), default=0.0)
        if not seen:
            peaks.append(Peak(force, connection.name, float("nan"), float("nan"), Outcome.STALLED, count))
        if largest <= NO_MOTION * most:
            continue
        close = [p for p in between.get(k, []) if _largest(seen, values, 2 * np.pi * p.frequency, p.amplitude)]
        found = [
            *close,
            *_tops(force, connection.name, seen, values, k),
            *_limited(force, connection.name, seen, values),
        ]
        if not found:
            s, v = max(zip(seen, values, strict=True), key=lambda pair: float(np.max(pair[1])))
            i = int(np.argmax(v))
            found = [Peak(force, connection.name, v[i], s.curve.p[i] / (2 * np.pi), Outcome.PEAK_AT_EDGE)]
        found = [replace(p, amplitude=float(p.amplitude), frequency=float(p.frequency)) for p in found]
        peaks += distinct(sorted(found, key=lambda p: p.frequency))
    return [replace(p, harmonics=count) for p in peaks]


def _tops(force: float, name: str, seen: Sequence[_Seen], values: Sequence[Array], k: int) -> list[Peak]:
    found = []
    for s, v in zip(seen, values, strict=True):
        for i in np.flatnonzero(s.curve.top == k):
            p = float(s.curve.p[i])
            if _largest(seen, values, p, v[i]):
                width = _width(s.curve.p, v, int(i)) / (2 * np.pi)
                found.append(Peak(force, name, v[i], p / (2 * np.pi), Outcome.CONVERGED, width=width))
    return found


def _largest(seen: Sequence[_Seen], values: Sequence[Array], p: float, value: float) -> bool:
    """Whether no curve that passes p has a larger one there."""
    return len(seen) == 1 or bool(value >= np.max(_beside(seen, values, p)) * (1 - 1e-9))


def _between(path: Path, force: float, seen: Sequence[_Seen]) -> dict[int, list[Peak]]:
    """Tops of every joint between the points of curves that lie close."""
    found: dict[int, list[Peak]] = {}
    names = [connection.name for connection in path.assembly.machine.flexible]
    for s in seen:
        edges = np.flatnonzero(np.diff(s.curve.close, prepend=False, append=False))
        for first, end in edges.reshape(-1, 2).tolist():
            rows = first + apart(s.curve.p[first:end])
            p, size = s.curve.p[rows], np.abs(s.motion[rows, : len(names)])
            top = tops(p, size)
            for k, omega, A in zip(top.motion.tolist(), top.omega, top.amplitude, strict=True):
                at = np.searchsorted(p, omega)
                width = _width(np.insert(p, at, omega), np.insert(size[:, k], at, A), int(at)) / (2 * np.pi)
                peak = Peak(force, names[k], float(A), float(omega) / (2 * np.pi), Outcome.CONVERGED, width=width)
                found.setdefault(k, []).append(peak)
    return found


def _width(p: Array, value: Array, i: int) -> float:
    """Half the distance in rad/s of the two points on the curve with half the power of its top, 0 without them."""
    sides = []
    for part in (slice(i, None), slice(i, None, -1)):
        x, v = p[part], value[part] / value[i]
        below = np.flatnonzero(v < _HALF_POWER)
        if not len(below):
            return 0.0
        j = int(below[0])
        sides.append(x[j - 1] + (v[j - 1] - _HALF_POWER) / (v[j - 1] - v[j]) * (x[j] - x[j - 1]))
    return float(abs(sides[0] - sides[1]) / 2)


def _limited(force: float, name: str, seen: Sequence[_Seen], values: Sequence[Array]) -> list[Peak]:
    """Ends of curves at a limit of a joint, the two flanks of one resonance together as the larger."""
    ends: list[tuple[float, int, float, Outcome]] = []
    for s, v in zip(seen, values, strict=True):
        for side, i, j in ((0, 0, _further(v, 1)), (1, len(v) - 1, _further(v, -1))):
            stop, outcome = s.curve.ends[side]
            if stop in (Stop.LIMIT, Stop.GAVE_UP) and v[i] > v[j]:
                ends.append((float(s.curve.p[i]), side, float(v[i]), outcome))
    ends.sort()
    found: list[Peak] = []
    while ends:
        end = ends.pop(0)
        if ends and (end[1], ends[0][1]) == (1, 0):
            end = max(end, ends.pop(0), key=lambda e: e[2])
        found.append(Peak(force, name, end[2], end[0] / (2 * np.pi), end[3]))
    return found


def _further(value: Array, step: int) -> int:
    """A few points from an end."""
    n = min(3, len(value) - 1)
    return n if step > 0 else len(value) - 1 - n
