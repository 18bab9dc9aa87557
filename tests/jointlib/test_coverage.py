"""The stated errors of frequency responses hold: 95 of 100 lines lie within their bound.

Lines of one record share errors (noise of a windowed force is one number for a hundred lines), so what is counted is
the share of lines within the bound in each record; records are independent, and the scatter of their shares gives the
tolerance of the mean.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
import pytest
from repeats import repeats
from struck import Structure, declared, pulses, sampled, write_record

from jointlib import read_measurement
from jointlib.estimation.estimate import estimate
from jointlib.estimation.noise import lines_alike, noise_of, shared
from jointlib.estimation.result import EstimatedFRF

RATE = 2048.0
PART = Structure(
    np.array([95.0, 210.0, 420.0]), np.array([0.03, 0.02, 0.015]), np.array([[1.0, 0.8, 0.6], [0.5, -0.9, 0.7]])
)
LIGHT = Structure(PART.frequency, np.array([0.006, 0.004, 0.004]), PART.shapes)
ZONES = {"low": (10, 80), "mode 1": (80, 110), "mode 2": (190, 230), "between": (230, 400), "mode 3": (400, 440)}
ALLOWED = 0.01
"""By how much the share may be off 95 % beyond what counting explains."""


def within(frfs: Iterable[EstimatedFRF], part: Structure, band: tuple[float, float] = (0, 1e9)) -> float:
    """Share of lines whose error is within its bound."""
    inside = []
    for frf in frfs:
        assert frf.radius is not None
        true = part.receptance(frf.frequency, int(frf.response[-1]), int(frf.drive[-1]))
        at = (frf.frequency >= band[0]) & (frf.frequency <= band[1])
        inside.append((np.abs(frf.value - true * frf.quantity.per_receptance(frf.frequency)) < frf.radius)[at])
    return float(np.mean(np.concatenate(inside)))


def holds(shares: list[float], low: float = ALLOWED, high: float = ALLOWED) -> None:
    """95 % within what is allowed and three and a half standard errors of the mean."""
    counted = 3.5 * float(np.std(shares, ddof=1)) / np.sqrt(len(shares))
    assert 0.95 - low - counted < np.mean(shares) < 0.95 + high + counted, (np.mean(shares), counted)


def declared_with(kind: str, records: list[str], settings: str, head: str = "") -> str:
    text = declared(kind, RATE, records, 2, f"[estimate]\n{settings}\n")
    return text.replace("sample_rate", f"{head}\nsample_rate")


def hits(
    folder: Path,
    count: int,
    runs: int,
    settings: str = "length = 0.9",
    noise: tuple[float, float] = (0.3, 0.05),
    part: Structure = PART,
    spacing: float = 1.0,
) -> Iterator[tuple[EstimatedFRF, ...]]:
    """Responses from records of hits at place 0, whose noise in N and m/s² is another in every run."""
    for run in range(runs):
        if run % 20 == 0:
            rng = np.random.default_rng(run)
            at = [0.05 + spacing * k + rng.uniform(0, 0.02) for k in range(count)]
            force = pulses(round((spacing * count + 0.1) * RATE), RATE, at, list(rng.uniform(240, 360, count)), 3e-3)
            F, x = sampled(part, force, RATE, 0)
        rng = np.random.default_rng(10_000 + run)
        write_record(folder / "h.npz", F + rng.normal(0, noise[0], F.shape), x + rng.normal(0, noise[1], x.shape))
        (folder / "m.toml").write_text(declared_with("impact", ["h.npz"], settings, "band = [10, 500]"))
        yield estimate(read_measurement(folder / "m.toml")).frfs


@pytest.mark.thorough
def test_the_bound_holds_on_95_percent_of_the_lines(tmp_path: Path) -> None:
    holds([within(frfs, PART) for frfs in hits(tmp_path, 5, 40)])


@pytest.mark.slow
@pytest.mark.parametrize("count", [2, 3, 5, 10, 30])
def test_it_holds_for_few_hits_and_many(tmp_path: Path, count: int) -> None:
    holds([within(frfs, PART) for frfs in hits(tmp_path, count, 200 if count < 10 else 60)])


@pytest.mark.slow
@pytest.mark.parametrize("noise", [(0.001, 0.05), (1.0, 0.001)])
def test_it_holds_whichever_sensor_is_noisy(tmp_path: Path, noise: tuple[float, float]) -> None:
    holds([within(frfs, PART) for frfs in hits(tmp_path, 4, 200, noise=noise)])


@pytest.mark.slow
@pytest.mark.parametrize("zone", repeats(ZONES, lambda _: False, lambda zone: zone == "low"))
def test_it_holds_at_the_modes_and_between_them(tmp_path: Path, zone: str) -> None:
    """At one place of the band the errors of a record are nearly one number, so here counting leaves more open."""
    holds([within(frfs, PART, ZONES[zone]) for frfs in hits(tmp_path, 6, 250)], low=0.015, high=0.015)


@pytest.mark.slow
@pytest.mark.parametrize("settings", ["force_window = false", 'estimator = "H2"', 'estimator = "Hv"'])
def test_it_holds_for_every_estimator_and_without_a_window(tmp_path: Path, settings: str) -> None:
    holds([within(frfs, PART) for frfs in hits(tmp_path, 6, 150, f"length = 0.9\n{settings}")])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("settings", "part", "spacing"),
    [
        ("length = 0.9\nexponential = 0.3", PART, 1.0),
        ("length = 0.5\nexponential = 0.2", LIGHT, 4.0),
        ("length = 0.5", LIGHT, 4.0),
    ],
)
def test_it_holds_where_a_window_or_the_end_of_the_block_is_taken_off(
    tmp_path: Path, settings: str, part: Structure, spacing: float
) -> None:
    """Modes are fitted with more doubt than noise gives, so that up to 3 % more of the lines may lie within."""
    holds([within(frfs, part) for frfs in hits(tmp_path, 5, 20, settings, part=part, spacing=spacing)], high=0.035)


def shaken(folder: Path, forces: list[np.ndarray], runs: int, settings: str, head: str) -> Iterator[tuple]:
    """Responses from records of a shaker at place 0, 2 % noise on either side, another in every run."""
    clean = [sampled(PART, force, RATE, 0) for force in forces]
    names = [f"r{k}.npz" for k in range(len(forces))]
    for run in range(runs):
        rng = np.random.default_rng(run)
        for name, (F, x) in zip(names, clean, strict=True):
            noisy = (one + rng.normal(0, 0.02 * np.std(one), one.shape) for one in (F, x))
            write_record(folder / name, *noisy)
        (folder / "m.toml").write_text(declared_with("shaker", names, settings, head))
        yield estimate(read_measurement(folder / "m.toml")).frfs


def random_force(samples: int, seed: int) -> np.ndarray:
    """Gaussian force between 20 and 500 Hz on the fine grid."""
    rng = np.random.default_rng(seed)
    f = np.fft.rfftfreq(samples * 8, 1 / (RATE * 8))
    spectrum = np.where((f > 20) & (f < 500), rng.normal(size=len(f)) + 1j * rng.normal(size=len(f)), 0)
    x = np.fft.irfft(spectrum, samples * 8)
    return 10 * x / np.std(x)


@pytest.mark.slow
@pytest.mark.parametrize("length", [1.0, 2.0])
def test_it_holds_for_random_forces(tmp_path: Path, length: float) -> None:
    """Leakage is a part of the error that a record repeats, so every record has a force of its own."""
    head = "band = [30, 450]"
    shares = []
    for seed in range(20):
        force = random_force(round(32768 * length), seed)
        shares += [within(f, PART) for f in shaken(tmp_path, [force], 1, f"length = {length}", head)]
    holds(shares)


@pytest.mark.thorough
@pytest.mark.parametrize(("records", "periods"), [(1, 6), (2, 3)])
def test_it_holds_for_multisines(tmp_path: Path, records: int, periods: int) -> None:
    period, lines = 2048, np.arange(25, 480, 2)
    forces = []
    for seed in range(records):
        spectrum = np.zeros(period * 4 + 1, dtype=complex)
        spectrum[lines] = np.exp(2j * np.pi * np.random.default_rng(seed).uniform(size=len(lines)))
        one = np.fft.irfft(spectrum, period * 8)
        forces.append(np.tile(10 * one / np.std(one), periods))
    runs = shaken(tmp_path, forces, 60, 'signal = "multisine"', "period = 2048\nsettle = 1")
    holds([within(frfs, PART) for frfs in runs])


@pytest.mark.slow
@pytest.mark.parametrize("records", [2, 4])
def test_it_holds_for_chirps(tmp_path: Path, records: int) -> None:
    t = np.arange(6 * int(RATE) * 8) / (RATE * 8)
    chirp = np.where(t < 4, np.sin(2 * np.pi * (20 * t + (450 - 20) / 8 * t**2)), 0) * np.clip((4 - t) / 0.2, 0, 1)
    runs = shaken(tmp_path, [10 * chirp] * records, 40, 'signal = "chirp"', "band = [30, 400]")
    holds([within(frfs, PART) for frfs in runs], high=0.015)


@pytest.mark.slow
def test_it_holds_for_stepped_sines(tmp_path: Path) -> None:
    t = np.arange(int(RATE) * 16) / (RATE * 8)
    force = np.concatenate([10 * np.sin(2 * np.pi * f * t) for f in (60, 85, 92, 95, 98, 120, 150, 208, 212, 300, 420)])
    runs = shaken(tmp_path, [force], 60, 'signal = "stepped-sine"', "")
    holds([within(frfs, PART) for frfs in runs])


def test_lines_under_a_window_err_together_as_its_square_says() -> None:
    """Of noise under a window the correlation is taken from 4000 repetitions."""
    window = np.exp(-np.arange(256) / 60)
    noise = np.fft.rfft(np.random.default_rng(0).normal(size=(4000, 256)) * window, axis=1)[:, 20:60]
    power = np.mean(np.abs(noise) ** 2)
    for apart in (1, 2, 5):
        seen = np.abs(np.mean(noise[:, apart:] * noise[:, :-apart].conj())) ** 2 / power**2
        assert shared(window)[apart] == pytest.approx(seen, abs=0.02)
    assert lines_alike(shared(np.hanning(256))[:3]) == pytest.approx(1 + 2 * (4 / 9 + 1 / 36), rel=0.01)


@pytest.mark.thorough
def test_the_scatter_of_the_noise_that_is_found_is_that_of_its_stated_freedom() -> None:
    """Two averages; noise of a force of which 40 lines share each error, over a resonance."""
    f = np.arange(600.0)
    gain = 1 / ((1 - (f / 300) ** 2) ** 2 + (0.06 * f / 300) ** 2)
    window = np.zeros(1200)
    window[:30] = 1.0
    rng = np.random.default_rng(3)
    found = []
    for _ in range(400):
        short = np.fft.rfft(rng.normal(size=1200) * window)[:600]
        long = np.fft.rfft(rng.normal(size=1200))[:600]
        residual = np.abs(np.sqrt(gain) * short / np.sqrt(30) + np.sqrt(20 / 1200) * long) ** 2
        found.append(noise_of(residual, gain, 1.0, force=shared(window)[:120]))
    power = np.array([one.power for one in found])
    stated = np.median([one.freedom for one in found], axis=0)
    for at in (100, 290, 300, 330, 450):
        assert np.mean(power[:, at]) == pytest.approx(gain[at] + 20, rel=0.15)
        seen = np.mean(power[:, at]) ** 2 / np.var(power[:, at])
        assert 0.5 < stated[at] / seen < 2.0
