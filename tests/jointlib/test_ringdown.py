"""Free decays: frequency and damping over amplitude, against integration in time; bad records."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from jointlib import read_measurement
from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.laws.cubic import Cubic
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from jointlib.measurement import Record, RecordSource
from jointlib.ringdown.hum import without_hum
from jointlib.ringdown.identify import identify_ringdown
from jointlib.ringdown.predicted import predict
from jointlib.ringdown.strokes import strokes

RATE, OMEGA, RATIO = 4000.0, 2 * np.pi * 80.0, 0.004
T = np.arange(6000) / RATE
LINEAR = 1e-3 * np.exp(-RATIO * OMEGA * T) * np.cos(OMEGA * np.sqrt(1 - RATIO**2) * T)


def written(folder: Path, x: Array, more: str = "", channel: str = "", rate: float = RATE) -> Path:
    np.savetxt(folder / "x.csv", x, header="x", comments="")
    file = folder / "x.measurement.toml"
    file.write_text(
        f'schema = "jointlib/measurement/1"\nkind = "ringdown"\nsample_rate = {rate}\n{more}\n'
        f'[[channel]]\nname = "x"\nquantity = "displacement"\nunit = "m"\n{channel}\n[[record]]\nfile = "x.csv"\n'
    )
    return file


def test_errors_of_a_linear_decay_hold_the_truth(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    found = identify_ringdown(read_measurement(written(tmp_path, LINEAR + 7e-7 * rng.standard_normal(len(T)))))
    (b,) = found.modes[0]
    off = np.array([(b.omega / (OMEGA * np.sqrt(1 - RATIO**2)) - 1) / (b.omega_error / b.omega)])
    ratio = (b.damping_ratio - RATIO) / b.ratio_error
    for deviations in (off, ratio):
        assert 0.4 < np.sqrt(np.mean(deviations**2)) < 1.6
    assert abs(b.checked[0]) < 1e-3


def test_the_decay_that_averaging_predicts_is_that_of_the_equation_of_motion() -> None:
    cubic = 0.2 * OMEGA**2 / 1e-6
    joint = Joint((Linear(OMEGA**2), Viscous(2 * RATIO * OMEGA), Cubic(cubic)))
    y = solve_ivp(
        lambda t, y: [y[1], -(OMEGA**2) * y[0] - 2 * RATIO * OMEGA * y[1] - cubic * y[0] ** 3],
        (0, 1), [1e-3, 0], "DOP853", rtol=1e-11, atol=1e-15, dense_output=True
    ).sol  # fmt: skip
    model = predict(joint, 1.0, 1e-5, 1e-3)
    for at in (0.2, 0.5):
        near = np.linspace(at - 0.007, at + 0.007, 4000)
        amplitude = float(model.decay(1e-3, np.array([near[int(np.argmax(y(near)[0]))]]))[0][0])
        # the crest of the motion holds a third harmonic of k3 A²/(32 k), below 0.7 % at the beginning
        assert float(np.max(y(near)[0])) == pytest.approx(amplitude, rel=0.01)


def test_two_modes_are_separated_and_told(tmp_path: Path) -> None:
    x = LINEAR + 2e-4 * np.exp(-0.004 * OMEGA * T) * np.cos(5.5 * OMEGA * T)
    x = x + 1e-8 * np.random.default_rng(1).standard_normal(len(T))
    found = identify_ringdown(read_measurement(written(tmp_path, x)))
    b = found.modes[0][0]
    assert np.median(b.damping_ratio) == pytest.approx(RATIO, rel=5e-3)
    first = 1e-3 * np.exp(-RATIO * OMEGA * b.time)
    np.testing.assert_allclose(b.amplitude[:5], first[:5], rtol=2e-3)
    assert any("transients" in said for said in found.messages)


def test_modes_a_seventh_apart_are_separated(tmp_path: Path) -> None:
    x = LINEAR + 4e-4 * np.exp(-RATIO * OMEGA * T) * np.cos(1.15 * OMEGA * T + 1)
    x = x + 1e-8 * np.random.default_rng(10).standard_normal(len(T))
    modes = identify_ringdown(read_measurement(written(tmp_path, x))).modes[0]
    assert len(modes) == 2
    for b, omega, ratio in zip(modes, (OMEGA, 1.15 * OMEGA), (RATIO, RATIO / 1.15), strict=True):
        assert np.median(b.omega) == pytest.approx(omega, rel=1e-4)
        assert np.median(b.damping_ratio) == pytest.approx(ratio, rel=0.02)


def with_play(share: float) -> Array:
    """A share of the stiffness takes load past 60 µm alone; c is 2·0.4 % of ω at large amplitudes and stays."""

    def motion(t: float, y: Array) -> list[float]:
        past = y[0] - np.clip(y[0], -6e-5, 6e-5)
        return [y[1], -(OMEGA**2) * ((1 - share) * y[0] + share * past) - 2 * RATIO * OMEGA * y[1]]

    run = solve_ivp(motion, (0, T[-1]), [1e-3, 0], "DOP853", t_eval=T, rtol=1e-8, atol=1e-13).y[0]
    return np.asarray(run + 1e-7 * np.random.default_rng(11).standard_normal(len(T)))


def test_a_mode_with_play_moves_by_a_fifth_and_is_one_mode(tmp_path: Path) -> None:
    (b,) = identify_ringdown(read_measurement(written(tmp_path, with_play(0.5)))).modes[0]
    assert b.omega[-1] < 0.8 * b.omega[0]
    np.testing.assert_allclose(b.damping, 2 * RATIO * OMEGA, rtol=0.1)


def test_a_mode_that_moves_keeps_its_damping_when_it_is_filtered(tmp_path: Path) -> None:
    """Beside the error of a filter's slope times the speed of the mode, which was a third."""
    other = 2e-4 * np.exp(-0.006 * OMEGA * T) * np.cos(2.6 * OMEGA * T)
    b, _ = identify_ringdown(read_measurement(written(tmp_path, with_play(0.2) + other))).modes[0]
    assert b.omega[-1] < 0.95 * b.omega[0]
    np.testing.assert_allclose(b.damping, 2 * RATIO * OMEGA, rtol=0.06)


