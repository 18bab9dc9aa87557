"""From simulated hits on a tool to its modes: those that made the records, and no others."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from repeats import repeats
from struck import Structure, declared, pulses, sampled, write_record

from jointlib import estimate, fit_modes, read_measurement
from jointlib.estimation.frf_measurement import write_frfs
from jointlib.modal_fit.responses import Responses
from jointlib.rig.tap_test import MODES, counts_of, write_tap_test
from machines.measured_modes.measured_responses import read_responses

CASES = [(seed, window) for seed in range(5) for window in ("", 'exponential = "0.08 s"\n')]


@pytest.mark.thorough
@pytest.mark.parametrize(("seed", "window"), repeats(CASES, lambda case: case == CASES[7], lambda case: case[0] == 2))
def test_the_modes_are_found_within_their_errors_and_no_others(tmp_path: Path, seed: int, window: str) -> None:
    write_tap_test(tmp_path)
    np.savez(tmp_path / "hits.npz", **counts_of(seed))
    file = tmp_path / "hits.measurement.toml"
    file.write_text(file.read_text("utf-8") + window, "utf-8")
    (frf,) = estimate(read_measurement(file)).frfs
    assert frf.deviation_together is not None
    found = fit_modes(Responses(frf.frequency, frf.receptance[None], frf.deviation_together[None], ((0, 0),), ("x",)))
    frequency, ratio, _ = np.array(MODES).T
    assert len(found.frequency) == len(MODES)
    assert np.all(np.abs(found.frequency - frequency) < 3 * found.frequency_error)
    assert np.all(np.abs(found.damping_ratio - ratio) < 3 * found.damping_ratio_error)
    assert found.is_proportional


RATE = 12800.0


def tapped(folder: Path, seeds: range, window: str) -> list[np.ndarray]:
    """Frequencies of the modes of hits by another generator, without a band, through the files that are written."""
    frequency, ratio, mass = np.array(MODES).T
    part = Structure(frequency, ratio, (1 / np.sqrt(mass))[None])
    rng = np.random.default_rng(1)
    at = [0.05 + 0.55 * k + rng.uniform(0, 0.01) for k in range(6)]
    force = pulses(round(3.4 * RATE), RATE, at, [610.0, 540.0, 580.0, 500.0, 575.0, 620.0], 0.6e-3)
    F, x = sampled(part, force, RATE, 0)
    found = []
    for seed in seeds:
        rng = np.random.default_rng(100 + seed)
        write_record(folder / "h.npz", F + rng.normal(0, 0.4, F.shape), x + rng.normal(0, 1.0, x.shape))
        (folder / "m.toml").write_text(declared("impact", RATE, ["h.npz"], 1, f"[estimate]\nlength = 0.4\n{window}"))
        test = read_measurement(folder / "m.toml")
        write_frfs(folder / "tip.measurement.toml", estimate(test), test)
        found.append(fit_modes(read_responses([folder / "tip.measurement.toml"])).frequency)
    return found


@pytest.mark.slow
def test_noise_that_many_lines_share_is_no_mode(tmp_path: Path) -> None:
    """Taken as the errors of single lines, those of these two hits looked like a fourth mode at 2.04 and 2.65 kHz."""
    for seed, window in ((13, "exponential = 0.08"), (9, "")):
        (found,) = tapped(tmp_path, range(seed, seed + 1), window)
        np.testing.assert_allclose(found, np.array(MODES)[:, 0], rtol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("window", ["", "exponential = 0.08"])
def test_taps_without_a_band_have_their_modes_and_no_others(tmp_path: Path, window: str) -> None:
    for found in tapped(tmp_path, range(100, 130), window):
        np.testing.assert_allclose(found, np.array(MODES)[:, 0], rtol=1e-3)
