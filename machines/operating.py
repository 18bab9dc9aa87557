"""The machine at a vibration amplitude of the tool: every joint frozen at the gain it has there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError, Outcome
from jointlib.frf import FRF, ReceptanceKind
from jointlib.joint import Joint

from .amplitude_map import admissible, gain_table
from .assembly import Assembly, View
from .indices import Index, Reasons
from .limits import feeds_energy
from .machine import AXES, Machine
from .prescribed import Prescribed, solve_prescribed

_AXIS = 120
_DECADES = 6.0
_FURTHEST = 1.0
_STEPS = 60
_BARELY_MOVING, _STUCK = 1e-10, 1e-13
_SETTLED = 1e-11


@dataclass(frozen=True, eq=False)
class OperatingPoint:
    """Receptance at a tool-point amplitude, with what every joint does there; first axis: lines."""

    frf: FRF
    gain: ComplexArray
    """Gain in N/m at which every joint is held, (nf, connections)."""
    joint_amplitude: Array
    """Amplitude of every joint in m, (nf, connections)."""
    force: Array
    """Magnitude of the force in N that makes the amplitude, for the direction as it was given, (nf,)."""
    outcomes: tuple[Outcome, ...]
    """Per line; where it is not CONVERGED the joints are held at the limit that it names."""


def frozen_receptance(
    machine: Machine,
    frequency: ArrayLike,
    amplitude: float,
    direction: ArrayLike | None = None,
    outputs: Sequence[str] | None = None,
) -> FRF:
    """Tool-point receptance with the joints frozen at a tool-point amplitude; see `operating_point`.

    `operating_point` also tells which lines, if any, ended at the limit of a joint.
    """
    return operating_point(machine, frequency, amplitude, direction, outputs).frf


def operating_point(
    machine: Machine,
    frequency: ArrayLike,
    amplitude: float,
    direction: ArrayLike | None = None,
    outputs: Sequence[str] | None = None,
) -> OperatingPoint:
    """Freeze the joints at the gain G(A, ω) they have while the tool point vibrates, line by line.

    On each line a harmonic force acts on the tool along ``direction``, large enough for the larger of the amplitudes
    in x and y to be ``amplitude``; of several such states the one with the smallest joint motion counts. This is a
    secant: it describes a developed vibration. At amplitude 0 it is the tangent at rest, under the static load if the
    machine has one.

    Parameters
    ----------
    frequency
        Lines in Hz, positive and ascending, shape (nf,).
    amplitude
        m, peak.
    direction
        Complex force components along the tool's axes that are present, in the order x, y: shape (axes,) or
        (nf, axes). Default: the same force on each.
    outputs
        Degrees of freedom of the rows; default: the tool's. The columns are always the tool's.
    """
    lines = np.atleast_1d(np.asarray(frequency, dtype=float))
    if not (lines.ndim == 1 and len(lines) and np.all(np.isfinite(lines)) and np.all(lines > 0)):
        raise InputError("frozen receptance: lines must be finite and above 0 Hz")
    if not (np.isfinite(amplitude) and amplitude >= 0):
        raise InputError(f"frozen receptance: amplitude is {amplitude!r} m, expected at least 0")
    tool = tuple(machine.tool[axis] for axis in AXES if axis in machine.tool)
    if not tool:
        raise InputError(f"{machine.where}: no tool point, expected [tool] with x or y")
    rows = tool if outputs is None else tuple(outputs)
    towards = _direction(direction, len(lines), len(tool))
    assembly = Assembly(machine, tuple(dict.fromkeys([*tool, *rows])), tool)
    omega = 2 * np.pi * lines
    joints, moving = assembly.joints, list(assembly.nonlinear)
    gains = np.empty((len(lines), len(joints)), dtype=complex)
    for j, joint in enumerate(joints):
        gains[:, j] = joint.first_harmonic(0.0, omega).gain
    joint_amplitude, force = np.zeros((len(lines), len(joints))), np.zeros(len(lines))
    outcomes: list[Outcome] = [Outcome.CONVERGED] * len(lines)
    kind = ReceptanceKind.TANGENT if moving else ReceptanceKind.LINEAR
    if amplitude > 0:
        view = assembly.at(omega).directed(towards)
        if not np.all(np.any(view.Hof[:, len(joints) : len(joints) + len(tool), 0], axis=1)):
            raise InputError(
                f"{machine.where}: a force on the tool {', '.join(tool)} moves nothing there, expected shapes or "
                "connections that let it"
            )
        state = (_one_joint if len(moving) == 1 else _joints)(assembly, view, len(tool), amplitude)
        gains[:, moving], force, outcomes = state.gain, state.force, list(state.outcomes)
        joint_amplitude = np.abs(_motions(view, state.gain, state.force))[:, : len(joints)]
        kind = ReceptanceKind.FROZEN if moving else ReceptanceKind.LINEAR
    H = assembly.coupled(omega, gains)
    H = H[:, [assembly.outputs.index(name) for name in rows], :]
    return OperatingPoint(FRF(lines, H, rows, tool, kind), gains, joint_amplitude, force, tuple(outcomes))


@dataclass(frozen=True, eq=False)
class _State:
    """Gains of the nonlinear joints (nf, nj), force magnitudes (nf,) and outcomes."""

    gain: ComplexArray
    force: Array
    outcomes: tuple[Outcome, ...]


def _direction(direction: ArrayLike | None, lines: int, axes: int) -> ComplexArray:
    given = np.ones(axes) if direction is None else np.asarray(direction, dtype=complex)
    if given.shape not in ((axes,), (lines, axes)) or not np.all(np.isfinite(given)):
        raise InputError(
            f"frozen receptance: direction has shape {given.shape}, expected finite values of shape ({axes},) "
            f"or ({lines}, {axes})"
        )
    full = np.array(np.broadcast_to(given, (lines, axes)), dtype=complex)
    if np.any(np.all(full == 0, axis=1)):
        raise InputError("frozen receptance: direction is zero, expected a force along x or y")
    return full


def _motions(view: View, gain: ComplexArray, force: Array) -> ComplexArray:
    """All motions in m at frozen gains, (nf, motions)."""
    if gain.shape[1] == 0:
        return view.Hof[:, :, 0] * force[:, None]
    c = view.coordinates
    system: ComplexArray = np.eye(len(c.rows)) + c.through(view.Hzz, gain)
    q = np.asarray(np.linalg.solve(system, view.Hzf[:, :, :1])[:, :, 0], dtype=complex)
    pull = c.together(gain * c.motions(q))
    moved: ComplexArray = view.Hof[:, :, 0] - (view.Hoz @ pull[:, :, None])[:, :, 0]
    return moved * force[:, None]


def _one_joint(assembly: Assembly, view: View, axes: int, amplitude: float) -> _State:
    """One joint: its amplitude A is the given quantity, tool amplitude and force follow from it.

    q(A) = A·max_a abs(Hof D − Hoz G Hzf) reaches ``amplitude``·abs(Hzf) where the tool does.
    """
    joint, limit, omega = assembly.joints[assembly.nonlinear[0]], assembly.limits[0], view.omega
    first = len(assembly.joints)
    h, driven = view.Hzz[:, :, 0], view.Hzf[:, 0, :]
    direct, through = view.Hof[:, first : first + axes, 0], view.Hoz[:, first : first + axes, 0]

    def excess(A: Array, gain: ComplexArray, at: Index) -> Array:
        tip = [
            np.abs(direct[at, a, None] * (1 + h[at] * gain) - through[at, a, None] * gain * driven[at])
            for a in range(axes)
        ]
        return np.asarray(A * np.max(tip, axis=0) - amplitude * np.abs(driven[at]))

    every = np.arange(len(omega))
    ceiling = min(limit.amplitude, _reach(joint, omega, excess, every))
    A = np.geomspace(ceiling * 10**-_DECADES, ceiling, _AXIS)
    gain = gain_table(joint, omega, A)[0]
    ends, reasons = admissible(joint, omega, A, gain, limit)
    over = (excess(A, gain, every) >= 0) & (ends[:, None] >= A)
    hit = np.any(over, axis=1)
    k = np.argmax(over, axis=1)
    low, high = np.where(k > 0, A[k - 1], 0.0), np.where(hit, A[k], ends)

    def exact(amplitudes: Array, at: Index) -> Array:
        # At rest a joint may be rigid; that end counts as too small.
        with np.errstate(invalid="ignore"):
            return excess(amplitudes[:, None], joint.first_harmonic(amplitudes, omega[at]).gain[:, None], at)[:, 0]

    # The last admissible amplitude may still hold a solution beyond the last point of the axis.
    rest = np.flatnonzero(~hit)
    if len(rest):
        under = np.searchsorted(A, ends[rest], side="right") - 1
        low[rest] = np.where(under >= 0, A[np.maximum(under, 0)], 0.0)
        hit[rest] = exact(ends[rest], rest) >= 0
    final = np.where(hit, high, ends)
    todo = np.flatnonzero(hit)
    final[todo] = _root(exact, todo, low[todo], high[todo])
    # A joint that sticks while the tool moves elsewhere is held as one that hardly moves.
    still = (final == 0) | (driven[:, 0] == 0)
    G = joint.first_harmonic(np.maximum(final, _STUCK), omega).gain
    G = np.where(np.isfinite(G), G, joint.first_harmonic(_BARELY_MOVING, omega).gain)
    F = final * np.abs(1 + h[:, 0] * G) / np.where(still, 1.0, np.abs(driven[:, 0]))
    tool = np.max(np.abs(_motions(view, G[:, None], np.ones(len(omega)))[:, first : first + axes]), axis=1)
    F = np.where(still, amplitude / tool, F)
    outcomes = tuple(Outcome.CONVERGED if ok else reasons[i] for i, ok in enumerate(hit))
    return _State(G[:, None], F, outcomes)


def _reach(joint: Joint, omega: Array, excess: object, every: Index) -> float:
    """An amplitude in m at which the tool moves more than asked for on every line."""
    coarse = np.geomspace(1e-12, _FURTHEST, 61)
    assert callable(excess)
    over = np.all(excess(coarse, gain_table(joint, omega, coarse)[0], every) >= 0, axis=0)
    return float(coarse[int(np.argmax(over))]) if np.any(over) else _FURTHEST


def _root(function: object, at: Index, low: Array, high: Array) -> Array:
    """Regula falsi with halved weights (Illinois) for all lines at once."""
    assert callable(function)
    if not len(at):
        return high
    at_low, at_high = function(low, at), function(high, at)
    at_low = np.where(at_low < 0, at_low, -1e-300)
    x = high.copy()
    left, side = np.arange(len(at)), np.zeros(len(at))
    for _ in range(_STEPS):
        a, b, fa, fb = low[left], high[left], at_low[left], at_high[left]
        new = np.where(fb > fa, (a * fb - b * fa) / np.where(fb > fa, fb - fa, 1.0), (a + b) / 2)
        f = function(new, at[left])
        below = f < 0
        # An end loses half its weight where it stays for a second time; sooner, and the rest would only be halved.
        again = np.where(below == (side[left] < 0), 0.5, 1.0)
        side[left] = np.where(below, -1.0, 1.0)
        low[left], high[left] = np.where(below, new, a), np.where(below, b, new)
        at_low[left], at_high[left] = np.where(below, f, fa * again), np.where(below, fb * again, f)
        done = np.abs(new - x[left]) <= _SETTLED * new
        x[left] = new
        left = left[~done]
        if not len(left):
            break
    return x


def _joints(assembly: Assembly, view: View, axes: int, amplitude: float) -> _State:
    """Several joints, or none."""
    joints = assembly.moving
    first, lines = len(assembly.joints), len(view.omega)
    direct, through = view.Hof[:, first : first + axes, 0], view.Hoz[:, first : first + axes]
    if not joints:
        none = np.zeros((lines, 0), dtype=complex)
        return _State(none, amplitude / np.max(np.abs(direct), axis=1), (Outcome.CONVERGED,) * lines)
    caps = np.array([limit.amplitude / 4 for limit in assembly.limits])
    found = solve_prescribed(view, joints, caps, direct, through, amplitude)
    outcomes = np.array([Outcome.CONVERGED if c else Outcome.STALLED for c in found.converged], dtype=object)
    for j, limit in enumerate(assembly.limits):
        for wrong, outcome in (
            (np.abs(found.z[:, j]) > limit.amplitude, limit.outcome),
            (feeds_energy(found.gain[:, j]), Outcome.NEGATIVE_DAMPING),
        ):
            outcomes[found.converged & wrong] = outcome
    return _State(_held(assembly, found, outcomes, view.omega), found.force, tuple(outcomes))


def _held(assembly: Assembly, found: Prescribed, outcomes: Reasons, omega: Array) -> ComplexArray:
    """Gains where a joint would leave its range, or nothing settled: of the amplitude found, but no further than
    the limit."""
    out = found.gain.copy()
    past = np.flatnonzero(outcomes != Outcome.CONVERGED)
    for j, limit in enumerate(assembly.limits):
        if len(past):
            joint = assembly.joints[assembly.nonlinear[j]]
            A = np.abs(found.z[past, j])
            ends = np.minimum(np.where(np.isfinite(A), A, limit.amplitude), limit.amplitude)
            out[past, j] = joint.first_harmonic(np.where(np.isfinite(ends), ends, _BARELY_MOVING), omega[past]).gain
    return out
