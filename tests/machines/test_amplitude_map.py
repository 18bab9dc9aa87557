"""All branches of a machine with one nonlinear joint: published figures, a second method, time integration."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from test_machine_coupling import lumped

import machines
from jointlib.errors import InputError, Outcome
from jointlib.io.joint_file import read_joint
from jointlib.joint import Joint
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.gap import Gap
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import AmplitudeMap, Connection, Machine, Newton, read_machine, response
from machines.operating.branches import End, Stability

LIBRARY = Path(machines.__file__).parent / "library"


def two_mass() -> Machine:
    return read_machine(LIBRARY / "two_mass.toml")


def hertz() -> Machine:
    guide = read_joint(LIBRARY / "paper_sdof_hertz.joint.toml").with_parameters({"viscous.damping": 463.062})
    return two_mass().with_joint("guide", guide)


# Largest first-harmonic amplitude in µm and its frequency in Hz, modes 1 and 2, from an independent solution.
TABLE = [
    (two_mass, 10.0, (0.668529, 1251.468), (0.440437, 5083.576)),
    (two_mass, 25.0, (1.680152, 1251.379), (1.102082, 5078.644)),
    (two_mass, 50.0, (3.428324, 1251.038), (2.211340, 5060.842)),
    (two_mass, 75.0, (5.346072, 1250.358), (3.335509, 5030.499)),
    (hertz, 50.0, (3.437956, 1250.989), (2.211382, 5060.739)),
    (hertz, 80.0, (5.977794, 1249.500), (3.567717, 5015.485)),
]


@pytest.mark.parametrize(("machine", "force", "first", "second"), TABLE)
def test_peaks_of_two_masses(machine, force, first, second) -> None:  # type: ignore[no-untyped-def]
    found = response(machine(), force)
    assert [p.outcome for p in found.peaks] == [Outcome.CONVERGED] * 2
    for peak, (amplitude, frequency) in zip(found.peaks, (first, second), strict=True):
        assert peak.amplitude * 1e6 == pytest.approx(amplitude, abs=6e-7)
        assert peak.frequency == pytest.approx(frequency, abs=6e-4)


def test_peak_is_refined_beyond_the_grid() -> None:
    peak = response(two_mass(), 50.0).peaks[0]
    grid = response(two_mass(), 50.0, np.linspace(1000, 7000, 600)).branches[0][0]
    coarse = np.max(np.abs(grid.joint[:, 0]))
    assert 0.005 < 1 - coarse / peak.amplitude < 0.02


def test_three_solutions_where_the_second_mode_has_folded() -> None:
    found = response(two_mass(), 125.0, [4937.0, 4937.25, 4937.5])
    at: dict[Stability, list[float]] = {b.stability: [] for b in found.branches[0]}
    for b in found.branches[0]:
        at[b.stability] += [abs(z) * 1e6 for z in b.joint[b.frequency == 4937.25, 0]]
    assert sorted(at[Stability.FOLD_STABLE]) == pytest.approx([2.4763, 5.6177], abs=6e-5)
    assert at[Stability.UNSTABLE] == pytest.approx([4.7618], abs=6e-5)


def test_fold_frequencies_of_the_second_mode() -> None:
    middle = [
        b for b in response(two_mass(), 125.0).branches[0] if b.stability is Stability.UNSTABLE and b.frequency[0] > 2e3
    ]
    assert len(middle) == 1
    assert middle[0].ends == (End.FOLD, End.FOLD)
    assert middle[0].frequency[[0, -1]] == pytest.approx([4921.84, 4952.59], abs=6e-3)


def test_branch_past_the_force_peak_ends_and_says_so() -> None:
    found = response(two_mass(), 125.0)
    assert found.outcomes == (Outcome.PAST_FORCE_PEAK,)
    peak = found.peaks[0]
    assert peak.outcome is Outcome.PAST_FORCE_PEAK
    # The static force of K1 z + K3 z³ turns over at sqrt(K1 / 3 |K3|); the machine would reach it at 1245.1 Hz.
    assert peak.amplitude == pytest.approx(np.sqrt(654.164e6 / (3 * 1.7083e18)), rel=1e-9)
    assert peak.frequency == pytest.approx(1245.1, abs=0.05)
    assert np.isnan(found.frfs[0].receptance).any()
    ends = [b for b in found.branches[0] if End.LIMIT in b.ends]
    assert ends
    assert {b.outcome for b in ends} == {Outcome.PAST_FORCE_PEAK}


def test_leaving_the_identified_range_is_named() -> None:
    guide = replace(read_joint(LIBRARY / "two_mass.joint.toml"), validity={"amplitude": (0.0, 2e-6)})
    found = response(two_mass().with_joint("guide", guide), 50.0)
    assert [p.outcome for p in found.peaks] == [Outcome.OUT_OF_RANGE] * 2
    assert found.peaks[0].amplitude == 2e-6


def test_frequencies_outside_the_identified_range_are_said() -> None:
    guide = replace(read_joint(LIBRARY / "two_mass.joint.toml"), validity={"frequency": (1000.0, 3000.0)})
    found = response(two_mass().with_joint("guide", guide), 10.0)
    assert found.outcomes == (Outcome.CONVERGED,)
    (said,) = found.warnings
    assert said.startswith("guide: used from 1000 to 7000 Hz, identified from 1000 to 3000 Hz")
    assert response(two_mass(), 10.0).warnings == ()


@pytest.mark.thorough
def test_damping_that_turns_negative_ends_the_branch() -> None:
    guide = replace(read_joint(LIBRARY / "paper_sdof.joint.toml"), validity={})
    found = response(read_machine(LIBRARY / "paper_sdof.toml").with_joint("guide", guide), 20.0, [300.0, 600.0])
    assert found.outcomes == (Outcome.NEGATIVE_DAMPING,)
    reached = max(np.max(np.abs(b.joint)) for b in found.branches[0])
    assert reached <= np.sqrt(4 * 463.062 / 19.8415e12)


@pytest.mark.parametrize("machine", [two_mass, hertz])
def test_map_and_newton_agree(machine) -> None:  # type: ignore[no-untyped-def]
    lines = np.linspace(1000, 7000, 200)
    mapped = response(machine(), [10.0, 75.0], lines)
    newton = response(machine(), [10.0, 75.0], lines, method=Newton())
    for a, b in zip(mapped.frfs, newton.frfs, strict=True):
        assert np.max(np.abs(a.receptance - b.receptance)) < 1e-10 * np.max(np.abs(a.receptance))
    for p, q in zip(mapped.peaks, newton.peaks, strict=True):
        assert p.amplitude == pytest.approx(q.amplitude, rel=1e-8)


def test_solution_balances_forces() -> None:
    """Newton's law at the first mass: −ω² m x1 = F − G z, and at the base with its spring and damper."""
    machine = two_mass()
    found = response(machine, 75.0, outputs=["slide.x", "base.x"])
    for branch in found.branches[0]:
        w = 2 * np.pi * branch.frequency
        z = branch.joint[:, 0]
        x1, x2 = branch.output.T
        pull = machine.joints()[0].first_harmonic(np.abs(z), w).gain * z
        assert np.max(np.abs(x1 - x2 - z)) < 1e-12 * np.max(np.abs(x1))
        assert np.max(np.abs(-(w**2) * 0.942 * x1 - (75.0 - pull))) < 1e-9 * np.max(np.abs(pull))
        base = (2e8 + 200j * w - 2.2 * w**2) * x2
        assert np.max(np.abs(base - pull)) < 1e-9 * np.max(np.abs(pull))


