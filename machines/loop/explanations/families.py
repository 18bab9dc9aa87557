"""Further laws that a joint may lack, sized to the motion that was measured."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np

from jointlib.arrays import Array
from jointlib.law import JointLaw
from jointlib.laws.bouc_wen import BoucWen
from jointlib.laws.contact_loss import ContactLoss
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.cubic import Cubic
from jointlib.laws.dahl import Dahl
from jointlib.laws.gap import Gap
from jointlib.laws.iwan import Iwan
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.maxwell import Maxwell
from jointlib.laws.polynomial import Polynomial
from jointlib.laws.quadratic_damping import QuadraticDamping
from jointlib.laws.stribeck import Stribeck
from jointlib.laws.structural_damping import StructuralDamping

from ...model.machine import Machine
from .hypothesis import Coordinate, Hypothesis, own_coordinates
from .places import Place

_WIDE = 2.5
"""Prior deviation of the logarithm of a size nothing is known of: a factor of twelve either way."""
_ELEMENTS = np.array([0.2, 0.6, 1.4, 3.0])
"""Slip distances of an Iwan chain over its mean one."""
_LENGTHS = (-4.0, -3.2, -2.4, -1.8, -1.2, -0.6, 0.0, 0.6, 1.2)
_SHARP = -12.0
"""Logarithm of the smallest smoothing velocity that is tried over that to begin with. Dry friction has none, and small
levels beside large ones see the corner of a larger one."""
_BUMP = 5.0
"""Stribeck velocity over smoothing velocity."""


@dataclass(frozen=True)
class Motion:
    """How a place moves at the measured lines, with the joints as they came in."""

    amplitude: float
    """Largest in m."""
    typical: float
    """m; the amplitude at the lines where most is left unexplained."""
    omega: float
    """rad/s there."""
    stiffness: float
    """N/m."""


@dataclass(frozen=True)
class Family:
    """One effect as a law of a few numbers; ``member`` is the kind of law where several make one family."""

    name: str
    member: str
    fields: tuple[str, ...]
    laws: Callable[[Array], tuple[JointLaw, ...]]
    sizes: Callable[[Motion], tuple[tuple[float, bool, tuple[float, ...]], ...]]
    """Per field: reference, whether its logarithm is fitted, and the u to begin at."""
    linear: int = 1
    """So many leading fields are sizes, in which the force is linear; the others are shapes."""

    def at(self, machine: Machine, place: Place, motion: Motion, alone: bool = False) -> Hypothesis:
        """The family at a place; ``alone`` holds the joint's own parameters."""
        laid = self.sizes(motion)
        added = []
        for name, (reference, log, _) in zip(self.fields, laid, strict=True):
            key = f"{(self.member or self.name).replace('-', '_')}.{name}"
            if log:
                low = _SHARP if name.startswith("smoothing") else -9.0
                added.append(Coordinate(key, reference, True, _WIDE, low=low, high=7.0))
            else:
                added.append(Coordinate(key, reference, False, 3.0, low=-10.0, high=10.0))
        starts = tuple(product(*(grid for _, _, grid in laid)))
        own = () if alone else own_coordinates(machine, place)
        return Hypothesis(place, self.name, self.member, own, tuple(added), self.laws, starts, machine=machine)


def _f(values: Array) -> list[float]:
    return [float(v) for v in values]


