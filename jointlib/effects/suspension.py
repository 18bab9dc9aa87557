"""A body of the rig that is held to ground."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.fault import Fault, RigRecord, Shape
from jointlib.measurement import Mass

_EXCITED = 1e-2
"""Lines within 40 dB of the largest of the driving force are excited."""


class Suspension(Fault):
    """A soft spring and damper between a body and the ground: elastic cords, foam, the stinger's own guide.

    It pulls with k x + c ẋ, which per acceleration A is q = −k/ω² + c/(jω): (B, R, J) is (q·A, 0, 0) for the driven
    body and (q·A, 0, −q·A) for what is carried. A mass that is off by −k/ω² does the same on one line; over an octave
    the two part. Bodies behind the joint move as one and are held as one, so they are tried as one.
    """

    family: ClassVar[str] = "suspension"
    words: ClassVar[str] = "that {site} is held to ground (suspension)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "missing-mass": "Excite lower frequencies: there a suspension pulls more and a mass as before.",
        "gain": "Excite lower frequencies: there a suspension pulls more and a gain as before.",
        "delay": "Excite lower frequencies: there a suspension pulls more and a delay does less.",
        "rocking-mode": "Excite lower frequencies: there a suspension pulls more and the mode fades.",
    }
    on: ClassVar[str] = "body"
    parameters: ClassVar[Mapping[str, str]] = {"stiffness": "N/m", "damping": "N s/m"}
    experiment: ClassVar[str] = "Measure the driving force too, or hang the bodies on softer cords."

    def sites(self, record: RigRecord) -> tuple[str, ...]:
        return tuple(a for a in ("a1", "a2") if a in record.masses and record.has(a))

    def columns(self, record: RigRecord, site: str, shape: Shape) -> ComplexArray:
        X, V = _moved(record, site)
        return np.stack([record.on_equations(balance=F, joint=0 if site == "a1" else -F) for F in (X, V)])

    def correction(self, coefficients: Array, shape: Shape) -> Mapping[str, float] | None:
        return {"stiffness": float(coefficients[0]), "damping": float(coefficients[1])}

    def possible(self, record: RigRecord, site: str, parameters: Mapping[str, float]) -> bool:
        """What pulls more, spring or damper, must not push; the other may be noise."""
        k, c = record.suspension(site)
        k, c = k + parameters["stiffness"], c + parameters["damping"]
        X, V = (float(np.linalg.norm(x)) for x in _moved(record, site))
        return k > 0 if abs(k) * X >= abs(c) * V else c > 0

    def mended_masses(
        self, bodies: Mapping[str, Mass], site: str, parameters: Mapping[str, float]
    ) -> Mapping[str, Mass]:
        held = bodies[site]
        stiffness, damping = (getattr(held, n) + parameters[n] for n in ("stiffness", "damping"))
        if stiffness < 0 and damping < 0:
            raise InputError(
                f"correction suspension: {site!r} would be held by {stiffness:g} N/m and {damping:g} N s/m, "
                "expected one of them above 0"
            )
        return {**bodies, site: replace(held, stiffness=stiffness, damping=damping)}


def _moved(record: RigRecord, site: str) -> tuple[ComplexArray, ComplexArray]:
    """Spectra of displacement in m and velocity in m/s of what moves with an accelerometer, on excited lines alone.

    Of noise that chances to pass as motion, 1/ω² would make more below the band than all motion within it.
    """
    A, per_omega = record.masked(site), 1 / np.where(record.omega > 0, record.omega, np.inf)
    drive = np.abs(record.masked("P")) * (record.on_period & (record.omega > 0))
    A = np.where(drive > _EXCITED * drive.max(), A, 0)
    return -A * per_omega**2, -1j * A * per_omega
