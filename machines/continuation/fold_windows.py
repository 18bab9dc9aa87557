"""Several joints over a range: Newton's method line by line, arc length in those windows where branches fold."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import Outcome
from jointlib.frf import FRF, ReceptanceKind
from jointlib.shown.progress import Progress

from ..harmonic_balance.assembly import Assembly
from ..indices import Index, Mask
from ..operating.branches import Branch, End, Stability, without_repeats
from ..operating.peaks import Peak
from ..operating.resonances import distinct
from ..operating.solutions import Solutions, by_newton
from .all_curves import Starts, passes, raised, started
from .curve_results import Followed, by_arc_length
from .line_by_line import solved
from .validation import Elsewhere, Tangents, doubtful, elsewhere
from .windows import edges_of, stretches

_PROBES = 9
_SAME = 1e-6


@dataclass(frozen=True, eq=False)
class _Lines:
    """What Newton's method found at one force: a row of the solutions per line, −1 for none."""

    found: Solutions
    force: float
    row: Index

    def motion(self, i: int) -> np.ndarray:
        return np.asarray(self.found.motion[self.row[i]])


@dataclass(frozen=True, eq=False)
class _Window:
    """Lines first to last, and all curves between them."""

    first: int
    last: int
    part: Followed


def by_windows(assembly: Assembly, forces: Array, lines: Array, during: Progress) -> list[Followed]:
    """Per force all branches between the first and the last line (Hz), with more lines round the peaks.

    Arc length takes over wherever Newton's method stalls, passes a fold or a limit, jumps from one line to the next,
    or raising the force threefold and lowering it again leads elsewhere. A window in which a curve reaches an edge
    away from Newton's solution is widened.
    """
    tangents: Tangents = {}
    with during.step(f"solving {len(lines)} lines at {len(forces)} forces"):
        found = doubtful(assembly, forces, by_newton(assembly, forces, lines), tangents)[0]
    with during.step("closing in on the peaks"):
        found, peaks = solved(assembly, forces, found.frequency, True, None, found)
    with during.step(f"looking for jumps between {len(found.frequency)} lines"):
        found, jumps = doubtful(assembly, forces, found, tangents)
    others = elsewhere(assembly, forces, found, during)
    out = []
    for f, force in enumerate(forces.tolist()):
        row = np.full(len(found.frequency), -1)
        mine = np.flatnonzero(found.force == f)
        row[found.line[mine]] = mine
        here = _Lines(found, force, row)
        bad = found.cut[f] | (row < 0) | jumps[f] | others.met[f]
        bad[found.line[mine][~found.rising[mine]]] = True
        own = [p for p in peaks if p.force == force]
        lost = [p.frequency for p in own if p.outcome is Outcome.STALLED and np.isfinite(p.frequency)]
        bad[np.minimum(np.searchsorted(found.frequency, lost), len(bad) - 1)] = True
        windows = _followed(assembly, here, bad, others, f, during)
        out.append(_whole(assembly, here, own, windows))
    return out


def _followed(
    assembly: Assembly, here: _Lines, bad: Mask, others: Elsewhere, f: int, during: Progress
) -> list[_Window]:
    todo, done = stretches(bad), list[_Window]()
    while todo:
        i, j = todo.pop(0)
        while done and done[-1].last > i:
            i = min(i, done.pop().first)
        while todo and todo[0][0] < j:
            j = max(j, todo.pop(0)[1])
        lines = here.found.frequency[i : j + 1]
        left = f", then {len(todo)} more" if todo else ""
        with during.step(f"following curves at {here.force:g} N from {lines[0]:.5g} to {lines[-1]:.5g} Hz{left}"):
            starts, force = _starts(assembly, here, others, f, (i, j)), np.array([here.force])
            part = by_arc_length(assembly, force, lines, (1,), starts)[0]
            wider = _wider(assembly, here, bad, part, (i, j))
            if wider is None:
                further = raised(assembly, force, 2 * np.pi * np.linspace(lines[0], lines[-1], _PROBES + 2)[1:-1])
                new = [k for k in range(len(further.omega)) if not _on(assembly, part, further, k)]
                if new:
                    part = by_arc_length(assembly, force, lines, (1,), starts.and_then(further.at(new)))[0]
                    wider = _wider(assembly, here, bad, part, (i, j))
        if wider is None:
            done.append(_Window(i, j, part))
        else:
            todo.insert(0, wider)
    return done


def _wider(
    assembly: Assembly, here: _Lines, bad: Mask, part: Followed, window: tuple[int, int]
) -> tuple[int, int] | None:
    """A window twice as wide where a curve leaves this one away from Newton's solutions, None where none does."""
    i, j = window
    down, up = (_strays(here, part, at, side, assembly) for at, side in ((i, 0), (j, -1)))
    if not (down and i > 0) and not (up and j < len(bad) - 1):
        return None
    return edges_of(bad, i - (j - i) if down else i, j + (j - i) if up else j)


def _on(assembly: Assembly, part: Followed, starts: Starts, k: int) -> bool:
    """Whether a branch runs through a start."""
    chosen = list(assembly.nonlinear)
    return any(
        passes(
            assembly.coordinates.of_motions(b.joint[:, chosen]),
            2 * np.pi * b.frequency,
            float(starts.omega[k]),
            starts.z[k][0],
        )
        for b in part.branches
    )


