"""Where a fit starts when nobody says: laws of the asked kinds at the size of the data."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from jointlib.errors import InputError
from jointlib.identification.force_balance import ForceBalance
from jointlib.joint import Joint
from jointlib.law import JointLaw
from jointlib.parameter import Parameter, Role, parameters_of
from jointlib.registry import law

_SMOOTHING = 0.03
"""Smoothing velocity of friction as a share of the rms velocity."""
_SLIDERS = (0.1, 0.3, 0.6, 1.0)
"""Displacements at which the elements of a law of several begin to slip, as shares of the amplitude √2·rms."""


@dataclasses.dataclass(frozen=True)
class Size:
    """Root mean square of what was measured: z in m, ż in m/s, f in N, and the stiffness f/z of best fit."""

    displacement: float
    velocity: float
    force: float
    stiffness: float

    def scaled(self, share: float) -> Size:
        """Of a joint as stiff that bends at this share of the motion."""
        return Size(share * self.displacement, share * self.velocity, share * self.force, self.stiffness)


def size_of(balances: Sequence[ForceBalance]) -> Size:
    """Sizes over all records."""
    z = np.concatenate([b.rows(b.z - b.z.mean()) for b in balances])
    f = np.concatenate([b.target for b in balances])
    paths = np.concatenate([b.z - b.z.mean() for b in balances]), np.concatenate([b.v for b in balances])
    rms = [max(float(np.sqrt(np.mean(x**2))), 1e-30) for x in (*paths, f)]
    secant = abs(float(f @ z)) / max(float(z @ z), 1e-300)
    return Size(rms[0], rms[1], rms[2], max(secant, 1e-6 * rms[2] / rms[0]))


def first_laws(kinds: Sequence[str], size: Size) -> tuple[JointLaw, ...]:
    """Laws of these kinds with values guessed from the sizes; defaults are kept, but for smoothing."""
    laws = []
    for number, kind in enumerate(kinds, 1):
        cls = law(kind, f"law {number}")
        values = {p.name: _guess(p, size) for p in parameters_of(cls) if p.name not in _defaults(cls)}
        # The sign of a velocity that is noise at rest would bias the slip force: round it there.
        values |= {p.name: _SMOOTHING * size.velocity for p in parameters_of(cls) if p.role is Role.SMOOTHING}
        if {"preload", "kappa"} <= set(values):
            # A ball guide shaken to about its lift-off: d0/sin φ = z, K0 = 6 sin²φ P0/d0, at the assumed angle.
            sine = float(np.sin(_defaults(cls).get("contact_angle", np.pi / 4)))
            indentation = 2 * size.displacement * sine
            values["preload"] = size.stiffness * indentation / (6 * sine**2)
            values["kappa"] = indentation / float(np.cbrt(values["preload"])) ** 2
        listed = {p.name for p in parameters_of(cls) if p.listed}
        if listed and listed != {"stiffness", "slip_force"}:
            raise InputError(f"{kind}: no first values for its lists, expected a start joint that holds them (--start)")
        if listed:
            each = values["stiffness"] / len(_SLIDERS)
            values["stiffness"] = (each,) * len(_SLIDERS)
            values["slip_force"] = tuple(each * share * float(np.sqrt(2)) * size.displacement for share in _SLIDERS)
        laws.append(cls(**values))
    return tuple(laws)


def _defaults(cls: type[JointLaw]) -> dict[str, float]:
    fields = dataclasses.fields(cls)  # type: ignore[arg-type]
    return {f.name: f.default for f in fields if f.default is not dataclasses.MISSING}


def _guess(p: Parameter, size: Size) -> Any:
    """A value in the parameter's unit at the size of the data, well inside its bounds."""
    z, v, f = size.displacement, size.velocity, size.force
    by_unit = {
        "N": 0.2 * f,
        "N/m": 0.3 * size.stiffness,
        "N/m^2": 0.05 * f / z**2,
        "N/m^3": 0.05 * f / z**3,
        "N s/m": 0.05 * f / v,
        "N s^2/m^2": 0.05 * f / v**2,
        "m": 0.5 * z,
        "m/s": 0.3 * v,
        "m/N^(2/3)": z / f ** (2 / 3),
    }
    if p.unit not in by_unit:
        raise InputError(f"no first value for {p.name} in {p.unit}; give a start joint that holds one")
    return by_unit[p.unit]


def held_at_default(joint: Joint) -> frozenset[str]:
    """Parameters that are assumed and not fitted: those at the default of their law, and what no fit tells."""
    held = set()
    for part, item in zip(joint.part_names, joint.laws, strict=True):
        defaults = _defaults(type(item))
        for p in parameters_of(item):
            untold = p.unit in ("rad", "1") or p.role is Role.SMOOTHING
            if not p.table and (untold or defaults.get(p.name) == getattr(item, p.name)):
                held.add(f"{part}.{p.name}")
    return frozenset(held)
