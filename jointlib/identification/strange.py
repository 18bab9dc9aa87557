"""What a fit finds that no joint and no carriage has: a sign or a unit of the records is wrong."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.measurement import Measurement
from jointlib.units import with_error

_SAMPLES, _SLOW = 200, 0.01
"""Samples of a cycle along which a joint is asked for its stiffness, and its frequency in Hz."""
_LIGHT, _HEAVY = 0.05, 5e3
"""kg, beyond which a carriage is strange: 1 kg and 250 kg of which a unit is wrong by a thousand lie there."""
_CERTAIN = 3.0
"""Standard errors by which a mass is below zero for certain."""
_YIELDS = -0.2
"""Correlation of force and velocity below which a path yields energy; inertia and springs take none over a cycle."""


def strange_mass(measurement: Measurement, value: float, error: float) -> list[str]:
    """A sentence where the mass that moves with a path is none that a carriage has; below zero for certain it is
    refused, as all that was fitted beside it is as wrong."""
    if any(c.si_unit == "V" for q in ("force", "displacement", "position") for c in measurement.of(q)):
        return []
    found = f"The moving mass comes out at {with_error(value, error, 'kg')}"
    below = (
        f"{found}, below zero, which no carriage has: the sign of the force, of the displacement or of an acceleration "
        "is turned, look at the gain of the [[channel]]"
    )
    if value + _CERTAIN * error < 0:
        raise InputError(
            f"{measurement.source}: {below}; or the joint lacks a stiffness, which a mass below zero stands in for. "
            "Nothing is written; with the mass that was weighed as carriage it is not asked for."
        )
    if value + error < 0:
        return [f"{below}, or the records do not tell the mass."]
    if value - error > _HEAVY or 0 < value + error < _LIGHT:
        return [
            f"{found}, which few carriages have: look at the units of force, displacement and sample_rate, or say the "
            "mass that was weighed as carriage."
        ]
    return []


def yielding(records: Iterable[tuple[Array, Array]]) -> list[str]:
    """A sentence where force and velocity of every record have opposite signs, so that the path would drive itself."""
    shares = []
    for force, velocity in records:
        F, v = force - np.mean(force), velocity - np.mean(velocity)
        size = float(np.sqrt((F @ F) * (v @ v)))
        shares.append(float(F @ v) / size if size else 0.0)
    if not shares or max(shares) > _YIELDS:
        return []
    return [
        "The force acts against the velocity in every record, so the path would yield energy where friction takes it: "
        "the sign of the force or of the displacement is turned, say gain = -1 on its [[channel]]."
    ]


def turned(joint: Joint) -> list[str]:
    """A sentence where the joint, over the motion of its records, pulls the way it is pulled, as if a sign were wrong.

    Its stiffness is that of the first harmonic along a slow cycle, ∮ f z / ∮ z².
    """
    largest = joint.validity.get("amplitude", (0.0, 0.0))[1]
    if not np.isfinite(largest) or largest <= 0:
        return []
    phase = 2 * np.pi * np.arange(2 * _SAMPLES) / _SAMPLES
    z, v = largest * np.sin(phase), 2 * np.pi * largest * np.cos(phase)
    force = joint.force_along(z, v * _SLOW, 1 / (_SLOW * _SAMPLES))
    last = slice(_SAMPLES, None)
    stiffness = float(np.mean((force[last] - np.mean(force[last])) * z[last]) / np.mean(z[last] ** 2))
    if not stiffness < 0:
        return []
    return [
        f"Over its {largest * 1e6:.3g} um the joint has a stiffness of {stiffness * 1e-6:.4g} N/um, below zero: it "
        "pushes on the way it is moved. The sign of the force or of the displacement is turned, look at the gain of "
        "the [[channel]], unless the records hold a motion that snaps through."
    ]
