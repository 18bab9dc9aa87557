"""Several effects at once along a path: a magneto-rheological damper in random motion, a drive that is moved by pulses.

Simulated by formulas that no law of the catalogue shares.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import firwin, oaconvolve

from jointlib.arrays import Array
from jointlib.effects.coulomb import CoulombFriction
from jointlib.effects.viscous_by_direction import DirectionalDamping
from jointlib.errors import InputError
from jointlib.io.joint_file import read_joint, write_joint
from jointlib.joint import Joint
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.dahl import Dahl
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from jointlib.loop.answer.report import TraceReport, Verdict
from jointlib.loop.path.columns import bare_forces
from jointlib.loop.path.composed.follower import Follower, followers
from jointlib.loop.path.composed.remains import said
from jointlib.loop.path.force.followed import Followed
from jointlib.loop.path.preparation import Run, choose_preparation, prepare
from jointlib.loop.trace import trace
from jointlib.measurement import Channel, Mass, Measurement, Record, RecordSource
from jointlib.modulation import Modulation, hats, stepped
from jointlib.parameter import Role

RATE = 200.0
SPRUNG = Joint((Linear(1000.0), Viscous(100.0)), "damper")


def wandering(rng: np.random.Generator, count: int, cutoff: float) -> Array:
    """Band-limited random numbers of rms 1."""
    taps = firwin(1001, cutoff, fs=RATE)
    x = oaconvolve(rng.standard_normal(count + 1000), taps, mode="valid")
    return np.asarray(x / x.std())


def damper(seed: int, loop: float) -> dict[str, Array]:
    """A magneto-rheological damper: spring and damper, and a yield force that grows with the voltage and turns over a
    little later than the speed does (``loop``)."""
    rng = np.random.default_rng(seed)
    z = 0.01 * wandering(rng, 6000, 2.5)
    v = np.gradient(z, 1 / RATE)
    voltage = np.clip(2.0 + wandering(rng, 6000, 0.4), 0.0, 5.0)
    turning = v + loop * np.gradient(v, 1 / RATE)
    force = 2000 * z + 300 * v + (40 + 60 * voltage) * turning / np.sqrt(turning**2 + 0.008**2)
    return {"z": z, "F": force + 0.004 * force.std() * rng.standard_normal(len(z)), "u": voltage}


def pulsed(seed: int) -> dict[str, Array]:
    """A carriage of 40 kg that single pulses of speed move, with dry friction and more drag one way than the other."""
    rng, v = np.random.default_rng(seed), np.zeros(5000)
    at = 120
    while at < len(v) - 400:
        n = int(rng.uniform(60, 200))
        pulse = np.sin(np.pi * np.arange(n) / n) ** 2 * rng.uniform(0.03, 0.3) * rng.choice([-1, 1])
        v[at : at + n] += pulse
        at += n + int(rng.uniform(10, 60))
    z = np.concatenate([[0.0], np.cumsum((v[1:] + v[:-1]) / 2)]) / RATE
    force = 40 * np.gradient(v, 1 / RATE) + 150 * v + 60 * np.abs(v) + 9 * v / np.hypot(v, 6e-4) - 2.0
    return {"z": z, "F": force + 0.01 * force.std() * rng.standard_normal(len(z))}


def measured(folder: Path, columns: dict[str, Array], carriage: Mass | None = None) -> Measurement:
    np.savez(folder / "r.npz", allow_pickle=False, **columns)
    channels = [Channel("z", "displacement", "m", "m", 1.0), Channel("F", "force", "N", "N", 1.0)]
    if "u" in columns:
        channels.append(Channel("u", "voltage", "V", "V", 1.0, is_input=True))
    source = RecordSource(folder / "r.npz", "fit")
    return Measurement(folder / "m.toml", "path", tuple(channels), (source,), sample_rate=RATE, carriage=carriage)


def members(report: TraceReport) -> list[str]:
    return [c["member"] for c in report.composition]


@pytest.fixture(scope="module")
def yielding(tmp_path_factory: pytest.TempPathFactory) -> TraceReport:
    return trace(measured(tmp_path_factory.mktemp("yielding"), damper(0, 0.0)), SPRUNG)


@pytest.mark.slow
def test_friction_that_follows_a_voltage_is_found_where_no_effect_alone_explains_most(yielding: TraceReport) -> None:
    assert yielding.verdict in (Verdict.IDENTIFIED, Verdict.AMBIGUOUS), yielding.sentence
    assert members(yielding) == ["coulomb", "slip-force by voltage"]
    assert yielding.error_after["relative"] < 0.05 * yielding.error_before["relative"]
    found = yielding.mended.parameters
    assert found["linear.stiffness"] == pytest.approx(2000, rel=0.02)
    # The corner of the friction has another form than that of the law; what it leaves is a tenth of the damping.
    assert found["viscous.damping"] == pytest.approx(300, rel=0.15)
    for voltage in (0.5, 2.0, 4.0):
        force = yielding.mended.at({"voltage": voltage}).parameters["coulomb.slip_force"]
        assert force == pytest.approx(40 + 60 * voltage, rel=0.1)


@pytest.mark.slow
def test_what_each_effect_of_a_composition_adds_is_told(yielding: TraceReport) -> None:
    first, second = yielding.composition
    assert first["explained"] < 0.95 < second["explained"]
    assert min(second["per_fold"]) > 0
    assert second["adds"] > 0.9
    assert "Together they explain" in yielding.sentence
    assert [c["status"] for c in yielding.chain] == ["accepted"]
    left = yielding.as_json()["unexplained"]["where"]
    for rows in left.values():
        assert sum(row["share"] for row in rows) == pytest.approx(1.0)


@pytest.mark.thorough
def test_a_joint_whose_force_follows_a_voltage_is_written_and_read_back(yielding: TraceReport, tmp_path: Path) -> None:
    write_joint(tmp_path / "mended.joint.toml", yielding.mended)
    back = read_joint(tmp_path / "mended.joint.toml")
    assert back.modulations == yielding.mended.modulations
    assert [(m.role, m.condition) for m in back.modulations] == [(Role.SLIP_FORCE, "voltage")]


@pytest.mark.slow
def test_an_input_that_nothing_follows_is_not_named(tmp_path: Path) -> None:
    columns = damper(1, 0.0)
    v = np.gradient(columns["z"], 1 / RATE)
    columns["F"] = 2000 * columns["z"] + 300 * v + 150 * v / np.hypot(v, 0.02)
    columns["F"] += 0.004 * columns["F"].std() * np.random.default_rng(3).standard_normal(len(v))
    report = trace(measured(tmp_path, columns), SPRUNG)
    assert report.chosen is not None
    assert report.chosen.family == "coulomb"
    assert report.mended.modulations == ()


@pytest.mark.slow
def test_a_damper_with_a_loop_is_mended_by_what_is_certain(tmp_path: Path) -> None:
    report = trace(measured(tmp_path, damper(2, 0.03)), SPRUNG)
    assert report.verdict is not Verdict.UNEXPLAINED
    assert "slip-force by voltage" in members(report)
    assert report.error_after["relative"] < 0.5 * report.error_before["relative"]


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_a_drive_moved_by_pulses_shows_friction_and_uneven_drag_together(tmp_path: Path, seed: int) -> None:
    report = trace(measured(tmp_path, pulsed(seed), Mass(None)), Joint((Viscous(50.0),), "drive"))
    assert report.verdict in (Verdict.IDENTIFIED, Verdict.AMBIGUOUS), report.sentence
    friction, drag = sorted(law.kind for law in report.mended.laws)
    assert drag == "viscous-by-direction"
    # The corner of this friction is not that of a formula, and one with a bump at rest follows it better.
    assert "coulomb" in {friction, *(rival.family for rival in report.rivals)}
    found = report.mended.parameters
    assert found[f"{friction}.slip_force"] == pytest.approx(9.0, rel=0.03)
    assert found["viscous_by_direction.damping_positive"] == pytest.approx(210, rel=0.05)
    assert found["viscous_by_direction.damping_negative"] == pytest.approx(90, rel=0.05)
    assert report.error_after["relative"] < 0.02


@pytest.mark.slow
def test_two_effects_that_hide_one_another_are_seen_together(tmp_path: Path) -> None:
    """Damping that grows with speed looks like friction that falls: one Stribeck law explains 97 % of the two."""
    columns = pulsed(1)
    v = np.gradient(columns["z"], 1 / RATE)
    force = 40 * np.gradient(v, 1 / RATE) + 100 * v + 9 * v / np.hypot(v, 6e-4) + 330 * v * np.abs(v) ** 0.97 - 2
    columns["F"] = force + 0.005 * force.std() * np.random.default_rng(4).standard_normal(len(v))
    report = trace(measured(tmp_path, columns, Mass(None)), Joint((Viscous(50.0),), "drive"))
    assert sorted(law.kind for law in report.mended.laws) == ["coulomb", "quadratic-damping", "viscous"], (
        report.sentence
    )
    found = report.mended.parameters
    assert found["coulomb.slip_force"] == pytest.approx(9.0, rel=0.05)
    assert found["viscous.damping"] == pytest.approx(100.0, rel=0.05)
    assert report.error_after["relative"] < 0.08 * report.error_before["relative"]


def run_with(columns: dict[str, Array], folder: Path) -> Run:
    m = measured(folder, columns)
    record = Record(m.records[0], columns, RATE, None, "")
    return prepare(m, record, choose_preparation(m, [record]))


def line(role: Role, rise: float) -> Modulation:
    return Modulation(role, "voltage", 2.0, ((0.0, 1 - 2 * rise), (5.0, 1 + 3 * rise)))


def test_a_law_without_memory_follows_an_input_sample_by_sample(tmp_path: Path) -> None:
    run = run_with(damper(0, 0.0), tmp_path)
    v, u = run.path.velocity, run.inputs["voltage"]
    force = Followed((run,)).force(Coulomb(10.0, 0.02), (line(Role.SLIP_FORCE, 0.3),))
    assert force == pytest.approx(run.column(10 * (1 + 0.3 * (u - 2)) * np.tanh(v / 0.02)), abs=1e-9)


def test_a_law_with_memory_follows_a_still_input_as_the_joint_under_that_condition(tmp_path: Path) -> None:
    columns = damper(0, 0.0)
    columns["u"] = np.full(len(columns["z"]), 3.5)
    run, law, m = run_with(columns, tmp_path), Dahl(2e5, 40.0), line(Role.SLIP_FORCE, 0.2)
    table = Modulation(m.role, m.condition, m.reference, ((0.0, 0.6), (2.0, 1.0), (3.5, 1.3), (5.0, 1.6)))
    (held,) = Joint((law,), modulations=(table,)).at({"voltage": 3.5}).laws
    force = Followed((run,)).force(law, (table,))
    assert force == pytest.approx(run.column(bare_forces([run], held)[0]), abs=1e-6)


def test_the_noise_of_an_input_that_is_held_makes_no_points_of_its_table(tmp_path: Path) -> None:
    columns, rng = damper(0, 0.0), np.random.default_rng(1)
    columns["u"] = np.repeat([0.0, 1.0, 2.0], len(columns["z"]) // 3) + 0.003 * rng.standard_normal(len(columns["z"]))
    points = followers([run_with(columns, tmp_path)])[0].points
    assert points == pytest.approx((0.0, 1.0, 2.0), abs=0.01)


@pytest.mark.slow
def test_friction_that_follows_a_voltage_held_in_each_record_is_found(tmp_path: Path) -> None:
    """Alone friction explains little, and damping by the voltage was refused: its factors were held against the damping
    before, and not beside, them."""
    rng, t, sources = np.random.default_rng(2), np.arange(round(20 * RATE)) / RATE, list[RecordSource]()
    for volts in (0.0, 1.0, 2.0):
        z = np.concatenate([a * np.sin(2 * np.pi * f * t[: len(t) // 2]) for a, f in ((5e-3, 1), (8e-3, 2))])
        v = np.gradient(z, 1 / RATE)
        force = 1800 * z + 800 * v + (40 + 260 * volts) * v / np.hypot(v, 1e-3) + 75.0
        np.savez(tmp_path / f"{volts:g}.npz", z=z, F=force + 1.5 * rng.standard_normal(len(z)), u=0 * z + volts)
        sources.append(RecordSource(tmp_path / f"{volts:g}.npz", "fit"))
    held = replace(measured(tmp_path, damper(0, 0.0)), records=tuple(sources))
    report = trace(held, SPRUNG)
    assert report.verdict in (Verdict.IDENTIFIED, Verdict.AMBIGUOUS)
    assert {c["family"] for c in report.composition} <= {"coulomb", "stribeck", "modulation"}
    assert "slip-force by voltage" in members(report)
    assert "the slip force follows the voltage: " in report.sentence
    (table,) = (m for m in report.mended.modulations if m.role is Role.SLIP_FORCE)
    assert [table.factor(u) for u in (0.0, 2.0)] == pytest.approx([40 / 300, 560 / 300], abs=0.05)


@pytest.mark.parametrize("points", [2.0, 5.0])
def test_the_columns_of_a_follower_are_the_slopes_of_its_force(tmp_path: Path, points: float) -> None:
    run = run_with(damper(0, 0.0), tmp_path)
    at = np.quantile(run.inputs["voltage"], (0, 0.25, 0.5, 0.75, 1))
    follower = Follower(Role.SLIP_FORCE, "voltage", tuple(at), float(at[2]))
    joint = Joint((Linear(2000.0), Coulomb(10.0, 0.02)))
    start = follower.start(points, joint)
    columns = Followed((run,)).columns(joint, start)
    rise = 1e-3 * np.array([1.0] if points == 2 else [-0.9, -0.4, 0.3, 1.0])
    moved = stepped(start, rise)
    assert moved is not None
    there, here = (Followed((run,)).force(joint.laws[1], (m,)) for m in (moved, start))
    assert there - here == pytest.approx(rise @ columns, abs=1e-8 * float(np.max(np.abs(columns))))


def test_a_table_that_is_fitted_stays_monotone_positive_and_one_at_its_reference() -> None:
    table = Modulation(Role.DAMPING, "temperature", 300.0, tuple((t, 1.0) for t in (280.0, 290.0, 300.0, 310.0, 320.0)))
    assert len(hats(table, np.array([295.0]))) == 4
    rising = stepped(table, np.array([-1.05, -0.2, 0.3, 0.28]))
    assert rising is not None
    factors = [f for _, f in rising.table]
    assert factors == pytest.approx([0.0, 0.8, 1.0, 1.3, 1.3])
    assert stepped(table, np.array([-0.5, 0.4, 0.5, 0.9])) is None
    assert stepped(table, np.array([-1.5, -0.2, 0.3, 0.5])) is None
    flat = stepped(line(Role.DAMPING, 0.0), np.array([-2.6]))
    assert flat is None or min(f for _, f in flat.table) >= 0


def test_an_effect_that_takes_a_place_leaves_what_follows_an_input() -> None:
    joint = Joint((Viscous(100.0),), modulations=(line(Role.DAMPING, 0.1),))
    moved = DirectionalDamping().apply(np.array([20.0]), {}, joint)
    assert moved is not None
    assert moved.modulations == joint.modulations
    added = CoulombFriction().apply(np.array([2.0]), {"smoothing_velocity": 1e-3}, joint)
    assert added is not None
    assert added.modulations == joint.modulations


def test_what_is_left_is_said_only_where_it_stands_out() -> None:
    even = [{"low": 0.0, "high": 1.0, "share": 0.25, "of_samples": 0.25}] * 4
    peak = [{"low": 0.0, "high": 0.02, "share": 0.8, "of_samples": 0.25}, *even[:3]]
    assert said({"speed": even}) == ""
    assert said({"speed": peak, "time": even}) == "80% of what is left sits at 0 to 0.02 m/s."


def test_a_condition_that_is_none_is_refused_by_name() -> None:
    with pytest.raises(InputError, match="voltage"):
        Modulation(Role.DAMPING, "volts", 0.0, ((0.0, 1.0),))


@pytest.mark.slow
def test_what_a_joint_follows_stays_at_its_reference_where_the_records_do_not_have_it(tmp_path: Path) -> None:
    columns = damper(0, 0.0)
    del columns["u"]
    warm = Modulation(Role.STIFFNESS, "temperature", 295.0, ((280.0, 1.1), (310.0, 0.9)))
    plain = trace(measured(tmp_path, columns), Joint((Linear(1000.0),)))
    warmed = trace(measured(tmp_path, columns), Joint((Linear(1000.0),), modulations=(warm,)))
    assert warmed.error_before == plain.error_before
    assert warmed.baseline.modulations == (warm,)