_LOG = np.log
STIFFNESS = Family(
    "stiffness", "linear", ("stiffness",), lambda v: (Linear(*_f(v)),), lambda m: ((m.stiffness, False, (0.0,)),)
)
DAMPING = Family(
    "damping",
    "viscous",
    ("damping",),
    lambda v: (Polynomial(((0.0, float(v[0])),)),),
    lambda m: ((m.stiffness / m.omega, False, (0.0,)),),
)
CUBIC = Family(
    "cubic",
    "cubic",
    ("stiffness3",),
    lambda v: (Cubic(*_f(v)),),
    lambda m: ((4 / 3 * m.stiffness / m.typical**2, False, (-0.15, -0.04, 0.04, 0.15)),),
)
COULOMB = Family(
    "coulomb",
    "coulomb",
    ("slip_force", "smoothing_velocity"),
    lambda v: (Coulomb(*_f(v)),),
    lambda m: (
        (np.pi / 4 * m.stiffness * m.typical, True, (-5.0, -3.0, -1.5)),
        (0.03 * m.typical * m.omega, True, (-2.0, 0.0, 2.0)),
    ),
)
STRIBECK = Family(
    "stribeck",
    "stribeck",
    ("slip_force", "static_force", "smoothing_velocity"),
    lambda v: (Stribeck(float(v[0]), float(v[0] + v[1]), _BUMP * float(v[2]), float(v[2])),),
    lambda m: (
        (np.pi / 4 * m.stiffness * m.typical, True, (-5.0, -3.0)),
        (np.pi / 4 * m.stiffness * m.typical, True, (-4.0,)),
        (0.1 * m.typical * m.omega, True, (-2.0, -0.5, 1.0)),
    ),
    2,
)
QUADRATIC_DAMPING = Family(
    "quadratic-damping",
    "quadratic-damping",
    ("damping2",),
    lambda v: (QuadraticDamping(*_f(v)),),
    lambda m: ((3 * np.pi / 8 * m.stiffness / (m.typical * m.omega**2), True, (-5.0, -3.0, -1.5)),),
)
GAP = Family(
    "gap",
    "gap",
    ("stiffness", "clearance"),
    lambda v: (Gap(*_f(v)),),
    lambda m: ((m.stiffness, True, (-2.0, -0.7)), (m.typical, True, _LENGTHS)),
)
CONTACT_LOSS = Family(
    "contact-loss",
    "contact-loss",
    ("stiffness", "clearance"),
    lambda v: (ContactLoss(*_f(v)),),
    lambda m: ((m.stiffness, False, (-0.4, 0.15, 0.6)), (m.typical, True, _LENGTHS)),
)
_SLIP = _LENGTHS
JENKINS = Family(
    "hysteresis",
    "jenkins",
    ("stiffness", "slip_force"),
    lambda v: (Jenkins(float(v[0]), float(v[0] * v[1])),),
    lambda m: ((m.stiffness, True, (-2.5, -0.8)), (m.typical, True, _SLIP)),
)
DAHL = Family(
    "hysteresis",
    "dahl",
    ("stiffness", "slip_force"),
    lambda v: (Dahl(float(v[0]), float(v[0] * v[1])),),
    lambda m: ((m.stiffness, True, (-2.5, -0.8)), (m.typical, True, _SLIP)),
)
BOUC_WEN = Family(
    "hysteresis",
    "bouc-wen",
    ("stiffness", "slip_force"),
    lambda v: (BoucWen(float(v[0]), float(v[0] * v[1]), 2.0, 0.5),),
    lambda m: ((m.stiffness, True, (-2.5, -0.8)), (m.typical, True, _SLIP)),
)
IWAN = Family(
    "hysteresis",
    "iwan",
    ("stiffness", "slip_force"),
    lambda v: (Iwan((float(v[0]) / 4,) * 4, tuple((float(v[0] * v[1]) / 4 * _ELEMENTS).tolist())),),
    lambda m: ((m.stiffness, True, (-2.5, -0.8)), (m.typical, True, _SLIP)),
)
STRUCTURAL = Family(
    "structural-damping",
    "structural-damping",
    ("loss_stiffness",),
    lambda v: (StructuralDamping(*_f(v)),),
    lambda m: ((m.stiffness, True, (-4.0, -2.0)),),
)
RELAXATION = Family(
    "relaxation",
    "maxwell",
    ("stiffness", "damping"),
    lambda v: (Maxwell(float(v[0]), float(v[0] * v[1])),),
    lambda m: ((m.stiffness, True, (-3.0, -1.0)), (1 / m.omega, True, (-1.5, 0.0, 1.5))),
)
EFFECTS = (
    CUBIC,
    GAP,
    CONTACT_LOSS,
    COULOMB,
    STRIBECK,
    QUADRATIC_DAMPING,
    JENKINS,
    DAHL,
    BOUC_WEN,
    IWAN,
    STRUCTURAL,
    RELAXATION,
)
"""All that a describing function about a zero mean can see."""
