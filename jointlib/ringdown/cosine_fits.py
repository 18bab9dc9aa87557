"""Decaying cosines fitted to short pieces of a decay: amplitude, frequency and damping with their errors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray
from jointlib.ringdown.decay import Decay
from jointlib.ringdown.modes import OneMode

_FALL = 0.25
"""Logarithm by which the amplitude falls within a piece."""
_LEAST_CYCLES = 3.0
_MOST_PIECES = 120
CLEAR = 4.0
"""Times the noise, below which an amplitude tells nothing."""
_VAGUE = 0.1
"""Standard error of ln A, above which a fit has told nothing."""
_HEAVY = 0.06
"""Damping ratio from which amplitudes do not vary slowly any more; what comes later is left out."""
_STEPS = 12
_MOST_HARMONICS = 5


@dataclass(frozen=True)
class Pieces:
    """A decay piece by piece, x = Re exp(p), p' = −δ + jω; arrays over the pieces."""

    time: Array
    """s from the beginning of the decay."""
    amplitude: Array
    """m, of the displacement."""
    omega: Array
    """rad/s."""
    decay: Array
    """δ in 1/s."""
    stiffness: Array
    """Over the modal mass, 1/s²."""
    damping: Array
    """Over the modal mass, 1/s."""
    errors: Array
    """Standard errors of ln A, ω and δ, shape (3, pieces)."""
    second: Array
    """Amplitude of the second harmonic over that of the first; nan where it was not fitted."""
    second_error: Array

    def __len__(self) -> int:
        return len(self.time)

    @classmethod
    def none(cls) -> Pieces:
        """No piece at all."""
        no = np.zeros(0)
        return cls(no, no, no, no, no, no, np.zeros((3, 0)), no, no)


