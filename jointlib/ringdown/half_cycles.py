"""A decay of a few cycles, from turning point to turning point: what much friction leaves to look at."""

from __future__ import annotations

import numpy as np
import scipy

from jointlib.arrays import Array, Index
from jointlib.ringdown.cosine_fits import CLEAR, Pieces
from jointlib.ringdown.decay import Decay

_NEAR = 1 / 6
"""Cycles to either side of a turning point that tell where it is."""
_HEAVY = 0.15
"""Damping ratio up to which a cycle tells a damping to 2 %, whatever makes it."""
_SPREAD = 0.25
"""Of half a cycle, by which one may differ from the middle of all."""
_STANDS_OUT = 0.02
"""Of the whole swing, from which an extreme is a turning point."""
_LEAST = 4
"""Turning points that tell something."""
_EXTREMES_A_BEND = 3
"""Extremes for one order of the polynomial that is their middle line."""
_STEPS = 3


def half_cycles(decay: Decay) -> Pieces:
    """Amplitude, frequency and damping of every two half cycles of displacement x(t) that meet at a turning point.

    With turning points x₋, x₀, x₊ in turn at t₋, t₀, t₊ are A = (|x₋ − x₀| + |x₀ − x₊|)/4, ω = 2π/(t₊ − t₋) and
    δ = (ω/π) |x₋ − x₊|/(2A), wherever the motion comes to rest. Dry friction takes 2F/k of every half cycle and leaves
    its length alone, so that c/M = 2δ − ω̇/ω and k/M = ω² + δ² − δ̇ are exact. For viscous damping k is exact as well and
    c right to (πζ)²/12; of other damping k is known to ζ². Errors are those of white noise as large as what is left
    around the turning points, with what integration over a half cycle makes of the noise of the record, and √2 larger,
    as each half cycle serves twice.
    """
    at, size, by_size, by_time = _turning_points(_displacement(decay), decay.rate, decay.frequency)
    if len(at) < _LEAST:
        return Pieces.none()
    time, swing = at[1:-1], np.abs(np.diff(size))
    amplitude = (swing[:-1] + swing[1:]) / 4
    omega = 2 * np.pi / (at[2:] - at[:-2])
    delta = omega / (2 * np.pi) * (swing[:-1] - swing[1:]) / amplitude
    turn = np.gradient(omega, time) / omega
    half = np.pi / omega
    drawn_on = decay.noise * np.sqrt(half / decay.rate) * half ** (decay.order - 1) if decay.order else 0.0
    of_size = np.hypot(by_size[1:-1], drawn_on) / amplitude
    of_time = np.hypot(np.hypot(by_time[2:], by_time[:-2]), drawn_on / (amplitude * omega))
    of_omega = omega**2 / (np.sqrt(2) * np.pi) * of_time
    errors = np.array([np.sqrt(3) / 2 * of_size, np.hypot(of_omega, delta**2 / (2 * omega)), omega / np.pi * of_size])
    stiffness = omega**2 + delta**2 - np.gradient(delta, time)
    unknown = np.full(len(time), np.nan)
    clear = amplitude * omega**decay.order > CLEAR * decay.noise
    n = int(np.cumprod(clear & (delta > 0) & (delta < _HEAVY * omega)).sum())
    told = (time, amplitude, omega, delta, stiffness, 2 * delta - turn, errors, unknown, unknown)
    return Pieces(*(one[..., :n] for one in told))


def _displacement(decay: Decay) -> Array:
    """The signal integrated as often as it takes, in m, its middle line straightened before and after."""
    cycle = decay.rate / decay.frequency
    at, _ = _extremes(decay.signal, cycle)
    x = _about_zero(decay.signal[: at[-1] + round(cycle)] if len(at) else decay.signal, cycle)
    for _ in range(decay.order):
        x = _about_zero(np.concatenate([[0.0], np.cumsum(x[1:] + x[:-1])]) / (2 * decay.rate), cycle)
    return x


def _about_zero(x: Array, cycle: float) -> Array:
    """Without the smooth line through (x₋ + 2 x₀ + x₊)/4 of extremes in turn, which is 0 where they fall evenly; taken
    twice, it is nearly 0 where they fall by a share."""
    x = x - np.mean(x)
    for _ in range(2):
        at, middle = _extremes(x, cycle)
        if len(at) < _LEAST + 2:
            return x
        for _ in range(2):
            at, middle = at[1:-1], (middle[:-2] + 2 * middle[1:-1] + middle[2:]) / 4
        line = np.polynomial.Chebyshev.fit(at, middle, max(1, len(at) // _EXTREMES_A_BEND))
        x = x - line(np.clip(np.arange(len(x)), at[0], at[-1]))
    return x


def _extremes(x: Array, cycle: float) -> tuple[Index, Array]:
    """Samples at which tops and bottoms take turns while half cycles are alike, and what x is there when smoothed."""
    kernel = np.hanning(max(3, round(cycle / 4)) + 2)
    ends = len(kernel) // 2
    smooth = np.convolve(np.pad(x, ends, mode="edge"), kernel / np.sum(kernel), mode="same")[ends : len(x) + ends]
    least = _STANDS_OUT * float(np.ptp(smooth))
    found = [(int(k), sign) for sign in (1, -1) for k in scipy.signal.find_peaks(sign * smooth, prominence=least)[0]]
    turns = list[tuple[int, int]]()
    for k, sign in sorted(found):
        if turns and turns[-1][1] == sign:
            break
        if k > _NEAR * cycle:
            turns.append((k, sign))
    at = np.array([k for k, _ in turns], dtype=np.intp)
    if len(at) > 1:
        half = np.diff(at)
        even = np.abs(half / np.median(half) - 1) < _SPREAD
        at = at[: 1 + int(np.cumprod(even).sum())]
    return at, smooth[at]


def _turning_points(x: Array, rate: float, frequency: float) -> tuple[Array, Array, Array, Array]:
    """Times in s, displacements in m, and errors of displacement and time.

    x = x₀ − (a ± b)(1 − cos ωτ), with another sign before and after, as friction turns there; τ is from there on.
    """
    at, _ = _extremes(x, rate / frequency)
    if len(at) < _LEAST:
        nothing = np.zeros(0)
        return nothing, nothing, nothing, nothing
    omega = np.pi * rate / float(np.median(np.diff(at)))
    reach = _NEAR * 2 * np.pi / omega
    rows = []
    for k in at:
        time = k / rate
        for _ in range(_STEPS):
            n = np.arange(max(0, int(np.ceil((time - reach) * rate))), min(len(x), int((time + reach) * rate) + 1))
            t = n / rate - time
            bent = 1 - np.cos(omega * t)
            J = np.array([np.ones(len(t)), -bent, -np.sign(t) * bent, np.sin(omega * t)]).T
            solved, *_ = np.linalg.lstsq(J, x[n], rcond=None)
            step = solved[3] / (omega * solved[1])
            time = time + float(np.clip(step, -reach / 4, reach / 4))
        left = x[n] - J @ solved
        rms = np.sqrt(left @ left / max(1, len(n) - 4))
        error = rms * np.sqrt(np.diag(np.linalg.pinv(J.T @ J)))
        rows.append((time, solved[0], error[0], error[3] / (omega * abs(solved[1]))))
    when, size, by_size, by_time = np.array(rows).T
    return when, size, by_size, by_time