def test_first_harmonic_agrees_with_the_periodic_motion_in_time() -> None:
    K1, K3, c, w = 654.164e6, -1.7083e18, 463.062, 2 * np.pi * 1240.0
    scale = 1e-6

    def motion(t, y):  # type: ignore[no-untyped-def]
        x1, x2, v1, v2 = y[:4]
        z, v = (x1 - x2) * scale, (v1 - v2) * scale
        f = (K1 * z + K3 * z**3 + c * v) / scale
        a = [(50.0 / scale * np.cos(w * t) - f) / 0.942, (f - 2e8 * x2 - 200 * v2) / 2.2]
        tangent = K1 + 3 * K3 * z**2
        J = np.zeros((4, 4))
        J[:2, 2:] = np.eye(2)
        J[2] = np.array([-tangent, tangent, -c, c]) / 0.942
        J[3] = np.array([tangent, -tangent - 2e8, c, -c - 200]) / 2.2
        return np.concatenate([[v1, v2], a, (J @ y[4:].reshape(4, 4)).ravel()])

    branch = response(two_mass(), 50.0, [1239.0, 1240.0, 1241.0], outputs=["slide.x", "base.x"]).branches[0][0]
    x = branch.output[1] / scale
    state, T = np.concatenate([x.real, (1j * w * x).real]), 2 * np.pi / w
    for _ in range(4):
        run = solve_ivp(
            motion,
            (0, T),
            np.concatenate([state, np.eye(4).ravel()]),
            "DOP853",
            rtol=1e-10,
            atol=1e-9,
            dense_output=True,
        )
        end, flow = run.y[:4, -1], run.y[4:, -1].reshape(4, 4)
        state = state - np.linalg.solve(flow - np.eye(4), end - state)
    assert run.sol is not None
    t = np.arange(128) * T / 128
    z = run.sol(t)[0] - run.sol(t)[1]
    in_time = abs(np.mean(z * np.exp(-1j * w * t))) * 2
    assert in_time == pytest.approx(1.364298, abs=1e-6)
    assert abs(branch.joint[1, 0]) * 1e6 == pytest.approx(1.364266, abs=1e-6)
    assert abs(branch.joint[1, 0]) * 1e6 == pytest.approx(in_time, rel=5e-5)


