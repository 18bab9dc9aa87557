"""Forced response of a machine with nonlinear joints: branches, receptance per force, refined peaks."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError, Outcome
from jointlib.frf import FRF, ReceptanceKind

from .assembly import Assembly
from .branches import Branch, Chain, Stability, chains
from .bundles.bundle import said_by
from .folds import fold_lines
from .limits import beyond_frequency
from .machine import Machine, checked_forces, checked_range
from .peaks import Peak
from .resonances import resonances
from .solutions import Solutions, by_amplitude_map, by_newton
from .statics import static_point

_POINTS = 600
_AROUND = np.sinh(np.linspace(-3.0, 3.0, 33))
"""Lines round a peak, in half-power half widths."""


@dataclass(frozen=True)
class AmplitudeMap:
    """For one nonlinear joint: all branches, their folds and stability. ``amplitudes`` is the size of the axis."""

    amplitudes: int = 150


@dataclass(frozen=True)
class Newton:
    """For any number of nonlinear joints: the branch that grows out of the linear response."""


@dataclass(frozen=True, eq=False)
class Response:
    """What a harmonic force on ``drive`` does; tuples have one entry per force.

    Phasors are peak values with time factor e^(+jωt), their phase relative to the force.
    """

    drive: str
    force: tuple[float, ...]
    """N, peak."""
    connections: tuple[str, ...]
    outputs: tuple[str, ...]
    branches: tuple[tuple[Branch, ...], ...]
    frfs: tuple[FRF, ...]
    """Receptance from ``drive`` to ``outputs`` on the smallest solution of each line, the one that a force raised
    from rest at fixed frequency reaches; nan where no admissible solution exists."""
    outcomes: tuple[Outcome, ...]
    """CONVERGED, or what kept the solution at some line from being used."""
    peaks: tuple[Peak, ...]
    """One per force, connection and resonance."""
    warnings: tuple[str, ...] = ()
    """What bears on the result, a sentence each."""

    def peaks_of(self, connection: str, force: float) -> tuple[Peak, ...]:
        """Peaks of one connection at one force in N, ascending in frequency."""
        return tuple(p for p in self.peaks if p.connection == connection and p.force == force)


def response(
    machine: Machine,
    force: float | Sequence[float] | None = None,
    frequency: Sequence[float] | Array | None = None,
    drive: str | None = None,
    method: AmplitudeMap | Newton | None = None,
    *,
    outputs: Sequence[str] | None = None,
    points: int = _POINTS,
    harmonics: int = 1,
) -> Response:
    """Steady response to harmonic forces, each joint replaced by its describing function at its own amplitude.

    Nonlinear receptance coupling (Dhupia et al. 2008, eqs 17–20) in the form z + Hzz g(z) = Hzf F, exact from an
    open joint to a rigid one.

    Parameters
    ----------
    machine
        Every connection must have its joint.
    force
        Peak forces in N; default: those of the file.
    frequency
        [low, high] in Hz, laid out with ``points`` lines and refined round the peaks; or more than two ascending
        lines, which are used as they are. Default: the range of the file.
    drive
        Degree of freedom the force acts on; default: that of the file, else the tool's x, else y.
    method
        `AmplitudeMap` or `Newton`; default: the map where one joint is nonlinear at most.
    outputs
        Degrees of freedom of the receptances; default: the tool's and ``drive``.
    harmonics
        1 is all that this version knows.
    """
    if harmonics != 1:
        raise InputError(f"response: harmonics is {harmonics!r}, this version solves for the first harmonic only")
    driven = machine.driven_dof(drive)
    forces = _forces(machine, force)
    lines, refine = _lines(machine, frequency, points)
    names = tuple(dict.fromkeys([*machine.tool.values(), driven] if outputs is None else outputs))
    assembly = Assembly(machine, names, (driven,))
    count = len(assembly.nonlinear)
    if isinstance(method, AmplitudeMap) and count > 1:
        raise InputError(
            f"{machine.where}: the amplitude map takes one nonlinear joint and there are {count}; use Newton()"
        )
    mapped = count == 1 and not isinstance(method, Newton)
    axis = (method if isinstance(method, AmplitudeMap) else AmplitudeMap()).amplitudes

    def solve(at: Array) -> Solutions:
        return by_amplitude_map(assembly, forces, at, axis) if mapped else by_newton(assembly, forces, at)

    found = solve(lines)
    peaks = resonances(assembly, forces, found, mapped)
    if refine:
        around = [p.frequency + p.width * _AROUND for p in peaks if p.width > 0]
        extra = np.unique(np.concatenate([lines[:0], *around]))
        extra = extra[(extra > lines[0]) & (extra < lines[-1]) & ~np.isin(extra, lines)]
        if len(extra):
            found = found.merged(solve(extra))
    if mapped:
        closing = fold_lines(assembly, forces, found)
        if len(closing):
            found = found.merged(replace(solve(closing), regular=np.zeros(len(closing), dtype=bool)))
    every = range(len(forces))
    return Response(
        driven,
        tuple(forces.tolist()),
        tuple(c.name for c in machine.flexible),
        names,
        tuple(_branches(assembly, found, f, mapped or count == 0) for f in every),
        tuple(_frf(assembly, found, f, float(forces[f])) for f in every),
        tuple(_outcome(found, f, [p for p in peaks if p.force == forces[f]]) for f in every),
        tuple(peaks),
        _warnings(machine, float(lines[0]), float(lines[-1])),
    )


def _warnings(machine: Machine, low: float, high: float) -> tuple[str, ...]:
    under_load = () if machine.static is None else static_point(machine).warnings
    return (*beyond_frequency(machine, low, high), *said_by(machine.joints()), *under_load)


def _forces(machine: Machine, force: float | Sequence[float] | None) -> Array:
    given = machine.force if force is None else np.atleast_1d(np.asarray(force, dtype=float)).tolist()
    checked = checked_forces(given, "response")
    if not checked:
        raise InputError(f"{machine.where}: no force is given, expected force in [response] or as an argument")
    return np.array(checked)


def _lines(machine: Machine, frequency: Sequence[float] | Array | None, points: int) -> tuple[Array, bool]:
    """The lines in Hz, and whether more may be added."""
    given = machine.frequency if frequency is None else frequency
    if given is None:
        raise InputError(f"{machine.where}: no frequency is given, expected frequency in [response] or as an argument")
    values = np.asarray(given, dtype=float)
    if values.shape == (2,):
        low, high = checked_range(values.tolist(), "response")
        if points < 2:
            raise InputError(f"response: points is {points}, expected at least 2")
        return np.linspace(low, high, points), True
    if values.ndim != 1 or len(values) == 0 or not np.all(np.isfinite(values)):
        raise InputError("response: frequency must be [low, high] or ascending lines in Hz, finite")
    if values[0] <= 0 or np.any(np.diff(values) <= 0):
        raise InputError("response: lines of frequency must be positive and ascending")
    return values, False


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
