"""The bodies of the rig: which masses carry which accelerometer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.measurement import Mass, Measurement


@dataclass(frozen=True)
class Rig:
    """Masses in kg and what was measured: body 1 is driven, a2 (and a3) ride on the other side of the joint."""

    m1: float | None
    m2: float
    m3: float
    uncertainty: tuple[float, float, float]
    has_force: bool
    has_third: bool
    bodies: Mapping[str, str] = field(default_factory=dict)
    """The body that each accelerometer sits on."""
    suspensions: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """Stiffness in N/m and damping in N s/m by which what moves with an accelerometer is held to ground."""

    @property
    def masses(self) -> dict[str, float]:
        """kg that move with each accelerometer, those that are known."""
        m2, m3 = (self.m2, self.m3) if self.has_third else (self.passive_mass, 0.0)
        known = {"a1": self.m1, "a2": m2, "a3": m3 if self.has_third else None}
        return {name: m for name, m in known.items() if m is not None}

    def added(self, channel: str, mass: float = 0.0, stiffness: float = 0.0, damping: float = 0.0) -> Rig:
        """The rig with a body found to be heavier by so many kg, or held to ground by so much more."""
        k, c = self.suspension(channel)
        held = {channel: (k + stiffness, c + damping)} if stiffness or damping else {}
        rig = replace(self, suspensions={**self.suspensions, **held})
        if channel == "a1":
            return replace(rig, m1=None if rig.m1 is None else rig.m1 + mass)
        return replace(rig, m2=rig.m2 + mass) if channel == "a2" else replace(rig, m3=rig.m3 + mass)

    def suspension(self, channel: str) -> tuple[float, float]:
        """Its stiffness and damping where something holds what moves with an accelerometer, else zeros."""
        return self.suspensions.get(channel, (0.0, 0.0))

    def apparent_mass(self, channel: str, omega: Array) -> ComplexArray:
        """Force in N per m/s² of what moves with an accelerometer: m − k/ω² + c/(jω); m at ω = 0, where nothing moves.

        The suspension pulls with k x + c ẋ, and x = −a/ω², ẋ = a/(jω). One number where nothing holds the body.
        """
        m, (k, c) = self.masses[channel], self.suspension(channel)
        if not k and not c:
            return np.asarray(m, dtype=complex)
        per_omega = 1 / np.where(omega > 0, omega, np.inf)
        return np.asarray(m - k * per_omega**2 - 1j * c * per_omega)

    def two_sides(self, omega: Array) -> tuple[ComplexArray, ComplexArray]:
        """Apparent masses on the driven and on the other side of the joint, where those move as one; needs m1."""
        parts = {a: self.apparent_mass(a, omega) for a in self.masses}
        driven = parts.pop("a1")
        return driven, np.asarray(sum(parts.values()))

    @property
    def has_balance(self) -> bool:
        return self.has_force and self.m1 is not None

    @property
    def passive_mass(self) -> float:
        return self.m2 + self.m3


def rig_of(measurement: Measurement) -> Rig:
    """Masses of the bodies that the accelerometers sit on; both sensors on one body share its mass."""
    names = [c.name for c in measurement.channels]

    def body(channel: str) -> str:
        return str(measurement.channel(channel).body)

    driven = str(measurement.driven)
    if body("a1") != driven:
        raise InputError(f"{measurement.source}: a1 sits on {body('a1')!r}, expected it on the driven body {driven!r}")
    others = {n: m for n, m in measurement.bodies.items() if n != driven}
    for name, mass in others.items():
        if mass.value is None:
            raise InputError(
                f"{measurement.source}: mass of {name!r} is unknown, expected kg: the joint force needs it"
            )
    if body("a2") not in others:
        raise InputError(f"{measurement.source}: a2 sits on the driven body, expected it across the joint")
    third = "a3" in names
    second = others.pop(body("a2"))
    if third and body("a3") == body("a2"):
        whole = (second.value or 0.0, second.uncertainty, second.stiffness, second.damping)
        half = Mass(*(x / 2 for x in whole))
        second, carried = half, [half, *others.values()]
    else:
        carried = list(others.values())
    m3 = sum(float(m.value or 0.0) for m in carried)
    u3 = float(np.sqrt(sum(m.uncertainty**2 for m in carried)))
    first = measurement.bodies[driven]
    uncertainty = (first.uncertainty, second.uncertainty, u3)
    bodies: dict[str, str] = {name: body(name) for name in ("a1", "a2", "a3") if name in names}
    held = {"a1": [first], "a2": [second], "a3": carried} if third else {"a1": [first], "a2": [second, *carried]}
    suspensions = {a: (sum(b.stiffness for b in on), sum(b.damping for b in on)) for a, on in held.items()}
    return Rig(first.value, float(second.value or 0.0), m3, uncertainty, "P" in names, third, bodies, suspensions)