def sdof(joint: Joint, drive_frequency: tuple[float, float]) -> Machine:
    return Machine(
        (lumped("m", [[60.0]]),),
        (Connection("j", ("m.x", "ground"), joint),),
        drive="m.x",
        frequency=drive_frequency,
    )


@pytest.mark.parametrize(
    ("name", "frequencies"),
    [("paper_sdof", (525.003, 520.866, 512.491)), ("paper_sdof_hertz", (525.022, 520.607, 506.895))],
)
def test_paper_machine_resonates_where_its_gain_says(name: str, frequencies: tuple[float, ...]) -> None:
    machine = read_machine(LIBRARY / f"{name}.toml")
    joint = machine.joints()[0]
    for A, expected in zip((1e-6, 3e-6, 5e-6), frequencies, strict=True):
        gain = joint.first_harmonic(A, 2 * np.pi * expected).gain
        assert np.sqrt(gain.real / 60) / (2 * np.pi) == pytest.approx(expected, abs=6e-4)
        # At resonance the force carries the damping alone. 0.999: the top must stay inside the range of the joint.
        force = 0.999 * A * float(gain.imag)
        peak = response(machine, force).peaks_of("guide", force)[0]
        w = 2 * np.pi * peak.frequency
        own = joint.first_harmonic(peak.amplitude, w).gain
        assert peak.outcome is Outcome.CONVERGED
        assert peak.amplitude == pytest.approx(A, rel=5e-3)
        assert peak.frequency == pytest.approx(np.sqrt(own.real / 60) / (2 * np.pi), rel=3e-6)


def test_open_gap_lets_a_body_float() -> None:
    """Within its clearance the joint carries nothing: x = −F/(m ω²) exactly, whatever the spring."""
    joint = Joint((Linear(1e8), Gap(1e8, 5e-6)))
    found = response(sdof(joint, (200.0, 400.0)), 100.0)
    branch = next(b for b in found.branches[0] if b.stability is Stability.FOLD_STABLE)
    free = 100.0 / (60.0 * (2 * np.pi * branch.frequency) ** 2)
    inside = free < 4.9e-6
    assert np.any(inside)
    assert np.abs(branch.joint[inside, 0]) == pytest.approx(free[inside], rel=1e-12)


def test_dry_friction_takes_its_share_of_the_force_at_resonance() -> None:
    """At resonance of a mass on spring and slider F = A (c ω + 4 F_s/(π A)): the amplitude is known."""
    k, c, slip = 654e6, 500.0, 2.0
    machine = sdof(Joint((Linear(k), Viscous(c), Coulomb(slip))), (480.0, 560.0))
    force = 10.0
    w = np.sqrt(k / 60)
    expected = (force - 4 * slip / np.pi) / (c * w)
    assert response(machine, force).peaks[0].amplitude == pytest.approx(expected, rel=1e-5)


def test_force_below_slip_moves_next_to_nothing() -> None:
    machine = sdof(Joint((Linear(654e6), Coulomb(20.0))), (480.0, 560.0))
    found = response(machine, 10.0)
    assert all(np.max(np.abs(b.joint), initial=0.0) < 1e-9 for b in found.branches[0])


def test_linear_joint_gives_the_resonance_of_a_mass_on_a_spring() -> None:
    k, c = 654e6, 500.0
    found = response(sdof(Joint((Linear(k), Viscous(c))), (480.0, 560.0)), 5.0)
    peak = found.peaks[0]
    damping = c / (2 * np.sqrt(60 * k))
    assert peak.frequency == pytest.approx(np.sqrt(k / 60 * (1 - 2 * damping**2)) / (2 * np.pi), rel=1e-9)
    assert peak.amplitude == pytest.approx(5.0 / k / (2 * damping * np.sqrt(1 - damping**2)), rel=1e-9)


def test_response_without_a_maximum_says_that_it_lies_at_the_edge() -> None:
    peak = response(two_mass(), 10.0, [1500.0, 2000.0]).peaks
    assert [p.outcome for p in peak] == [Outcome.PEAK_AT_EDGE]


def test_bad_requests_are_one_clear_sentence() -> None:
    machine = two_mass()
    for change, words in [
        ({"frequency": [7000.0, 1000.0]}, "runs from 7000 to 1000 Hz"),
        ({"frequency": [3.0, 2.0, 1.0]}, "ascending"),
        ({"force": -1.0}, "more than 0"),
        ({"drive": "slide.y"}, "did you mean 'slide.x'"),
        ({"outputs": ["bas.x"]}, "did you mean 'base.x'"),
        ({"harmonics": 3}, "first harmonic only"),
        ({"points": 1}, "at least 2"),
    ]:
        with pytest.raises(InputError, match=words):
            response(machine, **change)  # type: ignore[arg-type]
    chain = Machine(
        machine.components,
        (*machine.connections, Connection("foot", ("base.x", "ground"), machine.joints()[0])),
        drive="slide.x",
    )
    with pytest.raises(InputError, match="takes one nonlinear joint and there are 2"):
        response(chain, 1.0, [100.0, 200.0], method=AmplitudeMap())
