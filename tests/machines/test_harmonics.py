"""Several harmonics and the error of one: published figures, random joints in time, stability, what cannot be done."""

from __future__ import annotations

import numpy as np
import pytest
from harmonics_in_time import Case, periodic, random_case
from test_amplitude_map import hertz, two_mass
from test_machine_coupling import lumped

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import FrequencyMismatch, InputError, Outcome
from jointlib.io.toml import Section
from jointlib.joint import Joint
from jointlib.laws.contact_loss import ContactLoss
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import Connection, Machine, constant_amplitude, operating_point, response
from machines.components.component import Component
from machines.coupling.second_order import machine_equations
from machines.harmonic_balance.assembly import Assembly
from machines.harmonic_balance.balance import Balance
from machines.harmonic_balance.harmonics import is_odd, joint_forces, jumps
from machines.operating.branches import Branch, Stability
from machines.stability import perturbations
from machines.stability.hill import floquet_exponents, growth
from machines.verbs.frf import command

# Largest first harmonic in µm, its frequency in Hz, modes 1 and 2, harmonics 1, 3, 5, from an independent solver.
TABLE = [
    (two_mass, 50.0, (3.429871, 1251.029), (2.211333, 5060.852)),
    (two_mass, 75.0, (5.365830, 1250.281), (3.335454, 5030.549)),
    (hertz, 50.0, (3.440788, 1250.973), (2.211375, 5060.750)),
    (hertz, 80.0, (5.991271, 1249.419), (3.567586, 5015.608)),
]


@pytest.mark.thorough
@pytest.mark.parametrize(("machine", "force", "first", "second"), TABLE)
def test_peaks_of_two_masses_with_three_harmonics(machine, force, first, second) -> None:  # type: ignore[no-untyped-def]
    for band, (amplitude, frequency) in (((1200.0, 1300.0), first), ((4800.0, 5300.0), second)):
        (peak,) = response(machine(), force, band, points=20, harmonics=(1, 3, 5)).peaks
        assert peak.harmonics == 3
        assert peak.outcome is Outcome.CONVERGED
        assert peak.amplitude * 1e6 == pytest.approx(amplitude, abs=6e-7)
        assert peak.frequency == pytest.approx(frequency, abs=1e-3)


def test_estimate_at_the_published_points() -> None:
    """Error of the describing function at 50 N: |Δz|/|z| = 0.19 % at the first peak, small on its flank."""
    branch = response(two_mass(), 50.0, [1240.0, 1251.0, 5060.0]).branches[0][0]
    true = [2.418e-5, 1.9225e-3, 1.636e-4]
    assert branch.error == pytest.approx(true, rel=0.1)


def at_frequency(case: Case) -> tuple[Branch, int] | None:
    """The stable solution with the smallest amplitude at the frequency of a case."""
    f = case.frequency
    found = response(case.machine, case.force, np.array([0.999, 1.0, 1.001]) * f, outputs=["a.x", "b.x"])
    for b in found.branches[0]:
        if b.stability is Stability.FOLD_STABLE and f in b.frequency:
            return b, int(np.flatnonzero(b.frequency == f)[0])
    return None


def ratios(seed: int, count: int) -> list[float]:
    """Estimated over true error of random cases in which the estimate lies between 1e-4 and 5e-2."""
    rng, found = np.random.default_rng(seed), []
    while len(found) < count:
        case = random_case(rng)
        state = at_frequency(case)
        if state is None or not 1e-4 <= state[0].error[state[1]] <= 5e-2:
            continue
        branch, i = state
        x, w = branch.output[i], 2 * np.pi * case.frequency
        in_time, mismatch, _ = periodic(case, x.real, (1j * w * x).real)
        assert mismatch < 1e-8
        found.append(float(branch.error[i] / (abs(in_time - branch.joint[i, 0]) / abs(branch.joint[i, 0]))))
    return found


@pytest.mark.slow
def test_estimated_error_is_that_against_time_integration() -> None:
    assert all(0.5 < r < 2 for r in ratios(11, 3))


@pytest.mark.slow
def test_estimated_error_is_that_against_time_integration_in_many_cases() -> None:
    assert all(0.5 < r < 2 for r in ratios(7, 40))