@pytest.mark.parametrize(
    ("x", "said"),
    [
        (1e-3 * np.cos(OMEGA * T), "one amplitude tells nothing"),
        (1e-4 * np.exp(2 * T) * np.cos(OMEGA * T), "the motion grows"),
        (LINEAR[:300], "cycles of free motion"),
        (LINEAR[::12], "samples in a cycle"),
        (LINEAR + 0.5e-3 * np.exp(-RATIO * OMEGA * T) * np.cos(1.04 * OMEGA * T), "two modes beat"),
    ],
    ids=["steady", "growing", "few cycles", "sampled slowly", "two modes near"],
)
def test_records_that_are_no_decay_are_refused_in_a_sentence(tmp_path: Path, x: Array, said: str) -> None:
    rate = RATE / 12 if len(x) == 500 else RATE
    rng = np.random.default_rng(2)
    file = written(tmp_path, x + 1e-7 * rng.standard_normal(len(x)), rate=rate)
    with pytest.raises(InputError, match=said):
        identify_ringdown(read_measurement(file))


def test_a_clipped_beginning_is_left_out_and_said(tmp_path: Path) -> None:
    x = np.clip(LINEAR, -5e-4, 5e-4) + 1e-9 * np.random.default_rng(3).standard_normal(len(T))
    found = identify_ringdown(read_measurement(written(tmp_path, x, channel="range = 5e-4")))
    assert any("clipped until" in said for said in found.messages)
    assert np.median(found.modes[0][0].damping_ratio) == pytest.approx(RATIO, rel=0.01)


