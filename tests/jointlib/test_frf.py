"""Receptances: named, labelled, and never interpolated in silence."""

from __future__ import annotations

import numpy as np
import pytest

from jointlib.errors import FrequencyMismatch, InputError
from jointlib.frf import FRF


def oscillator(frequency: np.ndarray) -> FRF:
    w = 2 * np.pi * frequency
    H = 1 / (1e7 - 2.0 * w**2 + 1j * w * 150)
    return FRF(frequency, H[:, None, None], ("tip.x",), ("tip.x",))


def test_interpolation_follows_the_inverse_receptance() -> None:
    """1/H of one mode is a parabola in ω: linear interpolation errs by its curvature, h²/8 · 2m(2π)²."""
    coarse, fine = oscillator(np.arange(200.0, 501.0, 2.0)), np.arange(300.25, 420.0, 0.5)
    error = 1 / coarse.on(fine).receptance - 1 / oscillator(fine).receptance
    assert np.max(np.abs(error)) <= 2.0**2 / 8 * 2 * 2.0 * (2 * np.pi) ** 2 * (1 + 1e-6)


def test_lines_outside_the_range_are_refused() -> None:
    with pytest.raises(FrequencyMismatch, match="asked for 100 to 300 Hz, have 200 to 500 Hz"):
        oscillator(np.arange(200.0, 501.0)).on([100.0, 300.0])


def test_an_unknown_degree_of_freedom_is_named() -> None:
    with pytest.raises(InputError, match=r"did you mean 'tip.x'\?"):
        oscillator(np.arange(200.0, 501.0)).between("tip.y", "tip.x")


def test_descending_lines_are_refused() -> None:
    with pytest.raises(InputError, match="ascending"):
        oscillator(np.array([3.0, 2.0]))
