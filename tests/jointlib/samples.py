"""One sensible set of parameters for every law, at the scale of a stiff guide; a new law must be added here."""

from __future__ import annotations

from jointlib.law import JointLaw
from jointlib.laws.bouc_wen import BoucWen
from jointlib.laws.chebyshev import Chebyshev
from jointlib.laws.contact_loss import ContactLoss
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.cubic import Cubic
from jointlib.laws.dahl import Dahl
from jointlib.laws.gap import Gap
from jointlib.laws.hertz_contact import HertzContact
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.laws.iwan import Iwan
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.lugre import LuGre
from jointlib.laws.maxwell import Maxwell
from jointlib.laws.polynomial import Polynomial
from jointlib.laws.quadratic import Quadratic
from jointlib.laws.quadratic_damping import QuadraticDamping
from jointlib.laws.stribeck import Stribeck
from jointlib.laws.structural_damping import StructuralDamping
from jointlib.laws.tabulated import Tabulated
from jointlib.laws.viscous import Viscous
from jointlib.laws.viscous_by_direction import ViscousByDirection

KAPPA = 3.931408125e-8
"""m/N^(2/3): gives 654.164 N/um at 630 N and 45 degrees."""

SURFACE = ((0.0, 463.062), (654.164e6, 0.0), (0.0, -19.8415e12), (-1.7083e18, 0.0))
"""Eq. 33 of Dhupia et al. 2008 as a polynomial surface, signs as docs/paper.md argues."""

LAWS: tuple[JointLaw, ...] = (
    HertzGuide(630.0, KAPPA),
    HertzContact(630.0, KAPPA),
    Polynomial(SURFACE),
    Polynomial(((1.0, 400.0, 3.0), (6e8, 2e7, 1e6), (1e13, 1e12, 5e11))),
    Chebyshev(((3.0, 60.0), (2600.0, -4.0), (5.0, 7.0), (-40.0, 2.0)), 4e-6, 0.12),
    Linear(6e8),
    Viscous(503.0),
    ViscousByDirection(480.0, 530.0),
    QuadraticDamping(5.0e3),
    Quadratic(2e13),
    Cubic(-1.7e18),
    Coulomb(20.0),
    Coulomb(20.0, 1e-3),
    Stribeck(20.0, 30.0, 0.02, 1e-3),
    Gap(6e8, 1.5e-6),
    ContactLoss(3e8, 1.2e-6, -1.0),
    ContactLoss(-3e8, 1.2e-6, 1.0),
    Jenkins(4e7, 36.0),
    Jenkins(4e7, 36.0, 2e-7),
    Iwan((2e7, 1.5e7, 5e6), (8.0, 15.0, 13.0)),
    Iwan((2e7, 2e7), (3.0, 3.6), 1e-7),
    Dahl(4e7, 36.0),
    Dahl(4e7, 36.0, 1e-7),
    BoucWen(4e7, 36.0),
    BoucWen(4e7, 12.0, 2.2, 0.3),
    BoucWen(4e7, 6.0, 1.6, 0.7, 1e-7),
    LuGre(4e7, 300.0, 36.0, 50.0, 0.02),
    Maxwell(4e7, 1.2e4),
    StructuralDamping(2e7),
    StructuralDamping(2e7, 1000.0),
    Tabulated((4e-7, 6e-7, 1e-6, 2e-6), (6e8, 5e8, 4.5e8, 4.4e8), (500.0, 900.0, 1100.0, 1000.0)),
)


def label(law: JointLaw) -> str:
    """Short name for a test."""
    return f"{law.kind}-{LAWS.index(law)}" if law in LAWS else law.kind
