"""The resonances of a response: one refined peak per force, connection and resonance."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import FrequencyMismatch, Outcome

from ..harmonic_balance.assembly import Assembly
from ..indices import Index, Mask
from .peaks import Peak, local_maxima, maxima, tips
from .smooth_peaks import on_one_curve
from .solutions import Solutions, along, balance_at

_SAME = 1e-6
NO_MOTION = 1e-12
"""Share of the largest motion of the machine below which a joint does not move; what is left is rounding."""


def resonances(assembly: Assembly, forces: Array, found: Solutions, mapped: bool) -> list[Peak]:
    """Peaks of the relative displacement of every connection, sorted by force, connection and frequency.

    On the lines the largest solution counts. Where a limit hides it the largest admissible one before stands, with
    the limit as its outcome. A connection without any maximum inside the range has its largest value at an edge; one
    that does not move has no entry. Where nothing is known between the lines (a measured part without interpolation)
    the largest values on them stand.
    """
    between = known_between(assembly, found.frequency)
    alone: dict[int, dict[int, list[Peak]]] = {}
    for f in range(len(forces)) if between and not mapped else ():
        own = on_one_curve(assembly, float(forces[f]), found, f)
        alone |= {} if own is None else {f: own}
    names = [c.name for c in assembly.machine.flexible]
    peaks: list[Peak] = []
    starts: list[tuple[int, int, int, Index]] = []
    by_map: list[tuple[int, int, float]] = []
    for f in range(len(forces)):
        for k in range(len(names)):
            level, holder = _envelope(found, f, k)
            if np.nanmax(level, initial=0.0) <= NO_MOTION * np.max(np.abs(found.motion), initial=0.0) > 0:
                continue
            tip = mapped and k == assembly.nonlinear[0]
            shown = _with_limits(level, found.cut[f], assembly) if tip else _plateaus(level, found.cut[f])
            if f in alone:
                peaks += alone[f].get(k) or _largest(forces[f], names[k], found, level, f)
                continue
            tops = local_maxima(shown)
            if not len(tops):
                peaks += _largest(forces[f], names[k], found, level, f)
            for i in tops:
                if not between and not found.cut[f, i]:
                    at = float(found.frequency[i])
                    peaks.append(Peak(float(forces[f]), names[k], float(level[i]), at, Outcome.CONVERGED))
                elif tip and between:
                    by_map.append((f, int(i), float(shown[i])))
                elif found.cut[f, i]:
                    peaks.append(_before_limit(forces[f], names[k], found, level, f, int(i)))
                else:
                    starts.append((f, k, int(holder[i]), holder[holder >= 0]))
    if by_map:
        peaks += _tips(assembly, forces, found, by_map)
    if starts:
        peaks += _maxima(assembly, forces, found, starts)
    order = {name: i for i, name in enumerate(names)}
    return distinct(sorted(peaks, key=lambda p: (p.force, order[p.connection], p.frequency)))


def known_between(assembly: Assembly, lines: Array) -> bool:
    """Whether the machine is known between the lines (Hz), too."""
    if len(lines) < 2:
        return True
    try:
        assembly.at(np.pi * (lines[:1] + lines[1:2]))
    except FrequencyMismatch:
        return False
    return True


def _envelope(found: Solutions, f: int, k: int) -> tuple[Array, Index]:
    """Largest amplitude of motion k per line (nan where none) and the row of that solution."""
    rows = np.flatnonzero(found.force == f)
    value = np.abs(found.motion[rows, k])
    order = np.lexsort((value, found.line[rows]))
    last = np.flatnonzero(np.diff(found.line[rows[order]], append=-1) != 0)
    top = order[last]
    level, holder = np.full(len(found.frequency), np.nan), np.full(len(found.frequency), -1)
    level[found.line[rows[top]]], holder[found.line[rows[top]]] = value[top], rows[top]
    return level, holder


def _with_limits(level: Array, cut: Mask, assembly: Assembly) -> Array:
    """The map knows what lies behind a cut: something larger than the limit."""
    limit = assembly.limits[0].amplitude
    known = np.nanmax(level, initial=0.0)
    top = limit if np.isfinite(limit) else 1.01 * known
    return np.where(cut, top, level)


def _plateaus(level: Array, cut: Mask) -> Array:
    """Lines without a solution count as just above the larger of their neighbours."""
    shown = np.where(cut, np.nan, level)
    for first, last in _stretches(cut):
        around = [shown[i] for i in (first - 1, last + 1) if 0 <= i < len(shown)]
        shown[first : last + 1] = (1 + 1e-9) * max(around, default=0.0)
    return shown


def _stretches(cut: Mask) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], cut, [False]]).astype(int)))
    return [(int(a), int(b) - 1) for a, b in edges.reshape(-1, 2)]


def _largest(force: float, name: str, found: Solutions, level: Array, f: int) -> list[Peak]:
    if not np.any(np.isfinite(level)):
        outcome = found.reasons[f, 0]
        return [Peak(float(force), name, float("nan"), float("nan"), outcome)]
    i = int(np.nanargmax(level))
    return [Peak(float(force), name, float(level[i]), float(found.frequency[i]), Outcome.PEAK_AT_EDGE)]


def _before_limit(force: float, name: str, found: Solutions, level: Array, f: int, i: int) -> Peak:
    first, last = next((a, b) for a, b in _stretches(found.cut[f]) if a <= i <= b)
    sides = [j for j in (first - 1, last + 1) if 0 <= j < len(level)]
    j = max(sides, key=lambda side: level[side])
    return Peak(float(force), name, float(level[j]), float(found.frequency[j]), found.reasons[f, i])


def _spacing(found: Solutions, i: Index) -> Array:
    """Two line spacings on the wider side, rad/s."""
    gap = np.diff(found.frequency)
    n = len(gap) - 1
    wider = np.maximum(gap[np.clip(i - 1, 0, n)], gap[np.clip(i, 0, n)])
    return np.asarray(2 * 2 * np.pi * wider)


def _tips(assembly: Assembly, forces: Array, found: Solutions, starts: list[tuple[int, int, float]]) -> list[Peak]:
    joint = assembly.joints[assembly.nonlinear[0]]
    name = assembly.machine.flexible[assembly.nonlinear[0]].name
    f, i = (np.array([s[n] for s in starts]) for n in (0, 1))
    band = (2 * np.pi * found.frequency[0], 2 * np.pi * found.frequency[-1])
    omega, amplitude, width, outcomes = tips(
        assembly,
        joint,
        assembly.limits[0],
        forces[f],
        2 * np.pi * found.frequency[i],
        np.array([s[2] for s in starts]),
        _spacing(found, i),
        band,
    )
    return [
        Peak(float(forces[a]), name, float(A), float(w / (2 * np.pi)), outcome, width=float(b / (2 * np.pi)))
        for a, A, w, outcome, b in zip(f, amplitude, omega, outcomes, width, strict=True)
    ]


def _maxima(
    assembly: Assembly, forces: Array, found: Solutions, starts: list[tuple[int, int, int, Index]]
) -> list[Peak]:
    f, k, row = (np.array([s[n] for s in starts]) for n in (0, 1, 2))
    line = found.line[row]
    paths = [s[3] for s in starts]
    band = (2 * np.pi * found.frequency[0], 2 * np.pi * found.frequency[-1])

    def motion(search: Index, omega: Array) -> tuple[Array, Mask]:
        # Joints that share a window share its solutions.
        key = np.stack([f[search], omega[:, 0], omega[:, -1]], axis=1)
        first, own = np.unique(key, axis=0, return_index=True, return_inverse=True)[1:]
        own, at = own.ravel(), omega[first]
        each = np.repeat(f[search[first]], at.shape[1])
        start = np.empty((at.size, len(assembly.nonlinear)), dtype=complex)
        for force in np.unique(each):
            rows = each == force
            start[rows] = along(assembly, found, paths[search[f[search] == force][0]], at.ravel()[rows])
        moved, _, fine, _, _ = balance_at(assembly, at.ravel() / (2 * np.pi), forces[each], start)
        value = np.abs(moved.reshape(*at.shape, -1)[own, :, k[search]])
        return value, np.asarray(np.all(fine.reshape(at.shape), axis=1))[own]

    omega, amplitude, width, outcomes = maxima(
        motion, 2 * np.pi * found.frequency[line], _spacing(found, line), band, f
    )
    names = [c.name for c in assembly.machine.flexible]
    peaks = []
    for n, outcome in enumerate(outcomes):
        at, A, b = omega[n] / (2 * np.pi), amplitude[n], width[n] / (2 * np.pi)
        if outcome is Outcome.STALLED:
            # What was found on the lines is a solution; only its top is not known.
            at, A, b = found.frequency[line[n]], abs(found.motion[row[n], k[n]]), 0.0
        peaks.append(Peak(float(forces[f[n]]), names[k[n]], float(A), float(at), outcome, width=float(b)))
    return peaks


def distinct(peaks: list[Peak]) -> list[Peak]:
    """Two searches that ended on one top count once."""
    out: list[Peak] = []
    for p in peaks:
        if out and (p.force, p.connection) == (out[-1].force, out[-1].connection):
            near = abs(p.frequency - out[-1].frequency) <= _SAME * p.frequency + 0.01 * p.width
            if near and abs(p.amplitude - out[-1].amplitude) <= _SAME * p.amplitude:
                continue
        out.append(p)
    return out