@pytest.mark.thorough
def test_five_harmonics_find_the_motion_in_time() -> None:
    case = Case(0.942, 2.2, 2e8, 200.0, two_mass().joints()[0], 75.0, 1250.3)
    found = response(case.machine, case.force, [1245.0, 1250.3, 1255.0], harmonics=(1, 3, 5), outputs=["a.x", "b.x"])
    (branch,) = found.branches[0]
    i = int(np.flatnonzero(branch.frequency == 1250.3)[0])
    x, w = branch.output[i], 2 * np.pi * 1250.3
    in_time, mismatch, _ = periodic(case, x.real, (1j * w * x).real)
    assert mismatch < 1e-8
    assert abs(in_time - branch.joint[i, 0]) < 1e-5 * abs(in_time)


def test_harmonics_are_added_where_the_first_alone_is_not_enough() -> None:
    found = response(two_mass(), [10.0, 75.0], [1200.0, 1300.0], points=20, harmonics="auto")
    assert [p.harmonics for p in found.peaks] == [1, 3]
    assert found.peaks[1].amplitude * 1e6 == pytest.approx(5.365830, abs=6e-7)
    assert {o for b in found.branches[1] for o in b.outcomes} == {Outcome.CONVERGED}
    said = response(two_mass(), 75.0, [1200.0, 1300.0], points=20).warnings
    assert len(said) == 1
    assert "off by an estimated" in said[0]


def test_phasors_of_a_sampled_cycle_agree_with_the_describing_function() -> None:
    """A joint with elastic slip: the cycle is sampled here, the closed form is Masing's loop."""
    joint = Joint((Linear(1e8), Viscous(300.0), Jenkins(3e7, 40.0)))
    z = np.array([[[2e-6 * np.exp(0.7j)], [0.0]]])
    omega = np.array([2 * np.pi * 500.0])
    one, two = (joint_forces([joint], part, omega, h) for part, h in ((z[:, :1], (1,)), (z, (1, 3))))
    assert two.force[0, 0, 0] == pytest.approx(one.force[0, 0, 0], rel=1e-5)
    assert two.by_z[0, 0, 0, 0] == pytest.approx(one.by_z[0, 0, 0, 0], rel=1e-3)
    assert two.by_conjugate[0, 0, 0, 0] == pytest.approx(one.by_conjugate[0, 0, 0, 0], abs=1e-3 * 1.3e8)


def test_a_slider_that_just_reaches_its_slip_force_has_a_steady_cycle() -> None:
    """It slips by what rounding makes of a displacement: forces and slopes are told, those of one that sticks."""
    k, slip, rng = 781205220.4998648, 491.6805688649857, np.random.default_rng(1)
    mean = rng.uniform(-2e-9, 2e-9, 2000)
    over = rng.choice([0.0, 1e-16, 3e-16, 1e-15, 1e-14, 1e-12], 2000)
    A = (slip / k - np.abs(mean)) * (1 + over) * np.exp(1j * rng.uniform(0, 2 * np.pi, 2000))
    z = np.stack([A, np.zeros(2000), mean], axis=1)[:, :, None]
    found = joint_forces([Joint((Jenkins(k, slip),))], z, np.full(2000, 1.5e4), (1, 2, 0), 256)
    assert np.all(np.isfinite(found.by_z))
    assert np.all(np.isfinite(found.by_conjugate))
    assert np.max(np.abs(found.force - k * z)) < 1e-9 * slip


@pytest.mark.parametrize("case", ["smooth", "remembering"])
def test_jacobian_is_the_derivative_of_the_residual(case: str) -> None:
    machine = two_mass()
    if case == "remembering":
        machine = machine.with_joint("guide", Joint((Linear(6e8), Viscous(463.0), Jenkins(5e7, 50.0))))
    assembly = Assembly(machine, ("slide.x",), ("slide.x",))
    balance = Balance.of(assembly, np.array([2 * np.pi * 1240.0]), np.array([50.0]), (1, 3))
    z = np.array([[[2e-6 + 1e-6j], [2e-7 - 1e-7j]]])
    forces = balance.forces(z)
    J, r = balance.jacobian(forces)[0], balance.residual(z, forces.force)
    for k, change in enumerate((1.0, 1.0, 1j, 1j)):
        moved = z.copy()
        moved[0, k % 2, 0] += 1e-11 * change
        difference = (balance.residual(moved, balance.forces(moved).force) - r).ravel() / 1e-11
        column = np.concatenate([difference.real, difference.imag])
        assert np.max(np.abs(column - J[:, k])) < 2e-3 * np.max(np.abs(J))


