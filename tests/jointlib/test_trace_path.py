"""Closing the loop along a measured path, on records made by formulas that no law of the catalogue shares."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from repeats import repeats

from jointlib.arrays import Array
from jointlib.effect import Scale
from jointlib.effects.jenkins_play import SlipWithPlay
from jointlib.errors import InputError
from jointlib.io.measurement_file import read_records
from jointlib.joint import Joint
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.gap import Gap
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from jointlib.loop.answer import catalogue as module
from jointlib.loop.answer.refit import refit
from jointlib.loop.answer.report import Status, TraceReport, Verdict
from jointlib.loop.path.acceptance import assess
from jointlib.loop.path.checks import exists_in_time
from jointlib.loop.path.columns import ColumnStore, law_forces
from jointlib.loop.path.estimates import shape_units
from jointlib.loop.path.preparation import Preparation, choose_preparation, prepare
from jointlib.loop.path.regression import block_grams, hold_out, solve, solve_signed
from jointlib.loop.trace import trace
from jointlib.measurement import Channel, Mass, Measurement, RecordSource
from jointlib.parameter import parameters_of
from jointlib.registry import Installed, installed

RATE = 400.0
MASS, DAMPING, OFFSET = 40.0, 150.0, -2.0
Friction = Callable[[Array, Array], Array]


def smooth_step(s: Array) -> Array:
    """From 0 to 1 with four vanishing derivatives at either end."""
    return np.asarray(s**5 * (126 - 420 * s + 540 * s**2 - 315 * s**3 + 70 * s**4))


def cycle(speeds: tuple[float, ...], cycles: int) -> Array:
    """Position in m: to and fro over 30 mm at each peak speed in turn, with short rests, sampled at ``RATE``."""
    z = [np.zeros(500)]
    for speed in speeds * cycles:
        n = round(0.03 * 2.46 / speed * RATE)
        stroke = 0.03 * smooth_step(np.arange(1, n + 1) / n)
        z += [stroke, np.full(30, 0.03), 0.03 - stroke, np.zeros(30)]
    return np.concatenate([*z, np.zeros(500)])


def drive(friction: Friction, z: Array, seed: int = 0, noise: float = 0.3) -> dict[str, Array]:
    """Force and position of a drive whose derivatives come from a spline, with sensor noise and resolution."""
    from scipy.interpolate import make_interp_spline

    spline = make_interp_spline(np.arange(len(z)) / RATE, z, k=5)
    t = np.arange(len(z)) / RATE
    v, a = spline.derivative(1)(t), spline.derivative(2)(t)
    rng = np.random.default_rng(seed)
    force = MASS * a + DAMPING * v + OFFSET + friction(z, v) + noise * rng.standard_normal(len(z))
    return {"z": np.round(z / 1e-7) * 1e-7, "F": force}


def dry(force: float, velocity: float = 5e-4) -> Friction:
    """Dry friction, rounded at rest by a root instead of a hyperbolic tangent."""
    return lambda z, v: force * v / np.sqrt(v**2 + velocity**2)


def measurement(folder: Path, carriage: Mass | None, **files: tuple[dict[str, Array], str, str | None]) -> Measurement:
    records = []
    for name, (columns, role, condition) in files.items():
        np.savez(folder / f"{name}.npz", allow_pickle=False, **columns)
        records.append(RecordSource(folder / f"{name}.npz", role, condition=condition))
    channels = Channel("z", "position", "m", "m", 1.0), Channel("F", "force", "N", "N", 1.0)
    return Measurement(folder / "m.toml", "path", channels, tuple(records), sample_rate=RATE, carriage=carriage)


def traced(folder: Path, friction: Friction, start: Joint, seed: int = 0) -> TraceReport:
    record = drive(friction, cycle((0.05, 0.1, 0.2), 3), seed)
    return trace(measurement(folder, Mass(None), fit=(record, "fit", None)), start)


VISCOUS = Joint((Viscous(50.0),))


@pytest.fixture(scope="module")
def rubbing(tmp_path_factory: pytest.TempPathFactory) -> TraceReport:
    return traced(tmp_path_factory.mktemp("rubbing"), dry(18.0), VISCOUS)


@pytest.mark.slow
def test_dry_friction_on_a_drive_is_named_with_its_force_and_the_mass(rubbing: TraceReport) -> None:
    assert rubbing.verdict in (Verdict.IDENTIFIED, Verdict.AMBIGUOUS)
    assert rubbing.chosen is not None
    assert rubbing.chosen.family == "coulomb"
    step = rubbing.reduction["steps"][1]["parameters"]
    assert step["coulomb.slip_force"].value == pytest.approx(18.0, rel=0.02)
    assert step["mass"].value == pytest.approx(MASS, rel=0.01)
    assert step["viscous.damping"].value == pytest.approx(DAMPING, rel=0.02)
    assert step["offset"].value == pytest.approx(OFFSET, abs=0.1)
    assert rubbing.error_after["relative"] < 0.1 * rubbing.error_before["relative"]


@pytest.mark.slow
def test_standard_errors_hold_the_truth(rubbing: TraceReport) -> None:
    step = rubbing.reduction["steps"][1]["parameters"]
    for name, truth in (("mass", MASS), ("viscous.damping", DAMPING), ("offset", OFFSET)):
        assert abs(step[name].value - truth) < 5 * step[name].standard_error
    names = rubbing.mended.covariance.names if rubbing.mended.covariance else ()
    assert set(names) <= set(rubbing.mended.parameters)
    assert "coulomb.slip_force" in names


@pytest.mark.thorough
def test_speeds_are_found_as_conditions_and_cycles_give_the_floor(rubbing: TraceReport) -> None:
    assert rubbing.data["conditions"]["grouped_by"] == "peak speed"
    assert sorted(rubbing.data["conditions"]["found"].values()) == [6, 6, 6]
    assert rubbing.noise_floor["source"] == "cycles"
    # The filter lets cutoff / (rate/2) of the power of white noise pass.
    through = 0.3 * np.sqrt(rubbing.data["preparation"]["cutoff"] / (RATE / 2))
    power = np.sqrt(np.mean(rubbing.plots["force"] ** 2))
    floor = next(iter(rubbing.noise_floor["force_rel_per_record"].values()))
    assert floor * power == pytest.approx(through, rel=0.25)


@pytest.mark.thorough
def test_the_report_is_json_and_is_judged_on_conditions_held_out(rubbing: TraceReport) -> None:
    assert json.loads(json.dumps(rubbing.as_json(), allow_nan=False))["error_before"]["where"] == "condition folds"


@pytest.mark.slow
def test_a_report_depends_on_nothing_but_its_input(tmp_path: Path) -> None:
    reports, record = [], drive(dry(18.0), cycle((0.1,), 1))
    for folder in (tmp_path / "one", tmp_path / "two"):
        folder.mkdir()
        reports.append(trace(measurement(folder, Mass(MASS), fit=(record, "fit", None)), VISCOUS))
    first, second = (json.dumps(report.as_json(), allow_nan=False) for report in reports)
    assert first == second


@pytest.mark.parametrize("seed", repeats(range(3), lambda seed: seed == 0))
def test_nothing_is_named_where_only_noise_is_left(tmp_path: Path, seed: int) -> None:
    report = traced(tmp_path, lambda z, v: 0 * z, VISCOUS, seed)
    assert report.verdict is Verdict.NOTHING_MISSING
    assert report.chosen is None
    assert report.mended is not None
    assert report.mended.parameters == VISCOUS.parameters
    assert report.error_before == report.error_after


@pytest.mark.slow
def test_an_effect_outside_the_catalogue_gets_no_name(tmp_path: Path) -> None:
    def ripple(z: Array, v: Array) -> Array:
        return np.asarray(12.0 * np.cos(2 * np.pi * z / 0.011 + 0.4))

    report = traced(tmp_path, ripple, VISCOUS)
    assert report.verdict in (Verdict.UNEXPLAINED, Verdict.PARTIAL)
    assert report.unexplained["fraction"] > 0.05


@pytest.mark.slow
def test_friction_that_rises_with_speed_is_not_called_stribeck(tmp_path: Path) -> None:
    def rising(z: Array, v: Array) -> Array:
        return np.asarray(20.0 * v / np.sqrt(v**2 + 1e-6) * (1 - 0.5 / (1 + (v / 0.05) ** 2)))

    report = traced(tmp_path, rising, VISCOUS + Coulomb(10.0, 1e-3))
    assert all(r.family != "stribeck" for r in report.rivals)
    assert "stribeck" not in [law.kind for law in report.mended.laws]
    row = next(c for c in report.candidates if c.family == "stribeck")
    assert row.status is Status.UNPHYSICAL
    assert row.parameters["stribeck_velocity"].unit == row.parameters["smoothing_velocity"].unit == "m/s"


@pytest.mark.slow
def test_a_sealed_record_judges_and_does_not_teach(tmp_path: Path) -> None:
    fit, sealed = drive(dry(18.0), cycle((0.1, 0.2), 3)), drive(dry(18.0), cycle((0.12, 0.15), 2), seed=7)
    weaker = {**sealed, "F": sealed["F"] - 5.0}
    reports = []
    for other in (sealed, weaker):
        m = measurement(tmp_path, Mass(MASS), fit=(fit, "fit", None), kept=(other, "sealed", None))
        reports.append(trace(m, VISCOUS))
    honest, shifted = reports
    assert honest.mended.parameters == shifted.mended.parameters
    assert honest.error_after["where"] == "sealed"
    assert honest.error_after["relative"] < 0.1 * honest.error_before["relative"]
    # An offset that the fit records do not have stays in the residual, whole.
    rms = np.sqrt(np.mean(weaker["F"] ** 2))
    assert shifted.error_after["relative"] * rms == pytest.approx(5.0, rel=0.1)
    assert not any("spent" in w for w in shifted.warnings)
    assert any("spent" in w for w in trace(m, shifted.mended).warnings)


@pytest.mark.slow
def test_what_makes_the_sealed_record_worse_is_not_added(tmp_path: Path) -> None:
    """Records that rub, sealed one of the same drive that does not: friction fits the former and not the latter."""
    fit, free = drive(dry(18.0), cycle((0.1, 0.2), 3)), drive(lambda z, v: 0 * z, cycle((0.12, 0.15), 2), seed=7)
    report = trace(measurement(tmp_path, Mass(MASS), fit=(fit, "fit", None), kept=(free, "sealed", None)), VISCOUS)
    assert report.verdict is Verdict.UNEXPLAINED
    assert any("coulomb the error on the sealed record does not fall" in w for w in report.warnings)
    assert report.mended.parameters == VISCOUS.parameters
    assert report.error_after == report.error_before
    assert report.chosen is not None
    assert report.chosen.family == "coulomb"
    row = next(c for c in report.candidates if c.member == "coulomb")
    assert (row.status, report.secondary) == (Status.REJECTED, ())
    assert "sealed record" in row.reason
    assert all(link["status"] == "hypothesis" for link in report.chain)


@pytest.mark.slow
def test_one_trajectory_repeated_is_at_best_ambiguous(tmp_path: Path) -> None:
    record = drive(dry(18.0), cycle((0.1,), 6))
    report = trace(measurement(tmp_path, Mass(None), fit=(record, "fit", None)), VISCOUS)
    assert report.verdict is Verdict.AMBIGUOUS
    assert any(w.startswith("shape_not_tested") for w in report.warnings)
    assert report.error_before["where"] == "block folds"


@pytest.mark.slow
def test_declared_conditions_are_the_folds(tmp_path: Path) -> None:
    files = {
        name: (drive(dry(18.0), cycle((speed,), 4), seed=i), "fit", name)
        for i, (name, speed) in enumerate((("slow", 0.05), ("fast", 0.2)))
    }
    report = trace(measurement(tmp_path, Mass(None), **files), VISCOUS)
    assert report.data["conditions"] == {"grouped_by": "declared conditions", "found": {"slow": 8, "fast": 8}}
    assert report.chosen is not None
    assert report.chosen.family == "coulomb"


@pytest.mark.slow
def test_play_in_a_spring_without_inertia_is_named(tmp_path: Path) -> None:
    """A slow test of a sprung joint: a spring with a dead zone, at three amplitudes, no mass in the balance."""
    t = np.arange(0, 12, 1 / RATE)
    rng = np.random.default_rng(3)
    files = {}
    for i, amplitude in enumerate((0.4e-3, 0.7e-3, 1.0e-3)):
        z = amplitude * np.sin(2 * np.pi * t)
        force = 2e5 * (np.maximum(z - 1e-4, 0) + np.minimum(z + 1e-4, 0)) + rng.standard_normal(len(t))
        files[f"level{i}"] = {"z": z, "F": force}, "fit", f"level {i}"
    report = trace(measurement(tmp_path, None, **files), Joint((Linear(1e5),)))
    assert report.chosen is not None
    assert report.chosen.family == "gap"
    gap = next(law for law in report.mended.laws if isinstance(law, Gap))
    assert gap.clearance == pytest.approx(1e-4, rel=0.02)
    assert "mass" not in report.extra_baseline


def test_a_record_that_does_not_move_is_refused(tmp_path: Path) -> None:
    still = {"z": np.zeros(4000), "F": np.random.default_rng(0).standard_normal(4000)}
    with pytest.raises(InputError, match="does not move"):
        trace(measurement(tmp_path, None, fit=(still, "fit", None)), VISCOUS)


@pytest.mark.parametrize(("derivative", "tolerance"), [("central", 0.02), ("spectral", 5e-4)])
def test_filter_and_derivatives_shift_nothing(derivative: str, tolerance: float) -> None:
    preparation = Preparation(1000.0, 60.0, 200, 5, derivative, "")
    t = np.arange(4000) / 1000
    omega = 2 * np.pi * 20.0
    slope = preparation.slope(preparation.filtered(np.sin(omega * t)))[500:-500]
    rounded = 1 / (1 + (np.tan(np.pi * 20 / 1000) / np.tan(np.pi * 60 / 1000)) ** 8)
    gain = rounded if derivative == "central" else 1.0
    assert slope == pytest.approx(gain * omega * np.cos(omega * t)[500:-500], abs=tolerance * omega)


def test_a_spectrum_cut_twice_is_as_if_cut_once() -> None:
    """So a force linear in the filtered path needs no second filter, and mixes with others that pass it."""
    preparation = Preparation(600.0, 200.0, 80, 1, "spectral", "")
    x = np.cumsum(np.random.default_rng(0).standard_normal(3000))
    once = preparation.filtered(x)
    assert preparation.filtered(once) == pytest.approx(once, abs=1e-9 * float(np.max(np.abs(x))))


def test_a_test_that_is_ramped_up_counts_from_its_first_turn(tmp_path: Path) -> None:
    t = np.arange(0, 10, 1 / RATE)
    for ramp, first in ((np.minimum(t / 4, 1), 0.2), (np.ones_like(t), 0.0)):
        z = 1e-3 * ramp * np.sin(2 * np.pi * t)
        m = measurement(tmp_path, None, fit=({"z": z, "F": 1e5 * z}, "fit", None))
        records = read_records(m, m.records)
        run = prepare(m, records[0], choose_preparation(m, records))
        rate, edge = run.preparation.sample_rate, run.preparation.edge
        assert max(first * rate, edge) <= run.begin <= max(0.4 * rate, edge)


def test_held_out_losses_are_those_of_fits_without_the_block() -> None:
    rng = np.random.default_rng(1)
    columns, target = rng.standard_normal((3, 60)), rng.standard_normal(60)
    rows = tuple(np.split(np.arange(60), 6))
    folds = np.array([0, 0, 1, 1, 2, 2])
    held = hold_out(block_grams(columns, target, rows), np.full(6, 10), folds, np.ones(6))
    for b, r in enumerate(rows):
        left = np.concatenate([rows[k] for k in range(6) if folds[k] != folds[b]])
        beta = np.linalg.lstsq(columns[:, left].T, target[left], rcond=None)[0]
        assert held.blocks[b] == pytest.approx(np.mean((target[r] - beta @ columns[:, r]) ** 2), rel=1e-10)


def test_the_error_of_a_gain_is_that_of_drawing_the_blocks_again() -> None:
    rng = np.random.default_rng(5)
    now = 0.1 + 0.02 * rng.random(24)
    new, floor, folds = 0.4 * now + 0.02 * rng.random(24), np.full(24, 0.01), np.arange(24) % 3
    found = assess(now, new, floor, folds, seed=0)
    drawn = rng.integers(24, size=(20000, 24))
    gains = (np.maximum(now - floor, 0) - np.maximum(new - floor, 0))[drawn].sum(axis=1) / (now - floor).sum()
    # Drawing from 24 blocks divides their variance by 24, an estimate of it by 23.
    assert found.share_error == pytest.approx(gains.std() * np.sqrt(24 / 23), rel=0.02)
    assert abs(found.share - gains.mean()) < 0.05 * found.share_error


def test_every_shape_that_a_law_shares_with_its_effect_has_the_unit_of_the_law() -> None:
    joint, shared = Joint((Linear(1e6),)), 0
    for effect in module.catalogue().joint:
        if not exists_in_time(effect) or not effect.shapes(Scale(1e-6, 1e-2, 1e6), joint):
            continue
        units = shape_units(effect, joint)
        law = installed("jointlib.laws").found[effect.member]
        for p in parameters_of(law):
            if p.name in units and p.unit != "1":
                assert units[p.name] == p.unit, (effect.family, p.name)
                shared += 1
        assert units.get("slip_distance", "m") == "m"
    assert shared >= 5


def test_refit_finds_a_clearance_and_respects_what_is_fixed() -> None:
    z = np.linspace(-1e-3, 1e-3, 400)
    truth = Joint((Linear(2e5), Gap(1e5, 3e-4)))
    noise = np.random.default_rng(0).standard_normal(len(z))
    measured = truth.force_along(z, 0 * z) + noise
    start = Joint((Linear(1e5), Gap(1e5, 5e-4)), fixed=frozenset({"gap.stiffness"}))
    fitted, chi2 = refit(start, lambda j: measured - j.force_along(z, 0 * z), tuple(start.parameters))
    assert fitted.parameters["gap.stiffness"] == 1e5
    assert chi2 == pytest.approx(1.0, abs=0.25)
    assert fitted.covariance is not None
    assert fitted.covariance.names == ("linear.stiffness", "gap.clearance")
    for name in fitted.covariance.names:
        error = fitted.covariance.standard_error(name)
        assert abs(fitted.parameters[name] - truth.parameters[name]) < 4 * error


def test_refit_stays_within_the_bounds_of_a_law() -> None:
    v = np.linspace(-1, 1, 50)
    fitted, _ = refit(Joint((Viscous(1.0),)), lambda j: -3.0 * v - j.force_along(0 * v, v), ("viscous.damping",))
    assert fitted.parameters["viscous.damping"] == pytest.approx(0.0, abs=1e-6)


def test_an_effect_that_does_not_load_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    have = installed("jointlib.effects")
    broken = Installed({"coulomb": have.found["coulomb"]}, {"mine": "ImportError: no module"})
    monkeypatch.setattr(module, "installed", lambda group: broken)
    found = module.catalogue()
    assert [e.family for e in found.joint] == ["coulomb"]
    assert found.failed == ("Effect mine did not load: ImportError: no module.",)


@pytest.mark.slow
@pytest.mark.parametrize("quantity", ["position", "displacement"])
def test_a_force_that_repeats_with_the_pitch_of_the_screw_is_a_fault_of_the_feed(tmp_path: Path, quantity: str) -> None:
    def ripple(z: Array, v: Array) -> Array:
        return np.asarray(9.0 * np.sin(2 * np.pi * z / 0.0025 + 0.7))

    measured = measurement(tmp_path, Mass(None), fit=(drive(ripple, cycle((0.05, 0.1, 0.2), 3)), "fit", None))
    place, force = measured.channels
    report = trace(replace(measured, channels=(replace(place, quantity=quantity), force)), VISCOUS)
    assert report.chosen is not None
    assert report.chosen.family == "position-stiffness"
    assert report.mended.parameters.keys() == VISCOUS.parameters.keys()
    found, told = report.corrections[0].parameters, report.chosen.parameters["position_stiffness.wavelength"]
    # Of wavelengths between those of the grid, which lie 2.5 % apart here, the fit leaves what noise leaves.
    assert found["wavelength"] == told.value == pytest.approx(0.0025, abs=3 * told.standard_error)
    assert told.standard_error < 1e-3 * told.value
    assert np.hypot(found["cosine"], found["sine"]) == pytest.approx(9.0, rel=0.1)


def drifting(seed: int) -> dict[str, Array]:
    """A drive whose force sensor warms up: its zero moves by 20 N, most of it early."""
    record = drive(lambda z, v: 0 * z, cycle((0.05, 0.1, 0.2), 3), seed)
    t = np.arange(len(record["F"])) / RATE
    return {**record, "F": record["F"] + 20 * (t / t[-1]) * (1.5 - 0.5 * t / t[-1])}


@pytest.mark.slow
def test_a_zero_that_wanders_is_undone_as_a_drift(tmp_path: Path) -> None:
    measured = measurement(tmp_path, Mass(None), fit=(drifting(0), "fit", None))
    report = trace(measured, VISCOUS)
    assert report.chosen is not None
    assert (report.chosen.family, report.chosen.channel) == ("drift", "F")
    assert report.sentence.startswith("The records show that the zero of the force wanders")
    assert [c.family for c in report.corrections] == ["drift"]
    again = trace(replace(measured, corrections=report.corrections), report.mended)
    assert again.verdict is Verdict.NOTHING_MISSING
    assert again.error_before["relative"] == pytest.approx(report.error_after["relative"], rel=0.1)


@pytest.mark.slow
def test_records_without_a_common_clock_cannot_show_a_drift(tmp_path: Path) -> None:
    files = {f"r{i}": (drifting(i), "fit", None) for i in range(2)}
    apart = measurement(tmp_path, Mass(None), **files)
    report = trace(apart, VISCOUS)
    assert "drift" in {row["family"] for row in report.not_decidable}
    assert "drift" not in {c.family for c in report.candidates}
    together = replace(apart, records=tuple(replace(r, start=100.0 * i) for i, r in enumerate(apart.records)))
    assert "drift" in {c.family for c in trace(together, VISCOUS).candidates}


@pytest.mark.slow
def test_a_late_force_is_shifted_back_exactly(tmp_path: Path) -> None:
    """Four milliseconds are 1.6 samples: the force is evaluated at the earlier time, no sample is moved.

    Found to a tenth of a sample, where the law rounds its reversals as the record does.
    """
    z = cycle((0.05, 0.1, 0.2), 3)
    early = np.interp(np.arange(len(z)) - 1.6, np.arange(len(z)), z)
    record = {**drive(lambda z, v: 18.0 * np.tanh(v / 5e-4), early), "z": z}
    report = trace(measurement(tmp_path, Mass(None), fit=(record, "fit", None)), VISCOUS + Coulomb(10.0, 5e-4))
    assert report.chosen is not None
    assert report.chosen.family == "lag"
    assert report.corrections[0].parameters["lag"] == pytest.approx(4e-3, abs=0.1 / RATE)
    assert report.verdict in (Verdict.IDENTIFIED, Verdict.AMBIGUOUS)


SPRING = 2e5


def sprung(z: Array, v: Array) -> Array:
    """A spring and 250 N s/m of damping."""
    return np.asarray(SPRING * z + (250 - DAMPING) * v)


@pytest.mark.slow
def test_a_lag_that_would_need_a_damper_that_drives_is_refused(tmp_path: Path) -> None:
    """Of k z + c v + m a, the inertia unknown to the model: −(m/c) dF/dt has it, and takes m k/c off the damping c."""
    record = drive(sprung, cycle((0.05, 0.1, 0.2), 3))
    start = Joint((Linear(SPRING), Viscous(250.0)))
    report = trace(measurement(tmp_path, None, fit=(record, "fit", None)), start)
    assert 250 - MASS * SPRING / 250 < 0
    row = next(c for c in report.candidates if c.family == "lag")
    assert (row.status, row.reason) == (Status.UNPHYSICAL, "best fit has a damping below zero beside it")
    assert "lag" not in {c.family for c in report.corrections}


@pytest.mark.thorough
def test_few_blocks_are_said_and_what_can_be_decided_is_decided(tmp_path: Path) -> None:
    """Four declared periods of one sine: three are whole within the edges."""
    t = np.arange(0, 4.2, 1 / RATE)
    z = 0.01 * np.sin(2 * np.pi * t)
    m = measurement(tmp_path, Mass(MASS), fit=(drive(dry(18.0), z), "fit", None))
    report = trace(replace(m, period=round(RATE)), VISCOUS)
    assert report.data["blocks"] < 8
    assert report.verdict is not Verdict.IDENTIFIED
    why = [row["why"] for row in report.not_decidable if row["family"] == "all"]
    assert any("one trajectory" in w for w in why)
    assert any("blocks to hold out" in w for w in why)
    assert any("blocks to hold out" in w for w in report.warnings)
    assert {c.family for c in report.candidates[:3]} <= {"coulomb", "hysteresis", "stribeck"}


@pytest.mark.slow
def test_one_cycle_shows_friction_by_its_slow_and_fast_parts(tmp_path: Path) -> None:
    report = trace(measurement(tmp_path, Mass(MASS), fit=(drive(dry(18.0), cycle((0.1,), 1)), "fit", None)), VISCOUS)
    assert report.data["conditions"]["grouped_by"] == "thirds of peak speed"
    assert report.noise_floor["source"] == "unknown"
    assert report.chosen is not None
    assert report.chosen.family == "coulomb"


def test_a_force_that_never_changes_is_refused(tmp_path: Path) -> None:
    dead = {"z": cycle((0.1,), 2), "F": np.full(len(cycle((0.1,), 2)), 3.0)}
    with pytest.raises(InputError, match="'F' never changes"):
        trace(measurement(tmp_path, None, fit=(dead, "fit", None)), VISCOUS)


def test_a_record_of_a_few_samples_is_refused(tmp_path: Path) -> None:
    short = {"z": np.sin(np.arange(100.0)), "F": np.cos(np.arange(100.0))}
    with pytest.raises(InputError, match="100 samples, expected at least 256"):
        trace(measurement(tmp_path, None, fit=(short, "fit", None)), VISCOUS)


@pytest.mark.slow
def test_samples_at_the_end_of_the_range_are_said(tmp_path: Path) -> None:
    record = drive(dry(18.0), cycle((0.05, 0.1), 3))
    top = float(np.max(record["F"]))
    clipped = {**record, "F": np.minimum(record["F"], 0.8 * top)}
    m = measurement(tmp_path, Mass(None), fit=(clipped, "fit", None))
    force = replace(m.channels[1], full_scale=0.8 * top)
    report = trace(replace(m, channels=(m.channels[0], force)), VISCOUS)
    assert any("end of its range" in w for w in report.warnings)


def test_elements_in_parallel_do_not_pull_against_one_another() -> None:
    """Two nearly equal columns, of which the truth needs one: free signs give one of them the wrong one."""
    rng = np.random.default_rng(4)
    a, c = rng.standard_normal((2, 200))
    columns = np.array([c, a, a + 0.05 * rng.standard_normal(200)])
    target = 2 * c + 3 * columns[1] - 0.4 * (columns[2] - a) / 0.05
    A, b = columns @ columns.T, columns @ target
    free, held = solve(A, b), solve_signed(A, b, 2)
    assert free[2] < 0
    assert held[2] == 0
    assert held[:2] == pytest.approx(np.linalg.lstsq(columns[:2].T, target, rcond=None)[0], rel=1e-9)


def test_a_grid_of_slip_distances_is_stepped_as_each_one_alone(tmp_path: Path) -> None:
    t = np.arange(0, 6, 1 / RATE)
    z = 1e-3 * np.sin(2 * np.pi * t) * np.minimum(t, 1)
    files = {f"r{i}": ({"z": s * z, "F": 1e5 * s * z}, "fit", None) for i, s in enumerate((1.0, 0.5))}
    m = measurement(tmp_path, None, **files)
    records = read_records(m, m.records)
    chosen = choose_preparation(m, records)
    runs = [prepare(m, r, chosen) for r in records]
    effect, joint = SlipWithPlay(), Joint((Linear(1e5),))
    shapes = [{"slip_distance": d, "clearance": c} for d in (1e-4, 3e-4) for c in (5e-5, 2e-4)]
    for shape, together in zip(shapes, ColumnStore(runs).columns(effect, shapes, joint), strict=True):
        alone = law_forces(runs)(Jenkins(1.0, shape["slip_distance"], shape["clearance"]))
        assert together[0] == pytest.approx(alone, abs=1e-12)


@pytest.mark.slow
def test_a_record_of_400_000_samples_stays_under_two_gigabytes(tmp_path: Path) -> None:
    """Simulated, with the whole installed catalogue; peak resident memory of a process of its own, in KiB.

    A band of 10 Hz keeps it to minutes: laws with memory are then stepped along every eighth sample.
    """
    rng = np.random.default_rng(0)
    t = np.arange(400_000) / RATE
    level = np.repeat((0.4, 0.7, 1.0, 0.5), 100_000)
    z = 1e-3 * level * np.sin(2 * np.pi * 1.0 * t)
    force = 2e5 * z + 30 * np.sign(np.gradient(z)) + rng.standard_normal(len(t))
    np.savez(tmp_path / "long.npz", allow_pickle=False, z=z, F=force)
    script = f"""
