"""Where a joint model ends: the range it was identified on, and where a fit stops being a joint."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import Outcome
from jointlib.joint import Joint
from jointlib.law import Motion

from ..indices import Mask
from .machine import Machine

_REACH = 1.0
"""m; no machine joint moves further."""
_FALLING = 1e-9
_FEEDING = 1e-12


@dataclass(frozen=True)
class Limit:
    """Largest amplitude in m at which a joint may be used, and why; infinite where nothing is known."""

    amplitude: float
    outcome: Outcome


def past_limits(
    limits: Sequence[Limit], z: ComplexArray, gain: ComplexArray, slack: float = 0.0
) -> Iterator[tuple[Mask, Outcome]]:
    """Where each joint passes its limit by more than a share of ``slack``, or feeds energy; (points, joints)."""
    for j, limit in enumerate(limits):
        yield np.abs(z[:, j]) > limit.amplitude * (1 + slack), limit.outcome
        yield feeds_energy(gain[:, j]), Outcome.NEGATIVE_DAMPING


def amplitude_limit(joint: Joint) -> Limit:
    """The identified range, or the displacement at which the static force begins to fall, whichever is lower.

    A force that falls with displacement, ∂f/∂z < 0 at rest, is what a polynomial fit does outside its data. Laws
    with memory are not looked at: slipping friction is no artefact.
    """
    valid = joint.validity.get("amplitude", (0.0, np.inf))[1]
    if joint.states:
        return Limit(valid, Outcome.OUT_OF_RANGE)
    reach = min(valid, _REACH)
    peaks = [_force_peak(joint, side, reach) for side in (1.0, -1.0)]
    peak = min(peaks)
    return Limit(peak, Outcome.PAST_FORCE_PEAK) if peak < valid else Limit(valid, Outcome.OUT_OF_RANGE)


def _force_peak(joint: Joint, side: float, reach: float) -> float:
    """Smallest displacement in m on one side past which the static force falls; infinite if there is none."""

    def tangent(z: Array) -> Array:
        at = side * np.atleast_1d(z)
        return joint.jacobian(Motion(at, np.zeros_like(at)), joint.initial_state(at))[0]

    z = np.concatenate([[0.0], np.geomspace(1e-10, reach, 400)])
    slope = tangent(z)
    falling = slope < -_FALLING * np.maximum.accumulate(np.abs(slope))
    if not np.any(falling):
        return np.inf
    first = int(np.argmax(falling))
    if first == 0:
        return np.inf
    low, high = z[first - 1], z[first]
    for _ in range(9):
        between = np.linspace(low, high, 65)
        k = max(1, int(np.argmax(tangent(between) < 0)))
        low, high = between[k - 1], between[k]
    return float(high)


def feeds_energy(gain: ComplexArray) -> Mask:
    """Where Im G is negative beyond rounding: the joint would drive the machine."""
    return np.asarray(gain.imag < -_FEEDING * np.abs(gain))


def beyond_frequency(machine: Machine, low: float, high: float) -> tuple[str, ...]:
    """A sentence for every joint that is used at frequencies (Hz) other than those it was identified on.

    That is said and not refused: a law in time holds at any frequency as far as its form is right, whereas past the
    identified amplitude the form itself is unknown.
    """
    said = []
    for connection, joint in zip(machine.flexible, machine.joints(), strict=True):
        first, last = joint.validity.get("frequency", (0.0, np.inf))
        if low < first * (1 - 1e-12) or high > last * (1 + 1e-12):
            said.append(
                f"{connection.name}: used from {low:g} to {high:g} Hz, identified from {first:g} to {last:g} Hz; "
                "its laws are carried over to the other frequencies."
            )
    return tuple(said)