def test_multipliers_of_the_three_solutions_past_the_fold() -> None:
    """Largest multipliers at 125 N and 4937.25 Hz: 0.9938, 1.0335, 0.9938; in time 1.0332 for the middle one."""
    machine = two_mass()
    found = response(machine, 125.0, [4937.0, 4937.25, 4937.5], stability="hill")
    equations = machine_equations(machine)
    largest = {}
    for b in found.branches[0]:
        z, w = b.joint[b.frequency == 4937.25][:, None], 2 * np.pi * np.array([4937.25])
        rate = growth(equations, machine.joints(), z, w, (1,))
        largest[b.labels[0]] = [*largest.get(b.labels[0], []), float(np.exp(2 * np.pi * rate[0] / w[0]))]
    assert sorted(largest[Stability.STABLE]) == pytest.approx([0.9938, 0.9938], abs=6e-5)
    assert largest[Stability.UNSTABLE] == pytest.approx([1.0335], abs=6e-5)


@pytest.mark.thorough
def test_multipliers_agree_with_the_motion_in_time() -> None:
    case = Case(0.942, 2.2, 2e8, 200.0, two_mass().joints()[0], 75.0, 1240.0)
    found = response(case.machine, 75.0, [1235.0, 1240.0, 1245.0], harmonics=(1, 3, 5), outputs=["a.x", "b.x"])
    (branch,) = found.branches[0]
    i = int(np.flatnonzero(branch.frequency == 1240.0)[0])
    x, w = branch.output[i], 2 * np.pi * 1240.0
    multipliers = periodic(case, x.real, (1j * w * x).real)[2]
    equations = machine_equations(case.machine)
    z = np.concatenate([branch.joint[i : i + 1, None], branch.overtones[i : i + 1]], axis=1)
    exponents = floquet_exponents(equations, case.machine.joints(), z, np.array([w]), (1, 3, 5))
    found_largest = np.exp(2 * np.pi * np.max(exponents.real) / w)
    assert found_largest == pytest.approx(np.max(np.abs(multipliers)), rel=1e-6)


def test_linear_machine_has_its_own_poles_as_exponents() -> None:
    """Without a nonlinear force λ = pole ∓ jω."""
    machine = Machine(
        (lumped("m", [[2.0]]),),
        (Connection("j", ("m.x", "ground"), Joint((Linear(8e7), Viscous(400.0)))),),
        drive="m.x",
    )
    equations = machine_equations(machine)
    found = floquet_exponents(equations, machine.joints(), np.full((1, 1, 1), 1e-6 + 0j), np.array([3000.0]), (1,))[0]
    poles = np.roots([2.0, 400.0, 8e7])
    expected = np.concatenate([poles + 3000j, poles - 3000j])
    assert np.sort(found.imag) == pytest.approx(np.sort(expected.imag), rel=1e-9)
    assert found.real == pytest.approx(np.full(4, -100.0), rel=1e-6)


def test_ideal_friction_keeps_one_harmonic_and_says_so() -> None:
    joint = Joint((Linear(654e6), Viscous(500.0), Coulomb(2.0)))
    assert jumps(joint)
    machine = Machine((lumped("m", [[60.0]]),), (Connection("j", ("m.x", "ground"), joint),), drive="m.x")
    found = response(machine, 10.0, [480.0, 560.0], points=20, harmonics=(1, 3, 5))
    assert found.outcomes == (Outcome.HARMONICS_SIGNIFICANT,)
    assert [p.harmonics for p in found.peaks] == [1]
    assert any("jumps" in w for w in found.warnings)


