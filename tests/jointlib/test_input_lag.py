"""A damper that follows its voltage late, told from a force that is recorded late."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import cont2discrete, lfilter

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.io.joint_file import read_joint, write_joint
from jointlib.joint import Joint
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from jointlib.loop.answer.report import Verdict
from jointlib.loop.trace import trace
from jointlib.measurement import Channel, Measurement, RecordSource
from jointlib.modulation import Modulation, lagged
from jointlib.parameter import Role

RATE, LATE, FINE = 250.0, 0.01, 4
SPRUNG = Joint((Linear(1000.0), Viscous(100.0)), "damper")


def sines(rng: np.random.Generator, t: Array, low: float, high: float) -> tuple[Array, Array]:
    """A sum of sines of rms 1 and its derivative."""
    omega, phase = 2 * np.pi * rng.uniform(low, high, 40), rng.uniform(0, 2 * np.pi, 40)
    angle, size = np.outer(t, omega) + phase, np.sqrt(2 / 40)
    return size * np.cos(angle).sum(axis=1), -size * np.sin(angle) @ omega


def damper(folder: Path, input_lag: float, late: float) -> Measurement:
    """Two levels of random motion under a random voltage; a yield force of 50 N and 150 N/V turns over with speed."""
    sources = []
    for level in (0.7, 1.0):
        rng = np.random.default_rng(int(10 * level))
        t = np.arange(FINE * 2500) / (FINE * RATE)
        z, v = (0.006 * level * x for x in sines(rng, t, 0.5, 4.0))
        u = np.clip(1.5 + 0.8 * sines(rng, t, 0.3, 8.0)[0], 0.0, 3.0)
        felt = u
        if input_lag:
            b, a, _ = cont2discrete(([1.0], [input_lag, 1.0]), t[1], method="foh")
            felt = u[0] + lfilter(np.ravel(b), a, u - u[0])
        force = 1500 * z + 250 * v + (50 + 150 * felt) * v / np.hypot(v, 0.02)
        force = np.interp(t - late, t, force)[::FINE]
        force += 0.005 * force.std() * rng.standard_normal(len(force))
        file = folder / f"{level}.npz"
        np.savez(file, allow_pickle=False, z=z[::FINE], F=force, u=u[::FINE])
        sources.append(RecordSource(file, "fit", condition=f"level {level}"))
    channels = (
        Channel("z", "displacement", "m", "m", 1.0),
        Channel("F", "force", "N", "N", 1.0),
        Channel("u", "voltage", "V", "V", 1.0, is_input=True),
    )
    return Measurement(folder / "m.toml", "path", channels, tuple(sources), sample_rate=RATE)


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
