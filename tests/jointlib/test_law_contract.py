"""What holds for every law: closed form, derivatives, energy, purity, Jacobian."""

from __future__ import annotations

import copy
import dataclasses

import numpy as np
import pytest
from repeats import repeats
from samples import LAWS, label

from jointlib.errors import InputError
from jointlib.harmonic import numerical_first_harmonic
from jointlib.joint import Joint
from jointlib.law import JointLaw, Motion
from jointlib.parameter import parameters_of
from jointlib.registry import laws

IN_TIME = [law for law in LAWS if law.in_time]
without_memory = pytest.mark.parametrize("law", [law for law in IN_TIME if not law.states], ids=label)
law_in_time = pytest.mark.parametrize("law", IN_TIME, ids=label)
every_law = pytest.mark.parametrize("law", LAWS, ids=label)
INTEGRATED = frozenset({"bouc-wen", "lugre", "maxwell"})
"""Laws whose steps integrate: of second or third order in the step, where the others are exact on a monotone path."""


def quick(law: JointLaw) -> bool:
    """A cycle of it costs little: it is not stepped, or by a slider alone."""
    return not law.states or law.kind == "jenkins"


OMEGA = 2 * np.pi * 500.0
AMPLITUDE = np.array([0.3e-6, 1.4e-6, 2.7e-6, 6.0e-6, 20e-6])


def test_every_installed_law_is_held_to_the_contract() -> None:
    assert {law.kind for law in LAWS} == set(laws())
    assert all(cls.kind == word for word, cls in laws().items())


@pytest.mark.parametrize("law", repeats(IN_TIME, quick, lambda law: law.kind not in ("dahl", "bouc-wen")), ids=label)
def test_describing_function_equals_the_first_harmonic_of_the_cycle(law: JointLaw) -> None:
    given = law.first_harmonic(AMPLITUDE, OMEGA)
    found = numerical_first_harmonic(law, AMPLITUDE, OMEGA)
    joint = Joint((law,))
    z, v = (x[:, None] for x in (AMPLITUDE, AMPLITUDE * OMEGA))
    peak = np.max(np.abs([joint.force_along(s * z, t * v) for s in (-1, 0, 1) for t in (-1, 0, 1)])) + 1e-300
    size = peak / np.min(AMPLITUDE)
    loose = law.kind == "jenkins" and getattr(law, "clearance", 0.0) > 0
    integrated = law.kind in INTEGRATED and not (law.kind == "bouc-wen" and getattr(law, "exponent", 0) == 1)
    # The quadrature of an integrated law is off by about what 24 instead of 32 points change, at second order or more.
    atol = 2 * found.error + given.error if integrated else 1e-12 * size
    assert np.all(np.abs(given.gain - found.gain) <= 1e-9 * np.abs(found.gain) + atol)
    loose |= integrated
    # A stuck element with play is loaded one-sidedly from its virgin state: its kinks are not those of the steady loop.
    assert np.all(found.error <= (1e-3 if loose else 1e-9) * size)


@without_memory
def test_describing_function_with_a_bias_equals_the_first_harmonic(law: JointLaw) -> None:
    bias = np.array([0.2e-6, -1.0e-6, 3.0e-6])[:, None]
    given, found = law.first_harmonic(AMPLITUDE, OMEGA, bias), numerical_first_harmonic(law, AMPLITUDE, OMEGA, bias)
    np.testing.assert_allclose(given.gain, found.gain, rtol=1e-9, atol=1e-12 * np.max(np.abs(found.gain)))
    peak = np.max(np.abs(law.first_harmonic(AMPLITUDE, OMEGA, bias).gain * AMPLITUDE)) + 1.0
    np.testing.assert_allclose(given.mean, found.mean, rtol=1e-9, atol=1e-12 * peak)


