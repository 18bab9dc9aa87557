"""Two bodies and a joint in their steady state, by Fourier collocation.

The relative motion z = z1 − z2 is sought as a trigonometric polynomial over one window of time (a period of the
excitation, or a whole record where something changes on the way). The linear part of the joint is exact in the
frequency domain, the hidden force N is evaluated along the path on a fine grid:

    −ω² Z + (1/m1 + 1/(m2 + m3)) [D(ω) Z + N(z, ż)] = P/m1.

Two iterations lead there: a fixed point accelerated by its history (Anderson 1965), or steps in time whose defect in
this equation is fed back to the drive (Stetter 1978) until nothing is left of their error. Nothing here is shared with
the program under test: numpy and scipy alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Hidden = Callable[[Array, Array, Array], Array]
"""(z in m, ż in m/s, t in s since the first sample) → force in N; z and ż are (records, points), t is (points,)."""
Dynamic = Callable[[Array], ComplexArray]
"""ω in rad/s → linear dynamic stiffness in N/m."""

_HIGHEST = 150e3
"""Hz; motion above is left out, a force there hardly moves a mass."""
_TOLERANCE = 1e-11
_MIXTURES, _MEMORY = 120, 30
_SWEEPS = 6


def no_force(z: Array, v: Array, t: Array) -> Array:
    """Nothing beside the linear joint."""
    return np.zeros_like(z)


def no_stiffness(omega: Array) -> ComplexArray:
    """Nothing beside spring and damper."""
    return np.zeros(len(omega), dtype=complex)


@dataclass(frozen=True)
class Rig:
    """Body 1 driven by P, bodies 2 and 3 rigid together, a joint between; free in space. SI."""

    m1: float = 0.942
    m2: float = 1.1
    m3: float = 1.1
    stiffness: float = 654e6
    damping: float = 500.0
    hidden: Hidden = no_force
    dynamic: Dynamic = no_stiffness
    cords: tuple[tuple[float, float], tuple[float, float]] = ((0.0, 0.0), (0.0, 0.0))
    """N/m and N s/m between ground and body 1, and between ground and bodies 2 and 3."""

    @property
    def inverse_mass(self) -> float:
        """1/kg of the relative motion of free bodies."""
        return 1 / self.m1 + 1 / (self.m2 + self.m3)

    def accelerances(self, omega: Array) -> tuple[ComplexArray, ComplexArray]:
        """Acceleration of either side per force on it, a hung mass by itself; 1/m for the mean, which is not moved."""
        s = 1j * omega
        out = []
        for m, (k, c) in zip((self.m1, self.m2 + self.m3), self.cords, strict=True):
            own = np.full(len(omega), 1 / m, dtype=complex)
            moving = omega > 0
            if k or c:
                own[moving] = s[moving] ** 2 / (m * s[moving] ** 2 + c * s[moving] + k)
            out.append(own)
        return out[0], out[1]


@dataclass(frozen=True)
class Motion:
    """Relative motion, joint force and accelerations on the fine grid, (records, points), SI."""

    z: Array
    v: Array
    force: Array
    a1: Array
    a2: Array
    drive: Array


def linear_motion(rig: Rig, drive: Array, step: float) -> tuple[Array, Array]:
    """z and ż of the rig without its hidden force."""
    points = drive.shape[-1]
    omega = 2 * np.pi * np.fft.rfftfreq(points, step)
    D = 1j * omega
    Z = np.fft.rfft(drive) / rig.m1 / (-(omega**2) + rig.inverse_mass * (rig.stiffness + D * rig.damping))
    return np.fft.irfft(Z, points), np.fft.irfft(D * Z, points)


class NoMotion(RuntimeError):
    """The iteration did not settle: there may be several motions, or none that repeats."""


class Equation:
    """The equation of the relative motion on its lines, for given drives (records, points; N)."""

    def __init__(self, rig: Rig, drive: Array, step: float) -> None:
        self.rig, self.drive, self.points = rig, drive, drive.shape[-1]
        omega = 2 * np.pi * np.fft.rfftfreq(self.points, step)
        self.omega = omega[omega < min(2 * np.pi * _HIGHEST, omega[-1])]
        self.time: Array = np.asarray(step * np.arange(self.points), dtype=np.float64)
        self.D = 1j * self.omega
        self.linear = rig.stiffness + self.D * rig.damping + rig.dynamic(self.omega)
        give, carried = rig.accelerances(self.omega)
        self.inverse_mass = give + carried
        self.mobile = -(self.omega**2) + self.inverse_mass * self.linear
        self.push = self.lines(drive) * give

    def lines(self, x: Array) -> ComplexArray:
        """Spectrum of a signal on the lines."""
        return np.asarray(np.fft.rfft(x)[:, : len(self.omega)])

    def along(self, Z: ComplexArray) -> tuple[Array, Array, Array]:
        """z, ż and the hidden force along the path."""
        z, v = np.fft.irfft(Z, self.points), np.fft.irfft(self.D * Z, self.points)
        return z, v, self.rig.hidden(z, v, self.time)

    def defect(self, Z: ComplexArray, f: Array) -> ComplexArray:
        """What the equation lacks, m/s² times points."""
        return np.asarray(self.push - self.mobile * Z - self.inverse_mass * self.lines(f))

    def gap(self, Z: ComplexArray, change: ComplexArray) -> float:
        """Velocity of a change over that of the motion, the largest of the records."""
        return float(np.max(np.linalg.norm(self.D * change, axis=1) / np.linalg.norm(self.D * Z, axis=1)))

    def motion(self, Z: ComplexArray) -> Motion:
        """The answer."""
        z, v, f = self.along(Z)
        force = np.fft.irfft(self.linear * Z, self.points) + f
        omega: Array = np.asarray(2 * np.pi * np.fft.rfftfreq(self.points, self.time[1]), dtype=np.float64)
        a1, a2 = (
            np.fft.irfft(own * np.fft.rfft(on), self.points)
            for own, on in zip(self.rig.accelerances(omega), (self.drive - force, force), strict=True)
        )
        return Motion(z, v, force, a1, a2, self.drive)


def by_mixture(e: Equation, start: ComplexArray | None = None) -> Motion:
    """The motion that repeats with the window: next guess from the linear rig nearest to the last motion."""
    Z = e.push / e.mobile if start is None else start
    extra: ComplexArray = np.zeros((len(Z), 1), dtype=complex)
    mixing = Anderson(e.omega)
    for iteration in range(_MIXTURES):
        z, v, f = e.along(Z)
        if iteration in (0, 2, 6):
            extra, mixing = equivalent(z, v, f, e.D), Anderson(e.omega)
        change = e.defect(Z, f) / (e.mobile + e.inverse_mass * extra)
        gap = e.gap(Z, change)
        if gap < _TOLERANCE:
            return e.motion(Z)
        if not gap < (1e3 if iteration < 40 else 1e-2):
            break
        Z = mixing.step(Z, Z + change)
    raise NoMotion(f"no periodic motion found: residual {gap:.1e}")


def by_steps(e: Equation, coarser: int, peak: tuple[int, float] | None = None) -> Motion:
    """The same for a force without memory: steps on a grid ``coarser`` times coarser, corrected by their defect.

    Where that goes slowly the mixture takes over, close to the motion by then.

    ``peak`` = (record, m): the drive is lowered until that record moves by no more than 1.15 times that peak.
    """
    step = float(e.time[coarser])
    record, allowed = peak or (0, np.inf)
    for _ in range(4):
        z, end = stepped(e.rig, e.drive[:, ::coarser], step, 3)
        reached = float(np.abs(z[record]).max())
        if reached < 1.15 * allowed:
            break
        e = Equation(e.rig, e.drive * (allowed / reached), float(e.time[1]))
    else:
        raise NoMotion(f"the motion stays above {allowed:g} m")
    drive = e.drive[:, ::coarser].copy()
    for _ in range(_SWEEPS):
        known = np.fft.rfft(z)[:, :-1] * coarser
        m = min(known.shape[1], len(e.omega))
        Z = e.push / e.mobile
        Z[:, :m] = known[:, :m]
        for _ in range(3):
            # Lines above the coarse grid follow from the force at once, where masses rule.
            defect = e.defect(Z, e.along(Z)[2])
            Z[:, m:] += defect[:, m:] / e.mobile[m:]
        gap = e.gap(Z, defect / e.mobile)
        if gap < _TOLERANCE:
            return e.motion(Z)
        if not gap < 1.0:
            raise NoMotion(f"no motion repeats with the window: residual {gap:.1e}")
        fed = np.zeros((len(Z), drive.shape[1] // 2 + 1), dtype=complex)
        fed[:, :m] = defect[:, :m] * e.rig.m1 / coarser
        drive += np.fft.irfft(fed, drive.shape[1])
        z, end = stepped(e.rig, drive, step, 2, end)
    return by_mixture(e, Z)


def solve(rig: Rig, drive: Array, step: float) -> Motion:
    """The motion by the first of the ways."""
    return by_mixture(Equation(rig, drive, step))


def equivalent(z: Array, v: Array, f: Array, D: ComplexArray) -> ComplexArray:
    """Spring and damper nearest to a force, per record: dynamic stiffness (records, lines)."""
    z, mean = z - z.mean(axis=1, keepdims=True), f.mean(axis=1, keepdims=True)
    k = np.sum((f - mean) * z, axis=1) / np.sum(z * z, axis=1)
    c = np.sum((f - mean) * v, axis=1) / np.sum(v * v, axis=1)
    return np.asarray(k[:, None] + D * c[:, None])


class Anderson:
    """Fixed point Z ← G(Z), each record for itself, from the last residuals, which ``weight`` weighs."""

    def __init__(self, weight: Array) -> None:
        self.weight = weight
        self.states: list[ComplexArray] = []
        self.residuals: list[ComplexArray] = []

    def step(self, Z: ComplexArray, towards: ComplexArray) -> ComplexArray:
        """The next guess: the mixture of what was found so far whose residual is least."""
        self.states = [*self.states[-_MEMORY:], towards]
        self.residuals = [*self.residuals[-_MEMORY:], (towards - Z) * self.weight]
        if len(self.states) == 1:
            return towards
        out = np.empty_like(Z)
        for r in range(len(Z)):
            here = self.residuals[-1][r]
            moved = np.array([here - old[r] for old in self.residuals[:-1]]).view(float)
            size = np.maximum(np.linalg.norm(moved, axis=1), 1e-300)
            moved /= size[:, None]
            share = np.linalg.lstsq(moved @ moved.T, moved @ here.view(float), rcond=1e-13)[0] / size
            out[r] = (1 - share.sum()) * self.states[-1][r]
            for s, old in zip(share, self.states, strict=False):
                out[r] += s * old[r]
        return out


def stepped(
    rig: Rig, drive: Array, step: float, turns: int, start: tuple[Array, Array] | None = None
) -> tuple[Array, tuple[Array, Array]]:
    """z along the last of ``turns`` windows and the state at its end: an exponential Runge–Kutta rule, second order.

    Cox, Matthews 2002 (ETD2RK): the linear rig is propagated exactly.
    """
    A = np.array([[0.0, 1.0], [-rig.inverse_mass * rig.stiffness, -rig.inverse_mass * rig.damping]])
    block = np.zeros((4, 4))
    block[:2, :2], block[1, 2], block[2, 3] = A * step, step, 1.0
    E = expm(block)
    (e11, e12), (e21, e22) = E[:2, :2].tolist()
    (p1, q1), (p2, q2) = E[:2, 2:].tolist()
    push = (drive / rig.m1).T[:, :, None]
    z, v = start or (np.zeros((len(drive), 1)), np.zeros((len(drive), 1)))
    out, points = [], drive.shape[-1]
    time: Array = np.asarray(step * np.arange(points), dtype=np.float64)
    old = push[0] - rig.inverse_mass * rig.hidden(z, v, time[:1])
    for i in range(turns * points):
        if i >= (turns - 1) * points:
            out.append(z[:, 0])
        j = (i + 1) % points
        z, v = e11 * z + e12 * v + p1 * old, e21 * z + e22 * v + p2 * old
        new = push[j] - rig.inverse_mass * rig.hidden(z, v, time[j : j + 1])
        z, v = z + q1 * (new - old), v + q2 * (new - old)
        old = push[j] - rig.inverse_mass * rig.hidden(z, v, time[j : j + 1])
    return np.array(out).T, (z, v)


def sampled(fine: Array, samples: int) -> Array:
    """A periodic signal on ``samples`` points of its window, everything above half their rate cut off exactly."""
    spectrum = np.fft.rfft(fine)[..., : (samples + 1) // 2]
    return np.asarray(np.fft.irfft(spectrum, samples) * (samples / fine.shape[-1]))