def _starts(assembly: Assembly, here: _Lines, others: Elsewhere, f: int, edges: tuple[int, int]) -> Starts:
    """Newton's solutions on the edges, and one of each stretch of lines where a swept force led elsewhere."""
    omega = 2 * np.pi * here.found.frequency
    chosen = list(assembly.nonlinear)
    known = [i for i in edges if here.row[i] >= 0]
    z = [here.motion(i)[chosen] for i in known]
    rows = np.flatnonzero((others.force == f) & (others.line >= edges[0]) & (others.line <= edges[1]))
    parts = np.split(rows, np.flatnonzero(np.diff(others.line[rows]) > 1) + 1)
    inside = np.array([part[len(part) // 2] for part in parts if len(part)], dtype=int)
    met = np.concatenate([np.array(z, dtype=complex).reshape(len(z), len(chosen)), others.z[inside]])
    at = np.concatenate([omega[np.array(known, dtype=int)], omega[others.line[inside]]])
    return Starts(np.zeros(len(at), dtype=int), at, started(assembly, (1,), met, at))


def _strays(here: _Lines, part: Followed, at: int, side: int, assembly: Assembly) -> bool:
    """Whether a curve reaches this edge of its window away from Newton's solution there."""
    edge = here.found.frequency[at]
    reached = [b for b in part.branches if b.ends[side] is End.RANGE]
    own = here.motion(at)[: len(assembly.joints)]
    return any(b.frequency[side] != edge or not _same(b.joint[side], own) for b in reached)


def _same(a: np.ndarray, b: np.ndarray) -> bool:
    return bool(np.max(np.abs(a - b)) <= _SAME * np.max(np.abs(b)))


def _whole(assembly: Assembly, here: _Lines, peaks: Sequence[Peak], windows: Sequence[_Window]) -> Followed:
    """Newton's stretches and the windows between them as one."""
    n, joints = len(here.found.frequency), len(assembly.joints)
    edges = [0, *(i for w in windows for i in (w.first, w.last)), n - 1]
    pieces = [b for w in windows for b in w.part.branches]
    kind = ReceptanceKind.OPERATING
    frequency, value = [], []
    for a, b in zip(edges[::2], edges[1::2], strict=True):
        if a == b and len(windows) and a in (0, n - 1):
            continue
        rows = here.row[a : b + 1]
        motion, at = here.found.motion[rows], here.found.frequency[a : b + 1]
        bare = np.empty((len(rows), 0, joints), dtype=complex)
        parts = motion[:, :joints], motion[:, joints:]
        ends = (End.RANGE, End.RANGE)
        pieces.append(Branch(at, *parts, Stability.UNKNOWN, ends, Outcome.CONVERGED, overtones=bare))
        frequency.append(at)
        value.append(parts[1][:, :, None] / here.force)
    frequency += [w.part.frf.frequency for w in windows]
    value += [w.part.frf.receptance for w in windows]
    at, first = np.unique(np.concatenate(frequency), return_index=True)
    frf = FRF(at, np.concatenate(value)[first], assembly.outputs, assembly.inputs, kind)
    kept = _peaks(assembly, here, peaks, windows)
    missing = [w.part.outcome for w in windows if w.part.outcome is not Outcome.CONVERGED]
    missing = missing or [p.outcome for p in kept if p.outcome not in (Outcome.CONVERGED, Outcome.PEAK_AT_EDGE)]
    count: Counter[Outcome] = Counter(missing)
    outcome = max(count, key=lambda o: (count[o], o.name)) if count else Outcome.CONVERGED
    branches = sorted(without_repeats(_spliced(pieces)), key=lambda b: (b.frequency[0], np.max(np.abs(b.joint[0]))))
    return Followed(tuple(branches), frf, kept, outcome)


def _spliced(pieces: Sequence[Branch]) -> list[Branch]:
    """Branches that meet on the edge of a window as one."""
    out: list[Branch] = []
    for b in sorted(pieces, key=lambda piece: (piece.frequency[0], piece.frequency[-1])):
        before = [
            k
            for k, a in enumerate(out)
            if a.ends[1] is End.RANGE and b.ends[0] is End.RANGE and a.frequency[-1] == b.frequency[0]
            if _same(a.joint[-1], b.joint[0])
        ]
        if not before:
            out.append(b)
            continue
        a = out[before[0]]
        if len(b.frequency) == 1:
            continue
        frequency, joint, output, bare = (
            np.concatenate([getattr(a, k), getattr(b, k)[1:]]) for k in ("frequency", "joint", "output", "overtones")
        )
        label = a.stability if a.stability is b.stability else Stability.UNKNOWN
        why = a.outcome if a.outcome is not Outcome.CONVERGED else b.outcome
        ends = (a.ends[0], b.ends[1])
        out[before[0]] = Branch(frequency, joint, output, label, ends, why, overtones=bare)
    return out


def _peaks(assembly: Assembly, here: _Lines, peaks: Sequence[Peak], windows: Sequence[_Window]) -> tuple[Peak, ...]:
    """Newton's peaks outside the windows and those inside; the largest value at an edge only where there are none."""
    frequency = here.found.frequency

    def outside(p: Peak) -> bool:
        return not any(frequency[w.first] < p.frequency < frequency[w.last] for w in windows)

    kept: list[Peak] = []
    for connection in assembly.machine.flexible:
        own = [p for p in peaks if p.connection == connection.name and outside(p)]
        inner = [replace(p, force=here.force) for w in windows for p in w.part.peaks if p.connection == connection.name]
        every = [*own, *inner]
        tops = [p for p in every if p.outcome is not Outcome.PEAK_AT_EDGE]
        best = [max(every, key=lambda p: p.amplitude)] if every else []
        kept += distinct(sorted(tops or best, key=lambda p: p.frequency))
    return tuple(kept)
