"""Sensors and converter of a rig: noise of constant strength and whole counts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointlib.arrays import Array


@dataclass(frozen=True)
class Converter:
    """Analogue-to-digital converter of ``bits`` whose range is ±``full_scale`` in the unit of the channel."""

    full_scale: float
    bits: int = 16

    @property
    def count(self) -> float:
        """Value of one count."""
        return self.full_scale / float(1 << (self.bits - 1))

    def counts(self, value: Array) -> NDArray[np.int32]:
        """Whole counts, clipped at the ends of the range."""
        top = 2 ** (self.bits - 1) - 1
        return np.clip(np.rint(value / self.count), -top - 1, top).astype(np.int32)


def noise_level(signal: Array, snr: float) -> float:
    """Standard deviation of a noise that lies ``snr`` dB below the root mean square of a signal."""
    return float(np.sqrt(np.mean(np.square(signal))) * np.power(10.0, -snr / 20))


def with_noise(
    rng: np.random.Generator, channels: Mapping[str, Array], sigma: Mapping[str, float], periods: int
) -> dict[str, Array]:
    """``periods`` repetitions of one period of each channel, each sample with its own white noise."""
    repeated = {name: np.tile(one, periods) for name, one in channels.items()}
    return {name: value + sigma[name] * rng.standard_normal(len(value)) for name, value in repeated.items()}
