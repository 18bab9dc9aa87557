"""Noise floor from the band above the motion, where force and displacement hold nothing but their noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray
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
    """S_F + S_z·|H|² summed over the band, N² per block; None where a record has no empty band.

    S_F and S_z are the noise densities of force and displacement, the medians above the band, taken to be the same
    within it. H, which carries the noise of the displacement into the force, is that of the spring, damper and mass
    nearest to the force within the band: what friction makes at other frequencies is no answer to the motion there.
    """
    power = []
    for record in records:
        force, motion = record.channels[force_channel(measurement)], record.channels[displacement_channel(measurement)]
        rate, length = record.sample_rate, 1024 * preparation.thinning
        f, own = _density(force, force, rate, length)
        _, travel = _density(motion, motion, rate, length)
        _, shared = _density(motion, force, rate, length)
        noise_F, noise_z = (_noise(f, S.real, preparation) for S in (own, travel))
        if noise_F is None or noise_z is None:
            return None
        inside = (f > 0) & (f <= preparation.cutoff)
        gain = np.abs(_linear_part(f[inside], travel[inside].real, shared[inside])) ** 2
        power.append(float(np.sum(noise_F + noise_z * gain) * (f[1] - f[0])))
    blocks = np.array([power[b.run] for b in division.blocks])
    return PathFloor(blocks, "band", np.arange(len(blocks)))


def with_band_floor(
    floor: PathFloor, measurement: Measurement, records: Sequence[Record], preparation: Preparation, division: Division
) -> PathFloor:
    """The floor from repetitions; where nothing repeats, that from the empty band if there is one."""
    found = None if floor.known else band_floor(measurement, records, preparation, division)
    return floor if found is None else replace(found, block_folds=floor.block_folds)


def _linear_part(f: Array, S_z: Array, S_zF: ComplexArray) -> ComplexArray:
    """k + jωc − ω²m nearest to S_zF/S_zz, lines weighed by the motion that they hold; N/m."""
    terms = (2j * np.pi * f[:, None] / f[-1]) ** np.arange(3)
    weight = np.sqrt(np.maximum(S_z, np.finfo(float).tiny))
    left, right = weight[:, None] * terms, S_zF / weight
    both = np.concatenate([left.real, left.imag]), np.concatenate([right.real, right.imag])
    return np.asarray(terms @ np.linalg.lstsq(*both)[0])


def _density(x: Array, y: Array, rate: float, longest: int) -> tuple[Array, ComplexArray]:
    length = min(longest, 2 ** int(np.log2(len(x) / 4)))
    one, other = scipy.signal.detrend(x), scipy.signal.detrend(y)
    f, S = scipy.signal.csd(one, other, rate, nperseg=length)
    return np.asarray(f), np.asarray(S)


def _noise(f: Array, S: Array, preparation: Preparation) -> float | None:
    """Density of the noise; None where the band above the cutoff is not empty."""
    cutoff = preparation.cutoff
    above = S[(f > _ABOVE * cutoff) & (f < preparation.sample_rate / 2)]
    if len(above) < _FEWEST_LINES:
        return None
    half = len(above) // 2
    highest = max(np.median(above[:half]), np.median(above[half:]))
    empty = highest < _EMPTY * np.median(S[(f > 0) & (f < cutoff)])
    return float(np.median(above)) if empty else None
