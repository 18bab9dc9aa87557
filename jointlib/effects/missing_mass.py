"""A body whose mass is not what was declared."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.fault import Fault, RigRecord, Shape
from jointlib.measurement import Mass


class MissingMass(Fault):
    """true mass = declared mass + mass, of either sign: a fixture that was not weighed, a cable that does not ride.

    With A its acceleration, (B, R, J) is (mass·A, 0, 0) for the driven body and (mass·A, 0, −mass·A) for the others.
    In the balance a gain of its accelerometer is the same column, the mass times as large: the two differ only by what
    the gain does to R and, through z, to the joint force.
    """

    family: ClassVar[str] = "missing-mass"
    words: ClassVar[str] = "that the mass of {site} is not what was declared (missing-mass)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "missing-mass": "Weigh the bodies apart, or bolt a known mass to one: bodies that move as one share it.",
        "gain": "Weigh the bodies, or bolt on a known mass, and excite an octave or more.",
    }
    declared_pairs: ClassVar[frozenset[str]] = frozenset({"missing-mass", "gain"})
    on: ClassVar[str] = "body"
    parameters: ClassVar[Mapping[str, str]] = {"mass": "kg"}
    experiment: ClassVar[str] = "Weigh the bodies, or measure the driving force too."

    def sites(self, record: RigRecord) -> tuple[str, ...]:
        return tuple(a for a in super().sites(record) if a in record.masses)

    def columns(self, record: RigRecord, site: str, shape: Shape) -> ComplexArray:
        A = record.masked(site)
        return record.on_equations(balance=A, joint=0 if site == "a1" else -A)[None]

    def correction(self, coefficients: Array, shape: Shape) -> Mapping[str, float] | None:
        return {"mass": float(coefficients[0])}

    def mended_masses(
        self, bodies: Mapping[str, Mass], site: str, parameters: Mapping[str, float]
    ) -> Mapping[str, Mass]:
        declared = bodies[site].value
        if declared is None:
            raise InputError(f"correction missing-mass: the mass of {site!r} is unknown, expected kg to correct")
        mended = declared + parameters["mass"]
        if mended <= 0:
            raise InputError(
                f"correction missing-mass: {site!r} of {declared:g} kg and {parameters['mass']:g} kg more would weigh "
                f"{mended:g} kg, expected a mass above 0"
            )
        return {**bodies, site: replace(bodies[site], value=mended)}