@pytest.mark.thorough
@every_law
def test_derivatives_of_the_gain_are_its_differences(law: JointLaw) -> None:
    harmonic = law.first_harmonic(AMPLITUDE, OMEGA)
    h = 1e-5
    by_amplitude = (
        law.first_harmonic(AMPLITUDE * (1 + h), OMEGA).gain - law.first_harmonic(AMPLITUDE * (1 - h), OMEGA).gain
    )
    by_omega = law.first_harmonic(AMPLITUDE, OMEGA * (1 + h)).gain - law.first_harmonic(AMPLITUDE, OMEGA * (1 - h)).gain
    size = np.max(np.abs(harmonic.gain))
    # A second-order difference: truncation h² and rounding 1e-16/h, both below 1e-9 of the gain over its argument.
    np.testing.assert_allclose(harmonic.d_amplitude * AMPLITUDE, by_amplitude / (2 * h), rtol=1e-6, atol=1e-8 * size)
    np.testing.assert_allclose(harmonic.d_omega * OMEGA, by_omega / (2 * h), rtol=1e-6, atol=1e-8 * size)


@pytest.mark.parametrize("law", [law for law in LAWS if law.linear], ids=label)
def test_a_law_called_linear_has_one_gain_at_any_amplitude_and_adds_up_motions(law: JointLaw) -> None:
    gain = law.describing_function(AMPLITUDE, OMEGA, np.array(1e-6))
    np.testing.assert_allclose(gain, gain[0], rtol=1e-14)
    if law.in_time:
        rng, joint = np.random.default_rng(4), Joint((law,))
        one, other = (3e-6 * rng.standard_normal((2, 60)) * [[1.0], [OMEGA]] for _ in range(2))
        together = joint.force_along(*(one + other), time_step=1e-4)
        apart = joint.force_along(*one, time_step=1e-4) + joint.force_along(*other, time_step=1e-4)
        np.testing.assert_allclose(together, apart, rtol=0, atol=1e-13 * np.max(np.abs(apart)))


@pytest.mark.parametrize("law", repeats([law for law in IN_TIME if law.passive], quick), ids=label)
def test_no_closed_cycle_yields_energy(law: JointLaw) -> None:
    # A law without memory is asked at all points at once.
    t = np.linspace(0, 2 * np.pi, 8001 if law.states else 40001)
    z = 4e-6 * (np.cos(t) + 0.5 * np.cos(3 * t + 1) + 0.3 * np.sin(7 * t))
    omega = 2 * np.pi * 300.0
    v = -4e-6 * omega * (np.sin(t) + 1.5 * np.sin(3 * t + 1) - 2.1 * np.cos(7 * t))
    joint = Joint((law,))
    path = np.tile(z[:-1], 3), np.tile(v[:-1], 3)
    force = joint.force_along(*path, time_step=t[1] / omega)[1 - len(t) :]
    work = np.sum(force * v[:-1]) * t[1] / omega
    stored = np.max(np.abs(force)) * np.max(np.abs(z))
    # Trapezoidal work over a whole period of a piecewise smooth force: error of second order in the step.
    assert work >= -1e-6 * stored


@law_in_time
def test_a_step_is_pure(law: JointLaw) -> None:
    motion, state = Motion(np.array(1.3e-6), np.array(0.02), 1e-5), law.initial_state(np.array(0.0))
    kept = copy.deepcopy((motion, state, law))
    first, second = law.step(motion, state), law.step(motion, state)
    np.testing.assert_array_equal(first[0], second[0])
    np.testing.assert_array_equal(first[1], second[1])
    np.testing.assert_array_equal(state, kept[1])
    assert law == kept[2]


