"""A damper that follows its voltage late, told from a force that is recorded late."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from late_damper import LATE, RATE, SPRUNG, damper, stepped_damper

from jointlib.errors import InputError
from jointlib.io.joint_file import read_joint, write_joint
from jointlib.joint import Joint
from jointlib.laws.coulomb import Coulomb
from jointlib.loop.answer.report import Verdict
from jointlib.loop.trace import trace
from jointlib.modulation import Modulation, lagged
from jointlib.parameter import Role


@pytest.mark.slow
def test_a_damper_that_follows_its_voltage_late_is_no_late_force(tmp_path: Path) -> None:
    report = trace(damper(tmp_path, LATE, 0.0), SPRUNG)
    assert [c["family"] for c in report.composition][-1] == "input-lag", report.sentence
    assert report.verdict in (Verdict.IDENTIFIED, Verdict.AMBIGUOUS)
    (modulation,) = report.mended.modulations
    assert modulation.lag == pytest.approx(LATE, rel=0.05)
    assert not report.corrections
    assert "lag" not in {r.family for r in report.rivals}
    write_joint(tmp_path / "mended.joint.toml", report.mended)
    assert read_joint(tmp_path / "mended.joint.toml").modulations == report.mended.modulations


@pytest.mark.slow
def test_a_force_that_comes_late_is_no_lag_of_the_voltage(tmp_path: Path) -> None:
    report = trace(damper(tmp_path, 0.0, LATE), SPRUNG)
    assert [c["family"] for c in report.composition][-1] == "lag", report.sentence
    (correction,) = report.corrections
    assert correction.parameters["lag"] == pytest.approx(LATE, rel=0.03)
    assert not any(m.lag for m in report.mended.modulations)
    # No mass moves with these paths: the joint itself may build its force up so slowly.
    assert "builds up its force so slowly" in report.sentence


@pytest.mark.slow
def test_a_damper_that_follows_at_once_has_no_lag(tmp_path: Path) -> None:
    report = trace(damper(tmp_path, 0.0, 0.0), SPRUNG)
    assert [c["family"] for c in report.composition] == ["coulomb", "modulation"], report.sentence


@pytest.mark.slow
@pytest.mark.parametrize("late", [0.02, 0.0])
def test_a_lag_behind_steps_of_the_voltage_shows_where_they_are(tmp_path: Path, late: float) -> None:
    """A lag acts after each step alone, and the rounding of the friction, which is no law's, leaves more than it."""
    report = trace(stepped_damper(tmp_path, late), SPRUNG)
    families = [c["family"] for c in report.composition]
    assert families[:2] == ["coulomb", "modulation"], report.sentence
    assert ("input-lag" in families) == (late > 0), report.sentence
    for m in report.mended.modulations:
        assert m.lag == pytest.approx(late, rel=0.3)


def test_a_lag_of_the_first_order_is_that_of_closed_forms() -> None:
    t, lag = np.arange(400) / RATE, 0.05
    ramp = lagged(3.0 + 2.0 * t, lag, 1 / RATE)
    assert ramp == pytest.approx(3.0 + 2.0 * (t - lag * (1 - np.exp(-t / lag))), rel=1e-12)
    assert np.array_equal(lagged(ramp, 0.0, 1 / RATE), ramp)


def test_a_lag_below_zero_is_refused() -> None:
    with pytest.raises(InputError, match=r"lag is -0\.01, expected at least 0"):
        Modulation(Role.DAMPING, "voltage", 0.0, ((0.0, 1.0), (1.0, 2.0)), lag=-0.01)


def test_a_lag_is_shared_by_all_that_follow_one_input() -> None:
    rising = ((0.0, 1.0), (1.0, 2.0))
    by = tuple(Modulation(Role.SLIP_FORCE, c, 0.0, rising) for c in ("voltage", "temperature"))
    late = Joint((Coulomb(10.0),), modulations=by).lagging("voltage", 0.01)
    assert [m.lag for m in late.modulations] == [0.01, 0.0]
    assert late.at({"voltage": 1.0, "temperature": 0.0}).parameters["coulomb.slip_force"] == 20.0
