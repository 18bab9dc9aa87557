"""Tops of a curve and by how much they stand out, against scipy."""

from __future__ import annotations

import numpy as np
import pytest
import scipy

from machines.compare.prominence import prominences, prominent


@pytest.mark.parametrize("seed", range(4))
def test_tops_are_those_of_scipy(seed: int) -> None:
    """Rounded values have level tops."""
    rng = np.random.default_rng(seed)
    values = np.round(np.cumsum(rng.normal(size=400)), 1 if seed % 2 else 9)
    tops, found = scipy.signal.find_peaks(values, prominence=0.7)
    assert prominent(values, 0.7).tolist() == tops.tolist()
    assert len(tops) > 10
    np.testing.assert_array_equal(prominences(values)[tops], found["prominences"])


def test_a_curve_that_only_rises_has_no_top() -> None:
    assert prominent(np.arange(5.0), 0.0).tolist() == []
    assert prominent(np.ones(5), 0.0).tolist() == []