@law_in_time
def test_jacobian_is_the_difference_of_the_force(law: JointLaw) -> None:
    rng = np.random.default_rng(5)
    z, v = rng.uniform(-7e-6, 7e-6, 200), rng.uniform(-0.2, 0.2, 200)
    state = law.initial_state(np.zeros(200))
    dz, dv = 1e-13, 1e-8
    kinks = law.kinks() if not law.states else ((), ())  # type: ignore[attr-defined]
    clear = np.ones(200, dtype=bool)
    for kink in kinks[0]:
        clear &= np.abs(z - kink) > 1e-9
    for kink in kinks[1]:
        clear &= np.abs(v - kink) > 1e-7

    def force(dz: float, dv: float) -> np.ndarray:
        return law.step(Motion(z + dz, v + dv), state)[0]

    stiffness, damping = law.jacobian(Motion(z, v), state)
    scale = np.max(np.abs(force(0, 0)))
    # Rounding of a difference of forces over the step dominates: 1e-15 · scale / dz.
    np.testing.assert_allclose(
        stiffness[clear], ((force(dz, 0) - force(-dz, 0)) / (2 * dz))[clear], rtol=1e-5, atol=1e-15 * scale / dz
    )
    np.testing.assert_allclose(
        damping[clear], ((force(0, dv) - force(0, -dv)) / (2 * dv))[clear], rtol=1e-5, atol=1e-15 * scale / dv
    )


@every_law
def test_every_parameter_declares_unit_and_role(law: JointLaw) -> None:
    assert parameters_of(law)
    assert all(p.unit and p.name for p in parameters_of(law))


@law_in_time
def test_arrays_of_motions_give_what_single_motions_give(law: JointLaw) -> None:
    z, v = np.meshgrid(np.linspace(-5e-6, 5e-6, 5), np.linspace(-0.1, 0.1, 3))
    together = law.step(Motion(z, v), law.initial_state(np.zeros_like(z)))[0]
    alone = [law.step(Motion(a, b), law.initial_state(np.zeros(())))[0] for a, b in zip(z.flat, v.flat, strict=True)]
    np.testing.assert_allclose(together.ravel(), np.array(alone), rtol=1e-14)


def test_a_law_of_the_frequency_domain_says_so() -> None:
    for law in LAWS:
        if not law.in_time:
            with pytest.raises(InputError, match="exists in the frequency domain only"):
                law.step(Motion(np.zeros(1), np.zeros(1)), law.initial_state(np.zeros(1)))


@pytest.mark.parametrize("law", [law for law in IN_TIME if not any(p.table for p in parameters_of(law))], ids=label)
def test_a_grid_of_parameters_is_stepped_at_once(law: JointLaw) -> None:
    factors = np.array([0.5, 1.0, 2.0])
    bounded = ("side", "contact_angle", "exponent", "shape")
    free = [p for p in parameters_of(law) if p.name not in bounded]

    def scaled(factor: np.ndarray) -> JointLaw:
        values = {p.name: getattr(law, p.name) for p in free}
        lists = {p.name: tuple(x * factor for x in values[p.name]) for p in free if p.listed}
        return dataclasses.replace(
            law, **{name: x * factor for name, x in values.items() if name not in lists}, **lists
        )

    path = 3e-6 * np.sin(np.linspace(0, 9, 50)), 0.05 * np.cos(np.linspace(0, 9, 50))
    grid, singles = scaled(factors), [scaled(f) for f in factors]
    together, alone = grid.initial_state(np.zeros(3)), [law.initial_state(np.zeros(()))] * 3
    stiffest = 0.0
    for z, v in zip(*path, strict=True):
        motion = Motion(np.full(3, z), np.full(3, v), 1e-5)
        stiffness = grid.jacobian(motion, together)[0]
        stiffest = max(stiffest, float(np.max(np.abs(stiffness))))
        force, together = grid.step(motion, together)
        for i, single in enumerate(singles):
            one = Motion(np.array(z), np.array(v), 1e-5)
            # Exponentials of arrays and of single numbers differ in the last bit.
            tangent = float(single.jacobian(one, alone[i])[0])
            assert stiffness[i] == pytest.approx(tangent, rel=1e-12, abs=1e-12 * stiffest)
            expected, alone[i] = single.step(one, alone[i])
            assert force[i] == pytest.approx(float(expected), rel=1e-14, abs=1e-11)
