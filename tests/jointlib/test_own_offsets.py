"""Records of a path that each have an offset of their own: a load cell set to zero anew, a contact loaded from zero."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from jointlib.arrays import Array
from jointlib.io.measurement_file import read_records
from jointlib.joint import Joint
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from jointlib.loop.answer.report import Verdict
from jointlib.loop.path.columns import law_forces
from jointlib.loop.path.composed.own_offsets import said, with_own_offsets
from jointlib.loop.path.estimates import estimates
from jointlib.loop.path.evidence import Evidence, Model
from jointlib.loop.path.fitted import Fitted, fit
from jointlib.loop.path.preparation import choose_preparation, prepare
from jointlib.loop.path.repeats import repeat_floor
from jointlib.loop.path.strokes import divide
from jointlib.loop.trace import trace
from jointlib.measurement import Channel, Measurement, RecordSource

RATE = 500.0
JOINT = Joint((Linear(5e5), Viscous(100.0)), "mount")
CHANNELS = (Channel("z", "displacement", "m", "m", 1.0), Channel("F", "force", "N", "N", 1.0))


def sweep(amplitude: float, seconds: float) -> Array:
    """From 0.5 to 10 Hz about 1.5 mm."""
    t = np.arange(round(seconds * RATE)) / RATE
    phase = 2 * np.pi * seconds / np.log(20) * 0.5 * (20 ** (t / seconds) - 1)
    return np.asarray(1.5e-3 + amplitude * np.minimum(1, np.minimum(t, seconds - t) / 0.5) * np.sin(phase))


def measured(folder: Path, records: dict[str, tuple[Array, Array]]) -> Measurement:
    for name, (z, F) in records.items():
        np.savez(folder / f"{name}.npz", allow_pickle=False, z=z, F=F)
    sources = tuple(RecordSource(folder / f"{name}.npz", "fit") for name in records)
    return Measurement(folder / "m.toml", "path", CHANNELS, sources, sample_rate=RATE)


def started(folder: Path, offsets: tuple[float, ...], one_way: bool = False) -> Fitted:
    """A spring and a damper in records at several amplitudes with these offsets in N, refitted."""
    records = {}
    for i, offset in enumerate(offsets):
        z = sweep(1e-4 * 2**i, 8.0)
        z = 1e-3 * np.arange(len(z)) / RATE + 0.01 * (z - 1.5e-3) if one_way else z
        noise = np.random.default_rng(i).standard_normal(len(z))
        records[str(i)] = z, 6e5 * z + 300 * np.gradient(z, 1 / RATE) + offset + 0.05 * noise
    measurement = measured(folder, records)
    read = read_records(measurement, measurement.with_role("fit"))
    preparation = choose_preparation(measurement, read)
    runs = tuple(prepare(measurement, record, preparation) for record in read)
    division = divide(runs)
    return fit(Evidence(runs, None, division, repeat_floor(runs, division), law_forces(runs)), Model(JOINT))


def test_offsets_of_records_are_found_and_change_nothing_else(tmp_path: Path) -> None:
    offsets = (0.0, 40.0, -25.0)
    (tmp_path / "apart").mkdir()
    apart, alike = started(tmp_path / "apart", offsets), started(tmp_path, (0.0, 0.0, 0.0))
    own = with_own_offsets(apart)
    assert own is not None
    found = fit(own, Model(JOINT))
    # The same records without offsets are the other route; 0.05 N of noise on 4000 samples is 0.001 N.
    assert own.offsets(found.joint) - own.offsets(alike.joint)[0] == pytest.approx(np.array(offsets), abs=0.1)
    for name, value in alike.joint.parameters.items():
        assert found.joint.parameters[name] == pytest.approx(value, rel=1e-3)
    assert "offset" not in estimates(found)
    assert "an offset of its own, from -2" in said(found)


def test_records_with_one_offset_are_left_as_they_are(tmp_path: Path) -> None:
    start = started(tmp_path, (7.0, 7.0, 7.0))
    assert with_own_offsets(start) is None
    assert said(start) == ""


def test_the_mean_force_of_a_motion_one_way_is_no_offset(tmp_path: Path) -> None:
    assert with_own_offsets(started(tmp_path, (0.0, 40.0), one_way=True)) is None


@pytest.mark.slow
def test_a_rubber_mount_loaded_from_zero_shows_slip(tmp_path: Path) -> None:
    """Springs that slip one after the other remember how the preload was put on, each record as its amplitude lets
    it."""
    springs, slips = np.array([4e5, 3e5, 2e5, 1e5]), np.array([6.0, 25.0, 90.0, 200.0])
    records = {}
    for amplitude in (2e-5, 5e-5, 1e-4, 3e-4, 8e-4):
        z, anchor = sweep(amplitude, 12.0), np.zeros(4)
        slipping = np.empty_like(z)
        for i, x in enumerate(z):
            pull = np.clip(springs * (x - anchor), -slips, slips)
            anchor, slipping[i] = x - pull / springs, pull.sum()
        noise = np.random.default_rng(round(1e6 * amplitude)).standard_normal(len(z))
        records[f"{amplitude:g}"] = z, 4e5 * z + 300 * np.gradient(z, 1 / RATE) + slipping + 0.3 * noise
    report = trace(measured(tmp_path, records), JOINT)
    assert report.verdict in (Verdict.PARTIAL, Verdict.IDENTIFIED, Verdict.AMBIGUOUS), report.sentence
    assert report.chosen is not None
    assert report.chosen.family == "hysteresis"
    assert "an offset of its own" in report.sentence
    assert report.error_after["in_sample"] < 0.3 * report.error_before["in_sample"]