import resource
from pathlib import Path
from jointlib.joint import Joint
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from jointlib.loop.trace import trace
from jointlib.measurement import Channel, Measurement, RecordSource
channels = Channel("z", "position", "m", "m", 1.0), Channel("F", "force", "N", "N", 1.0)
folder = Path({str(tmp_path)!r})
source = RecordSource(folder / "long.npz", "fit")
m = Measurement(folder / "m.toml", "path", channels, (source,), sample_rate={RATE}, band=(0.0, 10.0))
report = trace(m, Joint((Linear(1e5), Viscous(10.0))))
print(report.candidates[0].family, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    family, peak = done.stdout.split()
    assert family in ("coulomb", "hysteresis", "stribeck")
    assert int(peak) < 2 * 1024**2


@pytest.mark.slow
def test_a_mass_that_nobody_declared_is_the_first_thing_that_is_missing(tmp_path: Path) -> None:
    """Without a carriage in the file, moved fast enough that inertia is most of the force."""
    record = drive(dry(4.0), cycle((0.2, 0.4, 0.6), 3))
    report = trace(measurement(tmp_path, None, fit=(record, "fit", None)), VISCOUS)
    assert report.chosen is not None
    assert report.chosen.family == "missing-mass", report.sentence
    assert report.chosen.parameters["missing_mass.mass"].value == pytest.approx(MASS, rel=0.02)
    assert "a mass moves along the path" in report.sentence
    assert report.error_after["relative"] < 0.2 * report.error_before["relative"]
    assert {n["family"] for n in report.not_decidable}.isdisjoint({"missing-mass"})
    found = dict(report.corrections[0].parameters)
    assert found["mass"] == pytest.approx(MASS, rel=0.02)


@pytest.mark.slow
def test_without_inertia_no_mass_is_missing(tmp_path: Path) -> None:
    still = drive(dry(10.0), cycle((0.05, 0.1, 0.2), 3))
    z = still["z"]
    a = np.gradient(np.gradient(z, 1 / RATE), 1 / RATE)
    smooth = np.convolve(a, np.ones(25) / 25, "same")
    still["F"] = still["F"] - MASS * smooth
    report = trace(measurement(tmp_path, None, fit=(still, "fit", None)), VISCOUS)
    assert report.chosen is not None
    assert report.chosen.family == "coulomb", report.sentence
    assert "missing-mass" not in [c["family"] for c in report.chain]
