"""Joints held at the gains of the motions before: the same motions as by Newton's method, with and without means."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import count
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from test_static_bias import two_guides

from jointlib.arrays import Array
from machines import Machine, Newton, read_machine, response, run
from machines.deadline import OutOfTime, in_time, within
from machines.harmonic_balance import mean_motions, prescribed
from machines.harmonic_balance.secants import Held, by_secants
from machines.lobes import StabilityLobes
from machines.operating.operating_point import OperatingPoint, operating_point
from machines.road import piece

LIBRARY = Path(__file__).parents[2] / "machines" / "library"
LINES = np.linspace(150.0, 900.0, 160)


def _nothing(*given: object) -> Held:
    """No line settles, so that Newton's method has them all."""
    held = by_secants(*given)  # type: ignore[arg-type]
    return Held(held.q, held.gain, held.force, held.shift, np.zeros_like(held.settled))


def _counted(monkeypatch: pytest.MonkeyPatch, module: object) -> list[float]:
    shares = []

    def counting(*given: object) -> Held:
        held = by_secants(*given)  # type: ignore[arg-type]
        shares.append(float(np.mean(held.settled)))
        return held

    monkeypatch.setattr(module, "by_secants", counting)
    return shares


def _at(machine: Machine, amplitude: float) -> OperatingPoint:
    return operating_point(machine, LINES, amplitude)


@pytest.mark.parametrize("amplitude", [1e-8, 1e-7, 1e-6])
@pytest.mark.parametrize("stands", [True, False])
def test_an_amplitude_of_the_tool_gives_the_same_joints(
    amplitude: float, stands: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    machine = two_guides(900.0) if stands else replace(two_guides(900.0), static=None)
    shares = _counted(monkeypatch, prescribed)
    quick = _at(machine, amplitude)
    monkeypatch.setattr(prescribed, "by_secants", _nothing)
    slow = _at(machine, amplitude)
    assert shares[0] > 0.3
    assert quick.outcomes == slow.outcomes
    assert quick.gain == pytest.approx(slow.gain, rel=1e-9)
    assert quick.frf.receptance == pytest.approx(slow.frf.receptance, rel=1e-9)


@pytest.mark.parametrize("force", [20.0, 200.0])
def test_a_force_gives_the_same_motions_and_means(force: float, monkeypatch: pytest.MonkeyPatch) -> None:
    machine = two_guides(900.0)
    shares = _counted(monkeypatch, mean_motions)
    (quick,) = response(machine, force, LINES, method=Newton()).branches
    monkeypatch.setattr(mean_motions, "by_secants", _nothing)
    (slow,) = response(machine, force, LINES, method=Newton()).branches
    assert shares[0] > 0.3
    assert [b.stability for b in quick] == [b.stability for b in slow]
    for one, other in zip(quick, slow, strict=True):
        assert np.array_equal(one.frequency, other.frequency)
        assert one.joint == pytest.approx(other.joint, rel=1e-9, abs=1e-18)
        assert one.mean == pytest.approx(other.mean, rel=1e-8)


def test_time_that_is_up_ends_a_computation_and_the_outer_limit_stays() -> None:
    in_time()
    with within(-1.0), within(60.0), pytest.raises(OutOfTime, match="not done after"):
        response(read_machine(LIBRARY / "three_joints.toml"), 50.0, LINES, method=Newton())
    in_time()


def test_a_run_ends_with_a_report_where_a_part_takes_too_long(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(piece, "BUDGET", -1.0)
    made = run(LIBRARY / "three_joints.toml", tmp_path, steps=["coupling"])
    lost = {step["step"]: step["failed"] for step in made.data["steps"] if "failed" in step}
    assert "not done after" in lost["frf"]
    assert "Forced response: not computed" in (tmp_path / "report.html").read_text()


def test_no_chart_is_begun_after_one_as_long_that_was_not_done(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of two amplitudes the first runs out of time."""
    begun = list[float]()

    def timed(machine: Machine, speed: Array, amplitude: float) -> StabilityLobes:
        begun.append(amplitude)
        raise OutOfTime("not done after 10 minutes")

    monkeypatch.setattr("machines.cutting.forced.forced_vibration._MANY", 0)
    monkeypatch.setattr("machines.cutting.amplitude.frozen_lobes.lobes_at_amplitude", timed)
    made = run(LIBRARY / "lathe.toml", tmp_path, steps=["cutting"], amplitudes=[1e-5, 2e-5])
    lost = [step["failed"] for step in made.data["steps"] if "failed" in step]
    assert begun == [1e-5]
    assert lost[0] == "not done after 10 minutes"
    assert lost[1].startswith("not begun, as it takes as long as that at a tool-point amplitude of 10 um")


@pytest.mark.slow
def test_where_a_chart_takes_too_long_the_limit_at_the_recommended_speed_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A speed that takes 100 s by the clock, 100 of them; the limit is lowest 2 % above the speed recommended."""
    asked = list[float]()

    def limits(machine: Machine, speed: Sequence[float], amplitude: float) -> SimpleNamespace:
        asked.append(speed[0])
        return SimpleNamespace(minimum_depth=2e-4 / speed[0])

    monkeypatch.setattr("machines.cutting.forced.forced_vibration._MANY", 0)
    monkeypatch.setattr("machines.cutting.amplitude.frozen_lobes.lobes_at_amplitude", limits)
    monkeypatch.setattr("machines.road.cutting.time", SimpleNamespace(monotonic=count(0.0, 100.0).__next__))
    made = run(LIBRARY / "lathe.toml", tmp_path, steps=["cutting"], amplitudes=[0.0, 1e-5])
    (lost,) = [step["failed"] for step in made.data["steps"] if "failed" in step]
    speed, *ends = asked
    assert ends == [pytest.approx(0.98 * speed), pytest.approx(1.02 * speed)]
    holds = f"at {speed:.0f} rpm and 2 % off it the cut is stable below {0.2 / max(ends):.3g} mm, less than the depth"
    assert lost.startswith("100 speeds would take about 167 minutes, more than 5; ")
    assert holds in lost
    assert any(holds in said for said in made.doubts)
    assert f"Recommended: {speed:.0f} rpm" in made.finding()
