"""Derivatives of dual-input describing functions by the static position: closed forms against differences."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from jointlib.arrays import Array
from jointlib.harmonic import numerical_first_harmonic
from jointlib.law import JointLaw
from jointlib.laws.contact_loss import ContactLoss
from jointlib.laws.cubic import Cubic
from jointlib.laws.gap import Gap
from jointlib.laws.hertz_contact import HertzContact
from jointlib.laws.hertz_guide import HertzGuide, row_parts
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous

GUIDE, CONTACT = HertzGuide(2000.0, 5e-8), HertzContact(2000.0, 5e-8)
OMEGA = np.array(300.0)
DEPTH = CONTACT.indentation
PIECES = [Gap(2e7, 0.37 * DEPTH), ContactLoss(3e7, 0.43 * DEPTH), ContactLoss(-3e7, 0.23 * DEPTH, -1.0)]


@pytest.mark.parametrize("law", [GUIDE, CONTACT, Linear(3e7), Viscous(200.0), *PIECES], ids=lambda law: law.kind)
def test_closed_forms_are_the_differences(law: JointLaw) -> None:
    """Always touching, lifting off in part of the cycle, far beyond; kinks themselves are left out."""
    A, z0 = np.meshgrid(DEPTH * np.array([0.03, 0.15, 0.31, 0.8, 1.7, 4.0]), DEPTH * np.array([-1.3, -0.45, 0.0, 0.6]))
    found = law.by_bias(A, OMEGA, z0)
    assert found is not None
    h = 1e-5 * DEPTH
    up, down = (law.first_harmonic(A, OMEGA, z0 + s * h) for s in (1, -1))
    more, less = (law.first_harmonic(A + s * h, OMEGA, z0) for s in (1, -1))
    scale = abs(law.first_harmonic(DEPTH, OMEGA).gain)
    # Central differences: h²/6 of a third derivative, and rounding over h.
    for own, other, unit in (
        (found[0], up.gain - down.gain, scale / DEPTH),
        (found[1], more.mean - less.mean, scale),
        (found[2], up.mean - down.mean, scale),
    ):
        np.testing.assert_allclose(own, other / (2 * h), rtol=1e-6, atol=1e-6 * unit)


@pytest.mark.parametrize("law", PIECES, ids=lambda law: f"{law.kind} {law.stiffness:g}")
def test_laws_of_straight_pieces_have_the_first_harmonic_of_their_quadrature(law: JointLaw) -> None:
    """About a mean: without vibration, within one piece, across one kink and across both."""
    A, z0 = np.meshgrid(DEPTH * np.array([0.0, 0.03, 0.2, 0.8, 4.0]), DEPTH * np.array([-1.3, -0.3, 0.0, 0.3, 0.6]))
    found, known = law.first_harmonic(A, OMEGA, z0), numerical_first_harmonic(law, A, OMEGA, z0)
    np.testing.assert_allclose(found.mean, known.mean, rtol=1e-12, atol=1e-12 * 3e7 * DEPTH)
    moving = A > 0  # without vibration quadrature takes one of 1e-9 of the largest amplitude
    np.testing.assert_allclose(found.gain[moving], known.gain[moving], rtol=1e-12, atol=1e-12 * 3e7)
    np.testing.assert_allclose(found.gain, known.gain, rtol=1e-7, atol=1e-7 * 3e7)
    np.testing.assert_allclose(found.d_amplitude, known.d_amplitude, rtol=1e-9, atol=1e-9 * 3e7 / DEPTH)


@pytest.mark.parametrize("law", [GUIDE, CONTACT], ids=lambda law: law.kind)
def test_without_vibration_the_mean_has_the_tangent_stiffness(law: HertzGuide | HertzContact) -> None:
    place = DEPTH * np.array([-1.4, -0.7, 0.0, 0.5])
    found = law.by_bias(np.zeros(4), OMEGA, place)
    np.testing.assert_allclose(found[2], law.slopes(place, np.zeros(4))[0], rtol=1e-9)
    np.testing.assert_array_equal(found[1], np.zeros(4))


def test_a_row_has_its_quadrature_on_both_sides_of_every_case() -> None:
    """2²⁰ points of the circle; (·)₊^(3/2) is smooth enough for 1e-11 even where the row parts."""
    theta = 2 * np.pi * np.arange(2**20) / 2**20
    for a, r in [
        (1.0, 0.199),
        (1.0, 0.201),
        (1.0, 0.999),
        (1.0, 1.001),
        (0.0, 1.0),
        (-0.5, 1.0),
        (-1.0, 0.9),
        (3.0, 1e-5),
    ]:
        load = np.maximum(a + r * np.cos(theta), 0)
        truth = (
            2 * np.mean(load**1.5 * np.cos(theta)),
            np.mean(load**1.5),
            3 * np.mean(np.sqrt(load) * np.cos(theta)),
        )
        np.testing.assert_allclose(row_parts(np.array(a), np.array(r)), truth, rtol=1e-7, atol=1e-11)


@pytest.mark.parametrize(
    "make",
    [
        lambda v: HertzContact(2000.0 * v, 5e-8 / v),
        lambda v: HertzGuide(2000.0 * v, 5e-8 / v, 0.5 + 0.1 * v),
        lambda v: Viscous(200.0 * v),
        lambda v: Linear(3e7 * v),
        lambda v: Cubic(4e17 * v),
    ],
)
def test_laws_side_by_side_are_those_one_by_one(make: Callable[[Array], JointLaw]) -> None:
    share = np.array([0.4, 1.0, 3.0])
    A = DEPTH * np.array([0.0, 0.03, 0.31, 0.8, 1.7, 4.0])[:, None] * np.ones(3)
    z0 = DEPTH * np.array([-1.3, -0.45, 0.6])
    law = make(share)
    assert type(law).side_by_side
    every, slopes = law.first_harmonic(A, OMEGA, z0), law.by_bias(A, OMEGA, z0)
    for j, v in enumerate(share):
        one = make(v)
        alone, slope = one.first_harmonic(A[:, j], OMEGA, z0[j]), one.by_bias(A[:, j], OMEGA, z0[j])
        for name in ("gain", "d_amplitude", "d_omega", "mean"):
            np.testing.assert_allclose(getattr(every, name)[:, j], getattr(alone, name), rtol=1e-12)
        for whole, part in zip(slopes, slope, strict=True):
            np.testing.assert_allclose(whole[:, j], part, rtol=1e-12)
