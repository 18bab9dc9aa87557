"""Import checks: what is wrong with records gets its sentence, and good records get none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from rig_samples import CHANNELS, PERIOD, RATE, measurement, noisy, record, shaken

from jointlib.errors import InputError
from jointlib.lab.importing.preamble import rates_above
from jointlib.lab.numerals import Numerals
from jointlib.lab.response_columns import quantity_of
from jointlib.loop.answer.import_checks import best_lag, check_period, flat_tops, without_dead_channels
from jointlib.loop.balance.spectra import spectra_of
from jointlib.measurement import Correction

Signal = NDArray[np.float64]
Channels = dict[str, Signal]
PERIODS = 4
MULTISINE, MODULATED = "multisine", "modulated sine"
LINES = {MULTISINE: np.arange(20, 81), MODULATED: np.array([47, 48, 49])}
"""Excited lines of 100 Hz: 2 to 8 kHz, and 4.8 kHz with its sidebands."""


def transfer(omega: Signal) -> dict[str, NDArray[np.complex128]]:
    """a1 and a2 per N of P of two masses on a spring and a damper, solved line by line."""
    m1, m2, D = 0.942, 2.2, 650e6 + 480j * omega
    determinant = (D - m1 * omega**2) * (D - m2 * omega**2) - D**2
    z1, z2 = (D - m2 * omega**2) / determinant, D / determinant
    return {"a1": -(omega**2) * z1, "a2": -(omega**2) * z2, "a3": -(omega**2) * z2, "P": np.ones(len(omega))}


def driven(kind: str, period: float = PERIOD, samples: int = PERIODS * PERIOD) -> Channels:
    """Channels of a linear rig that repeats after any number of samples, evaluated at the instants themselves."""
    lines = LINES[kind]
    F = np.exp(2j * np.pi * np.random.default_rng(3).random(len(lines)))
    if kind == MODULATED:
        F = np.array([0.4, 1.0, 0.4])
    turn = np.exp(2j * np.pi / period * np.outer(np.arange(samples), lines))
    return {c: np.real(turn @ (H * F)) for c, H in transfer(2 * np.pi * RATE / period * lines).items()}


def in_noise(channels: Channels, snr: float, seed: int = 1) -> Channels:
    rng = np.random.default_rng(seed)
    return {c: x + 10 ** (-snr / 20) * x.std() * rng.standard_normal(len(x)) for c, x in channels.items()}


def softening(kind: str, course: Callable[[Signal], Signal], periods: int = PERIODS) -> Channels:
    """The same rig with a spring that changes while it runs, k(t) = k·course(t in periods), by Runge and Kutta."""
    steps = 4
    P = np.tile(driven(kind, samples=PERIOD)["P"], periods + 3)
    fine = np.fft.irfft(np.fft.rfft(P), steps * len(P)) * steps
    h = 1 / (RATE * steps)
    k = 650e6 * course(np.arange(len(fine)) / (steps * PERIOD))
    mu = 1 / (1 / 0.942 + 1 / 2.2)
    z, v = 0.0, 0.0
    force = np.empty(len(fine))
    for i in range(0, len(fine), 2):
        n, e = min(i + 1, len(fine) - 1), min(i + 2, len(fine) - 1)
        force[i] = k[i] * z + 480 * v
        force[n] = force[i]
        drive = fine[i] / 0.942, fine[n] / 0.942, fine[e] / 0.942
        a1 = drive[0] - (k[i] * z + 480 * v) / mu
        v2, a2 = v + h * a1, drive[1] - (k[n] * (z + h * v) + 480 * (v + h * a1)) / mu
        v3, a3 = v + h * a2, drive[1] - (k[n] * (z + h * v2) + 480 * (v + h * a2)) / mu
        v4, a4 = v + 2 * h * a3, drive[2] - (k[e] * (z + 2 * h * v3) + 480 * (v + 2 * h * a3)) / mu
        z, v = z + h / 3 * (v + 2 * v2 + 2 * v3 + v4), v + h / 3 * (a1 + 2 * a2 + 2 * a3 + a4)
    f, P = force[::steps][3 * PERIOD :], P[3 * PERIOD :]
    return {"a1": (P - f) / 0.942, "a2": f / 2.2, "a3": f / 2.2, "P": P}


@pytest.mark.parametrize("kind", LINES)
@pytest.mark.parametrize("snr", [20.0, 30.0, 60.0, 300.0])
@pytest.mark.parametrize("periods", [2, 4, 7])
def test_a_whole_period_gets_no_word(kind: str, snr: float, periods: int) -> None:
    clean = driven(kind, samples=periods * PERIOD)
    for seed in range(5):
        assert check_period("r", in_noise(clean, snr, seed), PERIOD) is None
        assert check_period("r", in_noise({c: clean[c] for c in ("a1", "a2")}, snr, seed), PERIOD) is None


@pytest.mark.parametrize("kind", LINES)
@pytest.mark.parametrize(
    "course",
    [
        lambda t: 1 - 0.03 * t / PERIODS,
        lambda t: 1 - 0.05 * t / PERIODS,
        lambda t: 1 + 0.03 * np.sin(2 * np.pi * 0.37 * t),
        lambda t: 1 + 0.02 * np.sin(2 * np.pi * 7.3 * t),
    ],
    ids=["3 % drift", "5 % drift", "slow place", "fast place"],
)
def test_a_joint_that_changes_is_no_leakage(kind: str, course: Callable[[Signal], Signal]) -> None:
    channels = softening(kind, course)
    x = channels["a2"]
    moved = np.std(x[PERIOD:] - x[:-PERIOD]) / np.std(x)
    assert moved > 0.01  # it does change what is measured
    for snr in (30, 60):
        assert check_period("r", in_noise(channels, snr), PERIOD) is None
    # Without P nothing is refused; in a narrow band there may be a word.
    said = check_period("r", in_noise({c: channels[c] for c in ("a1", "a2")}, 30), PERIOD)
    assert said is None or (kind == MODULATED and "without P they look alike" in said)


@pytest.mark.parametrize("kind", LINES)
def test_hum_drift_clipping_and_run_in_are_no_leakage(kind: str) -> None:
    clean = driven(kind)
    t = np.arange(PERIODS * PERIOD) / RATE
    size = {c: x.std() for c, x in clean.items()}
    for faulty in (
        {**clean, "P": clean["P"] + 0.2 * size["P"] * np.cos(2 * np.pi * 50.3 * t)},
        {**clean, "a1": clean["a1"] + 0.2 * size["a1"] * t / t[-1]},
        {**clean, "a2": np.clip(clean["a2"], -1.5 * size["a2"], 1.5 * size["a2"])},
        {c: x * (1 + 0.3 * np.exp(-300 * t)) for c, x in clean.items()},
        {c: x * (1 + 0.05 * t / t[-1]) for c, x in clean.items()},
    ):
        assert check_period("r", in_noise(faulty, 40), PERIOD) is None


@pytest.mark.parametrize("kind", LINES)
@pytest.mark.parametrize("true", [PERIOD + 0.1, PERIOD - 0.25, PERIOD + 0.5, PERIOD + 1, PERIOD - 24, PERIOD + 100])
@pytest.mark.parametrize("snr", [30.0, 60.0])
def test_a_period_that_is_not_whole_is_refused_with_the_true_one(kind: str, true: float, snr: float) -> None:
    channels = in_noise(driven(kind, period=true), snr)
    with pytest.raises(InputError, match=r"the period of 1024 samples is not whole.* leaks between the lines") as said:
        check_period("r", channels, PERIOD)
    words = str(said.value).split()
    expected = float(words[words.index("expected") + 1].rstrip(";"))
    assert expected == pytest.approx(true, abs=0.02)


def test_a_small_leak_is_a_warning_with_its_size() -> None:
    said = check_period("r", in_noise(driven(MULTISINE, period=PERIOD + 0.01), 70), PERIOD)
    # A shift of 0.01 samples turns line l by 2π·l·0.01/N a period, n such turns leave 1/√12 of them between the lines.
    w = 2 * np.pi * LINES[MULTISINE] / PERIOD
    P = 0.01 * np.sqrt(np.mean(w**2)) * PERIODS / np.sqrt(12)
    assert said is not None
    assert f"{100 * P:.1f} % of the amplitude leaks" in said


@pytest.mark.parametrize("snr", [30.0, 60.0])
def test_without_the_force_a_narrow_band_leaves_two_readings(snr: float) -> None:
    channels = in_noise(driven(MODULATED, period=PERIOD + 0.5), snr)
    said = check_period("r", {c: channels[c] for c in ("a1", "a2")}, PERIOD)
    assert said is not None
    assert "in a narrow band and without P they look alike" in said


def test_a_multiple_of_the_period_is_whole_too() -> None:
    assert check_period("r", in_noise(driven(MULTISINE), 40), 2 * PERIOD) is None


def test_noise_is_no_periodic_record() -> None:
    rng = np.random.default_rng(5)
    channels = {c: rng.standard_normal(PERIODS * PERIOD) for c in ("a1", "a2", "P")}
    with pytest.raises(InputError, match="nothing repeats after 1024 samples"):
        check_period("r", channels, PERIOD)


def test_the_lag_of_a_sine_is_the_one_nearest_to_what_is_declared() -> None:
    x = np.sin(2 * np.pi * np.arange(4000) / 21.0)
    assert best_lag([x], 1000)[0] == pytest.approx(48 * 21)


def test_leakage_reaches_the_user_through_the_spectra() -> None:
    with pytest.raises(InputError, match=r"r1.npz: the period of 1024 samples is not whole"):
        spectra_of(record(driven(MULTISINE, period=PERIOD + 0.5), "r1.npz"), measurement())


@pytest.mark.thorough
def test_good_simulated_records_pass_without_a_word() -> None:
    for one in noisy(shaken(), 3, snr=30.0):
        assert spectra_of(one, measurement())[1] == ()


def test_flat_tops_are_found_without_knowing_the_range() -> None:
    x = in_noise(driven(MULTISINE), 50)["a1"]
    level = 0.7 * np.max(np.abs(x))
    found = flat_tops(np.clip(x, -level, level))
    assert found is not None
    assert found[0] == np.sum(np.abs(x) >= level)
    assert found[1] == pytest.approx(level)
    assert flat_tops(x) is None
    above = flat_tops(np.minimum(x, level))
    assert above is not None
    assert above[0] == np.sum(x >= level)


@pytest.mark.parametrize("counts", [60, 1000, 30000])
@pytest.mark.parametrize("kind", LINES)
def test_a_smooth_signal_in_whole_counts_has_no_flat_tops(kind: str, counts: int) -> None:
    for x in driven(kind).values():
        assert flat_tops(np.rint(counts * x / np.max(np.abs(x)))) is None


def test_clipped_samples_are_named_with_their_level() -> None:
    channels = in_noise(driven(MULTISINE), 60)
    level = 0.7 * np.max(np.abs(channels["a2"]))
    cut = record({**channels, "a2": np.clip(channels["a2"], -level, level)}, "r1.npz")
    (said,) = spectra_of(cut, measurement())[1]
    count = int(np.sum(np.abs(channels["a2"]) >= level))
    assert said.startswith(f"r1.npz: {count} samples of a2 stand at its largest value {level:.4g} m/s^2")
    known = measurement(channels=tuple(replace(c, full_scale=level) if c.name == "a2" else c for c in CHANNELS))
    (said,) = spectra_of(cut, known)[1]
    assert f"{count} samples of a2 stand at full scale" in said


@pytest.mark.parametrize("dead", ["a3", "P"])
def test_a_dead_channel_is_left_out_of_every_record(dead: str) -> None:
    good = in_noise(driven(MULTISINE), 60)
    records = [record(good, "r0.npz"), record({**good, dead: np.full(len(good["P"]), 0.25)}, "r1.npz")]
    m = measurement(corrections=(Correction("offset", dead, None, {"offset": 0.1}),))
    left, (said,) = without_dead_channels(m, records)
    assert said.startswith(f"r1.npz: channel {dead} is constant while others move")
    assert dead not in [c.name for c in left.channels]
    assert not left.corrections
    for one in records:
        spectra, _ = spectra_of(one, left)
        assert set(spectra.channels) == {"a1", "a2", "a3", "P"} - {dead}


@pytest.mark.parametrize("dead", ["a1", "a2"])
def test_a_rig_without_an_acceleration_beside_the_joint_is_refused(dead: str) -> None:
    good = in_noise(driven(MULTISINE), 60)
    silent = record({**good, dead: np.zeros(len(good["P"]))}, "r1.npz")
    with pytest.raises(InputError, match=f"r1.npz: channel {dead} is constant while others move; it is dead"):
        without_dead_channels(measurement(), [silent])


def test_a_quiet_record_may_be_silent() -> None:
    good = in_noise(driven(MULTISINE), 60)
    quiet = record({**good, "P": np.zeros(len(good["P"]))}, "q.npz")
    quiet = replace(quiet, source=replace(quiet.source, role="quiet", file=Path("q.npz")))
    assert without_dead_channels(measurement(), [record(good), quiet]) == (measurement(), ())


@pytest.mark.parametrize(
    ("line", "rate"),
    [
        ("Abtastrate;1 000 Hz;;", 1000.0),
        ("Sample rate: 51 200", 51200.0),
        ("Sample rate: 1'000'000 Hz", 1e6),
        ("Abtastrate;12\u202f800 Hz", 12800.0),
        ("Sample rate 2.5 kHz", 2500.0),
        ("Abtastrate: 5.000,0 Hz", 5000.0),
        ("Sample rate: 100 Hz 2026", 100.0),
    ],
)
def test_a_rate_above_may_have_marks_between_its_thousands(line: str, rate: float) -> None:
    numerals = Numerals("," if "," in line else ".")
    assert [found for found, _ in rates_above([line], numerals)] == [rate]


@pytest.mark.parametrize(
    ("unit", "quantity"),
    [("um/N", "receptance"), ("µm/N", "receptance"), ("mm/s/N", "mobility"), ("g/N", "accelerance"), ("N", None)],
)
def test_a_unit_of_motion_over_force_tells_what_a_response_is(unit: str, quantity: str | None) -> None:
    found = quantity_of(unit)
    assert (None if found is None else found[1].word) == quantity