def pieces_of(decay: Decay, mode: OneMode) -> Pieces:
    """Fit x = Re[exp(p₀ + s t + ṡ t²/2) + Σ cₙ exp(n(s t + ṡ t²/2))] + c₀ + c₁ t to one piece after the other.

    The pieces do not overlap; each is as long as the amplitude takes to fall by a fifth, three cycles at least. First
    values are those of the analytic signal (Hilbert transform), errors those of white noise of the deviation that the
    fit leaves, or that the spectrum has where this is more. A filter's gain is taken out of the amplitude.
    """
    x, rate = mode.signal, decay.rate
    log, phase = _analytic(x, rate, mode.frequency)
    cycle = rate / mode.frequency
    first, rows = 0, []
    length = round(max(_LEAST_CYCLES * cycle, len(x) / _MOST_PIECES))
    damping = _first_damping(log, rate, length)
    while True:
        n = round(max(_LEAST_CYCLES * cycle, _FALL / max(damping, 1e-12) * rate, len(x) / _MOST_PIECES))
        n = min(n, max(len(x) // 6, round(_LEAST_CYCLES * cycle)))
        if first + n > len(x):
            break
        part = slice(first, first + n)
        row = _fit(x[part], rate, log[part], phase[part], mode.width is None, decay.noise)
        if row is not None and -row[1].real > 1.5 * damping and n > round(_LEAST_CYCLES * cycle):
            damping = -row[1].real
            continue
        if row is None or row[0] < CLEAR * decay.noise or row[3][0] > _VAGUE or -row[1].real > _HEAVY * abs(row[1]):
            break
        rows.append(((first + (n - 1) / 2) / rate, *row))
        damping = max(float(row[1].real) * -1, 0.2 * damping)
        first += n
    return _gathered(rows, decay, mode)


def _first_damping(log: Array, rate: float, length: int) -> float:
    part = log[: 2 * length]
    return float(max(-np.polyfit(np.arange(len(part)) / rate, part, 1)[0], 1e-9))


def _analytic(x: Array, rate: float, frequency: float) -> tuple[Array, Array]:
    """ln A and the phase in rad of the analytic signal within half the frequency of a line."""
    f = np.fft.rfftfreq(len(x), 1 / rate)
    near = np.where(np.abs(f - frequency) < 0.5 * frequency, 1.0, 0.0)
    whole = scipy.signal.hilbert(np.fft.irfft(np.fft.rfft(x - np.mean(x)) * near, len(x)))
    return np.log(np.maximum(np.abs(whole), 1e-300)), np.unwrap(np.angle(whole))


def _fit(
    x: Array, rate: float, log: Array, phase: Array, harmonics: bool, noise: float
) -> tuple[float, complex, complex, Array, float, float] | None:
    """Amplitude, s, ṡ, errors of (ln A, ω, δ), second harmonic with its error; None where it fails."""
    n = len(x)
    t = (np.arange(n) - (n - 1) / 2) / rate
    inner = slice(n // 8, n - n // 8)
    real, imag = (np.polyfit(t[inner], values[inner], 2)[::-1] for values in (log, phase))
    p = np.array([real[0], imag[0], real[1], imag[1], 0.0, 2 * imag[2]])
    count = min(_MOST_HARMONICS, int(0.45 * rate / (imag[1] / (2 * np.pi)))) if harmonics else 1
    count = max(1, min(count, (n - 10) // 6))
    powers = np.array([np.ones(n), t, t**2 / 2])
    for _ in range(_STEPS):
        grown = (p[2] + 1j * p[3]) * t + (p[4] + 1j * p[5]) * t**2 / 2
        line: ComplexArray = np.exp(p[0] + 1j * p[1] + grown)
        own = np.empty((6, n))
        own[0::2], own[1::2] = powers * line.real, -powers * line.imag
        size = np.exp(p[0])
        more = [size * np.exp(k * grown) for k in range(2, count + 1)]
        further = [part for one in more for part in (one.real, -one.imag)]
        J = np.array([*own, *further, np.full(n, size), size * t * rate / n]).T
        solved, *_ = np.linalg.lstsq(J, x - line.real, rcond=None)
        p = p + solved[:6] * min(1.0, 0.5 / max(abs(solved[0]), abs(solved[1]), 1e-300))
        if not np.all(np.isfinite(p)) or abs(p[0] - real[0]) > 3:
            return None
        if np.max(np.abs(solved[:4] * [1, 1, t[-1], t[-1]])) < 1e-10:
            break
    left = x - line.real - J[:, 6:] @ solved[6:]
    rms = float(np.sqrt(left @ left / max(1, n - J.shape[1])))
    deviation = max(rms, noise) if harmonics else noise
    inverse = np.linalg.pinv(J.T @ J)
    error = deviation * np.sqrt(np.abs(np.diag(inverse)))
    second = float(np.hypot(*solved[6:8])) if count > 1 else float("nan")
    second_error = float(np.hypot(*error[6:8])) if count > 1 else float("nan")
    growth, rate_of = complex(p[2], p[3]), complex(p[4], p[5])
    return float(np.exp(p[0])), growth, rate_of, error[[0, 3, 2]], second, second_error


def _gathered(
    rows: list[tuple[float, float, complex, complex, Array, float, float]], decay: Decay, mode: OneMode
) -> Pieces:
    """Pieces in displacement, without the filter: x⁽ᵒ⁾ of order o has s = p' + o ṡ/s and sᵒ times the amplitude.

    With M(ṡ + s²) + k + c s = 0 and s = −δ + jω: c/M = 2δ − ω̇/ω, k/M = ω² + δ² + δ̇ − δω̇/ω.
    """
    if not rows:
        return Pieces.none()
    time, size, growth, bend, errors, second, second_error = (np.array(column) for column in zip(*rows, strict=True))
    line, factor = mode.unfiltered(growth, bend)
    s = line - decay.order * bend / line
    amplitude = size / np.abs(s) ** decay.order / factor
    harmonic = second / 2.0**decay.order
    omega, delta, turn = s.imag, -s.real, bend.imag / s.imag
    return Pieces(
        time + mode.start,
        amplitude,
        omega,
        delta,
        omega**2 + delta**2 - bend.real - delta * turn,
        2 * delta - turn,
        errors.T,
        harmonic,
        second_error / 2.0**decay.order,
    )