class Measured(Component):
    """A part that is only known by its receptance, up to 6 kHz."""

    kind = "measured"

    def __init__(self, part: Component) -> None:
        self.part, self.name, self.dofs = part, part.name, part.dofs

    @classmethod
    def from_section(cls, section: Section) -> Measured:
        raise NotImplementedError

    def receptance(self, omega: Array, ports: Array | None = None) -> ComplexArray:
        if np.max(omega) > 2 * np.pi * 6000:
            raise FrequencyMismatch("base: no receptance above 6000 Hz")
        return self.part.receptance(omega, ports)

    def second_order(self) -> None:
        return None


def test_receptances_that_end_below_the_harmonics_are_named() -> None:
    """Known up to 6 kHz, the fifth harmonic is reached up to 1200 Hz; above, the error of one is not known."""
    base = two_mass()
    machine = Machine((base.components[0], Measured(base.components[1])), base.connections, drive="slide.x")
    found = response(machine, 75.0, np.linspace(1100.0, 1300.0, 21), harmonics="auto", stability="hill")
    assert found.outcomes == (Outcome.FRF_TOO_SHORT,)
    (branch,) = found.branches[0]
    assert np.array_equal(np.isnan(branch.error), branch.frequency > 1200.0)
    assert branch.harmonics == (1,)
    assert any("has no equations of motion" in w for w in found.warnings)


def test_a_joint_that_pulls_one_way_is_not_odd() -> None:
    assert is_odd(hertz().joints()[0])
    assert not is_odd(Joint((Linear(1e8), ContactLoss(5e7, 1e-6, 1.0))))


def test_constant_amplitude_needs_the_force_that_makes_it() -> None:
    """The force found for 4 µm at the joint, put back as a constant force, gives 4 µm; folds are no obstacle."""
    machine, lines = two_mass(), np.linspace(4900.0, 5100.0, 9)
    held = constant_amplitude(machine, lines, 4e-6, "guide")
    assert np.abs(held.joint[:, 0]) == pytest.approx(np.full(9, 4e-6), rel=1e-12)
    for i in (0, 4, 8):
        around = np.array([lines[i] - 0.01, lines[i], lines[i] + 0.01])
        branches = response(machine, float(held.force[i]), around).branches[0]
        sizes = [abs(b.joint[b.frequency == lines[i], 0][0]) for b in branches if lines[i] in b.frequency]
        assert np.min(np.abs(np.array(sizes) / 4e-6 - 1)) < 1e-9


def test_constant_amplitude_of_the_tool_is_its_operating_point() -> None:
    machine, lines = two_mass(), np.linspace(4900.0, 5100.0, 9)
    held = constant_amplitude(machine, lines, 2e-6, "slide.x")
    point = operating_point(machine, lines, 2e-6)
    assert held.force == pytest.approx(point.force, rel=1e-9)
    assert np.abs(held.frf.receptance[:, 0, 0]) * held.force == pytest.approx(np.full(9, 2e-6), rel=1e-9)
    lost = constant_amplitude(machine, lines, 12e-6, "guide")
    assert set(lost.outcomes) == {Outcome.PAST_FORCE_PEAK}
    with pytest.raises(InputError, match="expected more than 0"):
        constant_amplitude(machine, lines, 0.0, "guide")


@pytest.mark.parametrize("wanted", [0, 2, "all", (3, 5), (1, 5, 3), (1, 2.5)])
def test_harmonics_that_make_no_sense_are_refused(wanted) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(InputError, match="ascending multiples"):
        response(two_mass(), 10.0, harmonics=wanted)


def test_what_is_left_out_to_save_time_is_told_with_how_to_ask_for_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """By an option that the verb has and by an argument that the function takes."""
    monkeypatch.setattr(perturbations, "_price", lambda *_: np.inf)
    found = response(two_mass(), 100.0, [1240.0, 1250.0, 1260.0], stability="auto")
    told = " ".join(found.warnings)
    assert "--harmonics auto" in told
    assert {"--harmonics"} <= {name for option in command.params for name in option.opts}
    assert 'in Python stability="hill" does so' in told
    response(two_mass(), 1.0, [1240.0, 1250.0, 1260.0], harmonics="auto", stability="hill")
