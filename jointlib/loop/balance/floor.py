"""Noise floor of the channels, and its propagation into the residuals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.loop.balance.spectra import Mask, Spectra

Closure: TypeAlias = Mapping[str, float | ComplexArray]
"""A sum of channels that vanishes for every motion: a factor for every channel, one number or one a line."""
_BLOCK = 400
_SKIPPED = 8
_RAISED = 1.5
_CLEAR = 20.0
"""Times its mean: the power of noise on one of 10⁵ lines exceeds that in one record of a thousand, 10⁵ e^−20 ≈ 2e-4."""


@dataclass(frozen=True)
class Floor:
    """Noise power E|X_l|² of every channel of one record, one value a line."""

    power: Mapping[str, Array]
    source: str
    """"between_lines", or "quiet" where something that does not repeat lies between the lines."""
    ratio: Mapping[str, float]
    """Floor between the lines over the floor of a quiet record, where there is one: the largest over frequency, as
    something that does not repeat stands beside the excited lines alone."""


def noise_floor(record: Spectra, quiet: Sequence[Spectra] = (), closures: Sequence[Closure] = ()) -> Floor:
    """Floor between the lines of the period; where it is 1.5 times higher than that of quiet records, of both.

    What is more between the lines than in a quiet record may be noise that grows while the shaker runs, or a motion
    that does not repeat, which a floor taken there would hide. In sums of channels that vanish for every motion (the
    balance of forces, the difference of two sensors on one body) noise adds up and a motion does not:
    S = S_quiet + θ (S_between − S_quiet), θ the share of the sum of the channels' surplus that is found in the sum of
    the channels. ``closures`` are such sums, a factor for every channel; without any θ is 0.
    """
    power, ratio, source = {}, {}, "between_lines"
    for name, X in record.channels.items():
        silent = [_of_quiet(q, name, record) for q in quiet if name in q.channels]
        still = np.mean(silent, axis=0) if silent else None
        if record.periods < 2:
            if still is None:
                raise InputError(
                    f"{record.name}: one period after the run-in and no quiet record, expected at least 2 periods or a "
                    'record with role = "quiet": nothing else tells the noise'
                )
            power[name], source = still, "quiet"
            continue
        free = ~record.on_period
        power[name] = _median_power(np.abs(X) ** 2, free, record.frequency)
        if still is not None:
            ratio[name] = float(np.max(power[name] / still))
    if any(r > _RAISED for r in ratio.values()):
        silence = {n: np.mean([_of_quiet(q, n, record) for q in quiet if n in q.channels], axis=0) for n in ratio}
        share = _noise_share(record, closures, power, silence)
        source = "between_lines" if share > 0.5 else "quiet"
        power = {n: p if n not in silence else silence[n] + share * (p - silence[n]) for n, p in power.items()}
    return Floor(power, source, ratio)


def _noise_share(
    record: Spectra, closures: Sequence[Closure], between: Mapping[str, Array], silence: Mapping[str, Array]
) -> float:
    """Share of what is more between the lines than in silence that is noise of the channels, 0 to 1."""
    free, surplus, found = ~record.on_period, 0.0, 0.0
    for closure in closures:
        if not closure.keys() <= silence.keys():
            continue
        whole = np.asarray(sum(factor * record.channels[name] for name, factor in closure.items()))
        loud, still = (
            np.asarray(sum(np.abs(factor) ** 2 * S[name] for name, factor in closure.items()))
            for S in (between, silence)
        )
        told = _median_power(np.abs(whole) ** 2, free, record.frequency)
        surplus += float(np.mean((loud - still) / loud))
        found += float(np.mean((told - still) / loud))
    return float(np.clip(found / surplus, 0.0, 1.0)) if surplus > 0 else 0.0


def _of_quiet(quiet: Spectra, name: str, record: Spectra) -> Array:
    """Floor of a quiet record on the lines of another; power of noise grows with the number of samples."""
    everything = np.ones(len(quiet.frequency), dtype=bool)
    own = _median_power(np.abs(quiet.channels[name]) ** 2, everything, quiet.frequency)
    scaled = own * (record.samples / quiet.samples)
    return np.asarray(np.exp(np.interp(record.frequency, quiet.frequency, np.log(scaled))))


def _median_power(power: Array, free: Mask, frequency: Array) -> Array:
    """median |X|²/ln 2 over blocks of free lines, logarithms interpolated: outliers do not lift it."""
    lines = np.flatnonzero(free)[_SKIPPED:]
    blocks = np.array_split(lines, max(1, round(len(lines) / _BLOCK)))
    centre = np.array([frequency[b].mean() for b in blocks])
    # A channel without noise (exact simulated data) still needs a positive floor: rounding.
    least = max(float(power.max()) * 1e-24, 1e-300)
    level = np.array([max(float(np.median(power[b])) / np.log(2), least) for b in blocks])
    return np.asarray(np.exp(np.interp(frequency, centre, np.log(level))))


def propagated(rows: ComplexArray, power: Sequence[Array], extra_balance: Array) -> ComplexArray:
    """Covariance C = N diag(S) Nᴴ of the residuals per line, shape (lines, equations, equations).

    ``rows`` is N, shape (lines, equations, channels): how an additive error on a channel moves each equation.
    ``extra_balance`` is the variance that uncertain masses add to the first equation.
    """
    S = np.stack(power, axis=-1)
    C: ComplexArray = np.einsum("lec,lc,lfc->lef", rows, S, rows.conj())
    C[:, 0, 0] += extra_balance
    return C


def excited_band(
    records: Sequence[Spectra], floors: Sequence[Floor], declared: tuple[float, float] | None
) -> tuple[float, float, float, float]:
    """(f_min, excited low, excited high, f_max) in Hz.

    Excited are the period lines on which the drive (P, without it a1) comes within 40 dB of its largest line, and
    stands so far clear of its noise that not one in a thousand records shows it by chance. The
    joint equation is used from f_min, which the declared band or the lowest excited line gives, to f_max: the
    declared band, else three times the highest excited line, within 0.8 of half the sample rate.
    """
    low, high = np.inf, 0.0
    for record, floor in zip(records, floors, strict=True):
        name = "P" if "P" in record.channels else "a1"
        drive = np.abs(record.channels[name]) * record.on_period
        if not drive.any():
            raise InputError(f"{record.name}: P (or a1) is zero throughout, expected a record with the excitation on")
        lines = record.frequency[(drive > 1e-2 * drive.max()) & (drive**2 > _CLEAR * floor.power[name])]
        if not len(lines):
            raise InputError(f"{record.name}: no line of {name} stands out of its noise, expected a larger excitation")
        low, high = min(low, float(lines[0])), max(high, float(lines[-1]))
    edge = 0.8 * min(r.sample_rate for r in records) / 2
    f_min, f_max = (0.8 * low, min(edge, 3 * high))
    if declared is not None:
        f_min, f_max = max(f_min, declared[0]), min(edge, declared[1])
    if not any(np.any((r.frequency >= f_min) & (r.frequency <= f_max) & r.on_period) for r in records):
        raise InputError(
            f"{records[0].name}: no excited line lies in the band from {f_min:g} to {f_max:g} Hz, expected a band "
            f"that holds the excitation, {low:g} to {high:g} Hz"
        )
    return f_min, low, high, f_max
