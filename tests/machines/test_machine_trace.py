"""Measured FRFs traced to a joint: the forward model by other routes, what is named, and what is not."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from repeats import repeats

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.joint import Covariance, Joint
from jointlib.laws.bouc_wen import BoucWen
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.cubic import Cubic
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.laws.linear import Linear
from jointlib.laws.quadratic_damping import QuadraticDamping
from jointlib.laws.stribeck import Stribeck
from jointlib.laws.viscous import Viscous
from jointlib.loop.answer.report import Verdict
from machines import Connection, Lumped, Machine, read_machine
from machines.harmonic_balance.assembly import Assembly
from machines.harmonic_balance.balance import Balance
from machines.loop.explanations.hypothesis import refit
from machines.loop.explanations.places import places_of
from machines.loop.explanations.quick import quick
from machines.loop.fit import Fitting
from machines.loop.forward import Forward
from machines.loop.implied import Implied
from machines.loop.records import LevelFRF
from machines.loop.trace import trace_frfs

LIBRARY = Path(__file__).parents[2] / "machines" / "library"
LINES = np.linspace(60.0, 420.0, 90)
FORCES = (2.0, 6.0, 18.0)


def chain(*joints: Joint, masses: Sequence[float] = (8.0, 30.0, 90.0)) -> Machine:
    """Masses in a row from the tool to the ground, a joint between each two; the last stands on a spring."""
    parts = [Lumped(f"m{i}", ("x",), np.array([[m]])) for i, m in enumerate(masses[:-1])]
    parts.append(
        Lumped(f"m{len(masses) - 1}", ("x",), np.array([[masses[-1]]]), np.array([[4e3]]), np.array([[1.2e8]]))
    )
    rows = tuple(Connection(f"j{i}", (f"m{i}.x", f"m{i + 1}.x"), joint) for i, joint in enumerate(joints))
    return Machine(tuple(parts), rows, tool={"x": "m0.x"})


UPPER = Joint((Linear(3e7), Viscous(700.0)))
LOWER = Joint((Linear(6e7), Viscous(2500.0), Cubic(1e17)))
MACHINE = chain(UPPER, LOWER)


def blank(response: str, lines: Array = LINES, forces: Sequence[float] = FORCES) -> list[LevelFRF]:
    ones = np.ones(len(lines))
    return [
        LevelFRF(f"{response} {F:g} N", "m0.x", response, F, lines, ones.astype(complex), ones, "file", False, "0")
        for F in forces
    ]


def measured(
    machine: Machine, seed: int = 0, response: str = "m0.x", drive: str = "m0.x", decibel: float = 40.0
) -> list[LevelFRF]:
    """FRFs by harmonic balance in harmonics 1, 3, 5 from sampled forces, and noise on top."""
    rng, out = np.random.default_rng(seed), []
    assembly = Assembly(machine, (response,), (drive,))
    omega = 2 * np.pi * LINES
    for frf in blank(response):
        F = np.full(len(LINES), frf.force)
        view = assembly.at(omega)
        H = view.Hof[:, -1, 0]
        if assembly.nonlinear:
            z: ComplexArray = np.zeros((len(omega), 3, len(assembly.nonlinear)), dtype=complex)
            balance = Balance.of(assembly, omega, F, (1, 3, 5))
            z[:, 0] = balance.driven * F[:, None] * 0.02
            for share in np.linspace(0.02, 1.0, 12):
                balance = Balance.of(assembly, omega, share * F, (1, 3, 5))
                z, done = balance.settle(z)
            assert np.all(done)
            g = balance.forces(z).force[:, 0]
            H = H - (view.Hoz[:, -1] * g).sum(axis=1) / F
        sigma = np.sqrt(np.mean(np.abs(H) ** 2)) * 10 ** (-decibel / 20)
        noise = (rng.standard_normal(len(H)) + 1j * rng.standard_normal(len(H))) / np.sqrt(2)
        out.append(replace(frf, drive=drive, receptance=H + sigma * noise, deviation=np.full(len(H), sigma)))
    return out


def forward_of(machine: Machine, frfs: Sequence[LevelFRF] | None = None) -> Forward:
    return Forward.of(machine, frfs or blank("m0.x"))


NONLINEAR = chain(
    Joint((Linear(3e7), Viscous(700.0), Coulomb(2.0, 1e-4))), Joint((HertzGuide(300.0, 4.5e-8), Viscous(2500.0)))
)


@pytest.mark.parametrize("place", [0, 1])
@pytest.mark.parametrize("machine", [MACHINE, NONLINEAR], ids=["one nonlinear", "friction and guide"])
def test_slopes_of_the_receptance_are_those_of_solving_again(machine: Machine, place: int) -> None:
    forward = forward_of(machine)
    fitting = Fitting(forward, np.ones(len(forward.points)), np.zeros(len(forward.points), dtype=complex))
    hypothesis = refit(machine, places_of(machine)[place])
    u = np.zeros(len(hypothesis.coordinates))
    here = fitting.finished(hypothesis, u, fitting.answer(hypothesis, u))
    assert np.all(here.answer.fine)
    h = 1e-3
    for i, e in enumerate(np.eye(len(u))):
        up, down = (fitting.answer(hypothesis, s * h * e, here.answer.z).receptance for s in (1.0, -1.0))
        by_difference = (up - down) / (2 * h)
        size = np.max(np.abs(by_difference))
        # The residual falls as the model rises; the difference of the second order leaves h² of the third derivative.
        np.testing.assert_allclose(-here.slopes[:, i], by_difference, atol=2e-3 * size)


@pytest.mark.thorough
def test_the_forward_model_is_the_response_of_the_machine() -> None:
    from machines import Newton, response

    forward = forward_of(NONLINEAR)
    found = forward.answer([quick(j) for j in NONLINEAR.joints()], (0, 1)).receptance.reshape(len(FORCES), -1)
    answer = response(NONLINEAR, FORCES, LINES, "m0.x", Newton(), outputs=["m0.x"])
    for own, frf in zip(found, answer.frfs, strict=True):
        np.testing.assert_allclose(own, frf.receptance[:, 0, 0], rtol=1e-5)


@pytest.mark.parametrize(
    "law", [Coulomb(3.0, 2e-4), Stribeck(3.0, 5.0, 1e-3, 2e-4), BoucWen(2e7, 9.0, 2.0, 0.3)], ids=lambda law: law.kind
)
def test_tables_hold_the_describing_functions_of_slow_laws(law: Coulomb | Stribeck | BoucWen) -> None:
    A, w = np.geomspace(1e-9, 1e-4, 41), np.geomspace(100.0, 4000.0, 41)
    exact = law.first_harmonic(A, w)
    read = quick(Joint((law,))).first_harmonic(A, w)
    size = np.abs(exact.gain)
    assert np.max(np.abs(read.gain - exact.gain) / size) < 1e-5
    assert np.max(np.abs(read.d_amplitude - exact.d_amplitude) * A / size) < 1e-4


@pytest.mark.parametrize("row", [0, 1])
def test_a_receptance_tells_the_motion_and_force_of_a_joint_when_all_else_is_right(row: int) -> None:
    forward = forward_of(MACHINE)
    answer = forward.answer(MACHINE.joints(), (0, 1))
    points = replace(forward.points, measured=answer.receptance)
    fitting = Fitting(
        replace(forward, points=points), np.full(len(points), 1e-12), np.zeros(len(points), dtype=complex)
    )
    implied = Implied.of(fitting, row, answer.z)
    np.testing.assert_allclose(implied.z, answer.z[:, row], rtol=1e-6)
    joint, omega = MACHINE.joints()[row], 2 * np.pi * points.frequency
    gain = joint.first_harmonic(np.abs(answer.z[:, row]), omega).gain
    np.testing.assert_allclose(implied.force, gain * answer.z[:, row], rtol=1e-6)


ALTERED: list[tuple[str, Joint, str, str, float]] = [
    ("j0", Joint((Linear(3.4e7), Viscous(700.0))), "refit", "linear.stiffness", 3.4e7),
    ("j1", Joint((Linear(6e7), Viscous(4000.0), Cubic(1e17))), "refit", "viscous.damping", 4000.0),
    ("j0", UPPER + Cubic(2e17), "cubic", "cubic.stiffness3", 2e17),
    ("j0", UPPER + QuadraticDamping(5e5), "quadratic-damping", "quadratic_damping.damping2", 5e5),
    ("j1", LOWER + Coulomb(1.5, 5e-5), "coulomb", "coulomb.slip_force", 1.5),
]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("place", "joint", "family", "parameter", "value"),
    repeats(ALTERED, lambda case: case is ALTERED[0]),
    ids=lambda v: str(v)[:12],
)
def test_an_altered_joint_is_named_and_measured(
    place: str, joint: Joint, family: str, parameter: str, value: float
) -> None:
    found = trace_frfs(measured(MACHINE.with_joint(place, joint)), MACHINE)
    assert found.verdict in (Verdict.IDENTIFIED, Verdict.AMBIGUOUS)
    assert (found.place, found.chosen.family if found.chosen else "") == (place, family)
    assert found.chosen is not None
    estimate = found.chosen.parameters[parameter]
    assert abs(estimate.value - value) < 3 * estimate.standard_error + 1e-3 * value
    # Noise is 1 %. On a level left out a cubic that only the highest level shows may be off.
    assert found.error_after["in_sample"] < 0.02 < 0.5 * found.error_before["in_sample"]
    mended = {c.name: c.joint for c in found.mended.flexible}[place]
    assert mended is not None
    assert mended.parameters[parameter] == estimate.value
    assert mended.covariance is not None
    assert mended.covariance.standard_error(parameter) == pytest.approx(estimate.standard_error)
    other = next(c.name for c in MACHINE.flexible if c.name != place)
    assert found.mended.with_joint(place, joint).flexible != ()
    assert {c.name: c.joint for c in found.mended.flexible}[other] is MACHINE.with_joint(place, joint).joints()[
        [c.name for c in MACHINE.flexible].index(other)
    ]


@pytest.mark.thorough
def test_pointing_says_which_kind_of_change_would_do() -> None:
    found = trace_frfs(measured(MACHINE.with_joint("j0", ALTERED[0][1])), MACHINE)
    assert found.pointing["j0"]["stiffness"] > 0.98
    assert found.pointing["j0"]["damping"] < 0.5
    assert found.pointing["j1"]["stiffness"] < 0.9


@pytest.mark.slow
def test_an_unaltered_machine_is_left_alone_over_many_seeds() -> None:
    for seed in range(6):
        found = trace_frfs(measured(MACHINE, seed), MACHINE)
        assert found.verdict is Verdict.NOTHING_MISSING, seed
        assert found.place is None
        assert found.mended is MACHINE
        assert found.error_before["chi2"] == pytest.approx(1.0, abs=0.25)
        assert found.error_after["relative"] == found.error_before["relative"]


SERIES = chain(Joint((Linear(3e7), Viscous(500.0))), Joint((Linear(5e7), Viscous(1500.0))), masses=(9.0, 0.02, 80.0))


@pytest.mark.slow
def test_two_joints_in_series_are_told_apart_by_the_measurement_that_is_suggested_and_not_before() -> None:
    true = SERIES.with_joint("j0", Joint((Linear(3.5e7), Viscous(500.0))))
    records = measured(true)
    found = trace_frfs(records, SERIES)
    assert found.verdict is Verdict.AMBIGUOUS
    assert {str(found.place), *(r.place for r in found.rivals)} == {"j0", "j1"}
    rival = found.rivals[0]
    assert rival.deviations > 10
    match = re.search(r"response of (\S+) to a force of \S+ N on (\S+):", rival.separating_experiment)
    assert match is not None
    assert found.next_experiment == rival.separating_experiment
    further = measured(true, 1, match.group(1), match.group(2))
    told = trace_frfs([*records, *further], SERIES)
    assert (told.verdict, told.place, told.rivals) == (Verdict.IDENTIFIED, "j0", ())


@pytest.mark.thorough
def test_a_sealed_record_decides_the_error_and_takes_no_part_in_the_fit() -> None:
    records = measured(MACHINE.with_joint("j0", ALTERED[0][1]))
    sealed = [*records[:2], replace(records[2], sealed=True)]
    found = trace_frfs(sealed, MACHINE)
    assert (found.place, found.error_before["where"], found.error_after["where"]) == ("j0", "sealed", "sealed")
    assert [r["name"] for r in found.error_after["per_record"]] == [records[2].name]
    assert found.error_after["relative"] < 0.012
    assert set(found.plots) == {
        f"{k}_{i}" for k in ("frequency", "measured", "before", "after", "deviation") for i in (0, 1)
    }
    with pytest.raises(InputError, match="every FRF is sealed"):
        trace_frfs([replace(r, sealed=True) for r in records], MACHINE)


@pytest.mark.thorough
def test_a_shift_is_told_in_the_deviations_the_joint_was_identified_with() -> None:
    known = replace(UPPER, covariance=Covariance(("linear.stiffness",), np.array([[(1e6) ** 2]])))
    machine = MACHINE.with_joint("j0", known)
    found = trace_frfs(measured(MACHINE.with_joint("j0", ALTERED[0][1])), machine)
    assert found.chosen is not None
    assert found.chosen.shift["linear.stiffness"] == pytest.approx(4.0, abs=0.1)
    assert "leave the range they were identified in" in found.sentence


@pytest.mark.slow
def test_the_same_records_give_the_same_report() -> None:
    records = measured(MACHINE.with_joint("j0", ALTERED[2][1]))
    first, second = (json.dumps(trace_frfs(records, MACHINE, seed=3).as_json()) for _ in range(2))
    assert first == second
    report = json.loads(first)
    assert isinstance(report["error_before"]["relative"], float)
    assert isinstance(report["error_after"]["in_sample"], float)
    assert report["repro"]["seed"] == 3
    assert report["candidates"][0]["status"] == "accepted"
    assert all(row["place"] in ("j0", "j1") for row in report["candidates"])


def test_rows_of_a_carriage_are_one_place_and_change_together() -> None:
    machine = read_machine(LIBRARY / "carriage.toml")
    places = places_of(machine)
    assert [p.name for p in places] == ["guide", "screw"]
    guide = refit(machine, places[0])
    joints = guide.joints(np.full(len(guide.coordinates), np.log(1.2)), exact=True)
    for row in places[0].rows:
        for name, value in machine.joints()[row].parameters.items():
            assert joints[row].parameters[name] == pytest.approx(1.2 * value)
    assert joints[places[1].rows[0]] is machine.joints()[places[1].rows[0]]
    assert len({id(joints[row]) for row in places[0].rows}) == len(
        {id(machine.joints()[row]) for row in places[0].rows}
    )
