"""Noise floor from the band above the motion, where force and displacement hold nothing but their noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy

from jointlib.arrays import Array
from jointlib.loop.path.preparation import Preparation, displacement_channel, force_channel
from jointlib.loop.path.repeats import PathFloor
from jointlib.loop.path.strokes import Division
from jointlib.measurement import Measurement, Record

_ABOVE = 1.1
"""The empty band begins at this multiple of the cutoff frequency."""
_EMPTY = 1e-3
"""Largest ratio of the density in either half of it to the median density within the band."""
_FEWEST_LINES = 20


def band_floor(
    measurement: Measurement, records: Sequence[Record], preparation: Preparation, division: Division
) -> PathFloor | None:
    """S_F + S_z·|F/z|² summed over the band, N² per block; None where a record has no empty band.

    S_F and S_z are the noise densities of force and displacement, the medians above the band, taken to be the same
    within it. |F/z|², which carries the noise of the displacement into the force, is the ratio of the densities
    themselves.
    """
    power = []
    for record in records:
        F = _density(record.channels[force_channel(measurement)], preparation)
        z = _density(record.channels[displacement_channel(measurement)], preparation)
        noise_F, noise_z = _noise(*F, preparation.cutoff), _noise(*z, preparation.cutoff)
        if noise_F is None or noise_z is None:
            return None
        inside = (F[0] > 0) & (F[0] <= preparation.cutoff)
        gain = F[1][inside] / np.maximum(z[1][inside] - noise_z, noise_z)
        power.append(float(np.sum(noise_F + noise_z * gain) * (F[0][1] - F[0][0])))
    blocks = np.array([power[b.run] for b in division.blocks])
    return PathFloor(blocks, "band", np.arange(len(blocks)))


def with_band_floor(
    floor: PathFloor, measurement: Measurement, records: Sequence[Record], preparation: Preparation, division: Division
) -> PathFloor:
    """The floor from repetitions; where nothing repeats, that from the empty band if there is one."""
    found = None if floor.known else band_floor(measurement, records, preparation, division)
    return floor if found is None else replace(found, block_folds=floor.block_folds)


def _density(x: Array, preparation: Preparation) -> tuple[Array, Array]:
    length = min(1024, 2 ** int(np.log2(len(x) / 4)))
    f, S = scipy.signal.welch(scipy.signal.detrend(x), preparation.sample_rate, nperseg=length)
    return np.asarray(f), np.asarray(S)


def _noise(f: Array, S: Array, cutoff: float) -> float | None:
    """Density of the noise; None where the band above the cutoff is not empty."""
    above = S[(f > _ABOVE * cutoff) & (f < f[-1])]
    if len(above) < _FEWEST_LINES:
        return None
    half = len(above) // 2
    highest = max(np.median(above[:half]), np.median(above[half:]))
    empty = highest < _EMPTY * np.median(S[(f > 0) & (f < cutoff)])
    return float(np.median(above)) if empty else None
