"""From simulated hits on a tool to its modes: those that made the records, and no others."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from repeats import repeats

from jointlib import estimate, fit_modes, read_measurement
from jointlib.modal_fit.responses import Responses
from jointlib.rig.tap_test import MODES, counts_of, write_tap_test

CASES = [(seed, window) for seed in range(5) for window in ("", 'exponential = "0.08 s"\n')]


@pytest.mark.parametrize(("seed", "window"), repeats(CASES, lambda case: case == (3, 'exponential = "0.08 s"\n')))
def test_the_modes_are_found_within_their_errors_and_no_others(tmp_path: Path, seed: int, window: str) -> None:
    write_tap_test(tmp_path)
    np.savez(tmp_path / "hits.npz", **counts_of(seed))
    file = tmp_path / "hits.measurement.toml"
    file.write_text(file.read_text("utf-8") + window, "utf-8")
    (frf,) = estimate(read_measurement(file)).frfs
    assert frf.deviation is not None
    found = fit_modes(Responses(frf.frequency, frf.receptance[None], frf.deviation[None], ((0, 0),), ("x",)))
    frequency, ratio, _ = np.array(MODES).T
    assert len(found.frequency) == len(MODES)
    assert np.all(np.abs(found.frequency - frequency) < 3 * found.frequency_error)
    assert np.all(np.abs(found.damping_ratio - ratio) < 3 * found.damping_ratio_error)
    assert found.is_proportional