def test_a_decay_that_is_over_at_once_is_left_out_beside_longer_ones_and_said(tmp_path: Path) -> None:
    """Dry friction of 8 % of the spring takes 32 % of the first amplitude in every cycle."""
    rng, t = np.random.default_rng(6), np.arange(800) / RATE
    short = 1e-3 * np.maximum(1 - 0.32 * t * OMEGA / (2 * np.pi), 0) * np.cos(OMEGA * t)
    with pytest.raises(InputError, match="pieces of the motion at"):
        identify_ringdown(read_measurement(written(tmp_path, short + 1e-7 * rng.standard_normal(len(t)))))
    file = written(tmp_path, LINEAR + 1e-7 * rng.standard_normal(len(T)))
    np.savetxt(tmp_path / "short.csv", short + 1e-7 * rng.standard_normal(len(t)), header="x", comments="")
    file.write_text(file.read_text() + '[[record]]\nfile = "short.csv"\n')
    found = identify_ringdown(read_measurement(file))
    assert [len(modes) for modes in found.modes] == [1]
    assert any("short.csv" in said and "left out" in said for said in found.messages)


def test_hum_is_taken_out_and_is_no_mode(tmp_path: Path) -> None:
    hum = 3e-5 * np.sin(2 * np.pi * 50.02 * T + 1) + 1e-5 * np.sin(2 * np.pi * 150.06 * T)
    noise = 7e-7 * np.random.default_rng(7).standard_normal(len(T))
    found = identify_ringdown(read_measurement(written(tmp_path, LINEAR + hum + noise)))
    (b,) = found.modes[0]
    assert b.alone
    assert np.median(b.damping_ratio) == pytest.approx(RATIO, rel=3e-3)
    assert sum("hum of" in said for said in found.messages) == 2


def test_a_mode_at_the_frequency_of_the_mains_is_no_hum(tmp_path: Path) -> None:
    x = 1e-3 * np.exp(-0.002 * 2 * np.pi * 50 * T) * np.cos(2 * np.pi * 50 * T)
    x = x + 1e-7 * np.random.default_rng(8).standard_normal(len(T))
    found = identify_ringdown(read_measurement(written(tmp_path, x)))
    assert np.median(found.modes[0][0].damping_ratio) == pytest.approx(0.002, rel=3e-3)
    assert not any("hum" in said for said in found.messages)


@pytest.mark.parametrize("seconds", [1.0, 2.0, 4.0])
def test_a_mode_that_decays_as_slowly_as_hum_is_motion(seconds: float) -> None:
    t = np.arange(0, seconds, 1 / 2000)
    x = np.exp(-np.pi * 60.02 * t / 2200) * np.cos(2 * np.pi * 60.02 * t)
    left, _ = without_hum(x + 1e-4 * np.random.default_rng(1).standard_normal(len(t)), 2000.0)
    assert np.std(left - x) < 2e-4


def test_strokes_one_after_the_other_are_told_apart(tmp_path: Path) -> None:
    quiet = np.zeros(round(0.1 * RATE))
    x = np.concatenate([quiet, LINEAR, 0.5 * LINEAR[:5000], 0.8 * LINEAR])
    x = x + 1e-7 * np.random.default_rng(9).standard_normal(len(x))
    found = identify_ringdown(read_measurement(written(tmp_path, x)))
    assert len(found.modes) == 3
    for (b,), level in zip(found.modes, (1, 0.5, 0.8), strict=True):
        assert 0.8 * level < b.amplitude[0] / 1e-3 < level
        assert np.median(b.damping_ratio) == pytest.approx(RATIO, rel=3e-3)
    assert any("3 strokes one after the other" in said for said in found.messages)


@pytest.mark.parametrize("apart", [0.015, 0.03, 0.06, 0.15])
def test_modes_that_beat_are_no_strokes(tmp_path: Path, apart: float) -> None:
    x = LINEAR + np.exp(-RATIO * OMEGA * T) * 1e-3 * np.cos((1 + apart) * OMEGA * T + 3)
    record = Record(RecordSource(tmp_path / "x.csv", "fit"), {"x": x}, RATE, None, "")
    assert strokes(record, "x", None) == [record]


def test_a_fit_without_the_modal_mass_is_refused(tmp_path: Path) -> None:
    file = written(tmp_path, LINEAR + 1e-7 * np.random.default_rng(4).standard_normal(len(T)))
    with pytest.raises(InputError, match="modal_mass is missing"):
        identify_ringdown(read_measurement(file), laws=["linear", "viscous"])
