"""One record of a rig, and what of the motion across its joint stands clear of the noise."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.loop.balance.bodies import Rig
from jointlib.loop.balance.floor import Floor
from jointlib.loop.balance.spectra import Mask, Spectra

_KEEP_PERIOD, KEEP_OTHER = 6.0, 14.0


@dataclass(frozen=True)
class Recorded:
    """Channels and motion on the lines up to ``f_max``.

    The relative motion Z = −(A1 − A2)/ω² is kept only where it stands clear of its noise, because double integration
    multiplies noise by 1/ω²; the mean is never integrated.
    """

    spectra: Spectra
    rig: Rig
    floor: Floor
    band: tuple[float, float, float, float]
    unseen: ComplexArray | None = field(default=None, kw_only=True)
    """Motion on lines where no z is measured, m times samples of the oversampled period: see ``unseen.py``."""

    @cached_property
    def lines(self) -> slice:
        """The mean … f_max."""
        return slice(0, int(np.searchsorted(self.spectra.frequency, self.band[3], side="right")))

    @cached_property
    def frequency(self) -> Array:
        return self.spectra.frequency[self.lines]

    @cached_property
    def omega(self) -> Array:
        return 2 * np.pi * self.frequency

    @cached_property
    def over_omega2(self) -> Array:
        """1/ω², 0 for the mean: it is never integrated."""
        safe = np.where(self.omega > 0, self.omega, np.inf)
        return np.asarray(1 / safe**2)

    @cached_property
    def on_period(self) -> Mask:
        return self.spectra.on_period[self.lines]

    def channel(self, name: str) -> ComplexArray:
        return self.spectra.channels[name][self.lines]

    def noise(self, name: str) -> Array:
        return self.floor.power[name][self.lines]

    def significant(self, name: str) -> ComplexArray:
        """A channel on the lines where it stands clear of its noise, 0 elsewhere."""
        X = self.channel(name)
        limit = np.where(self.on_period, _KEEP_PERIOD, KEEP_OTHER) * self.noise(name)
        return np.where(np.abs(X) ** 2 > limit, X, 0)

    @cached_property
    def displacement_noise(self) -> Array:
        """E|Z|² of noise alone; 0 for the mean."""
        return np.asarray((self.noise("a1") + self.noise("a2")) * self.over_omega2**2)

    @cached_property
    def kept(self) -> Mask:
        """Lines on which z is known: clear of noise; outside the excited band the test is stricter."""
        f_min, low, high, _ = self.band
        excited = self.on_period & (self.frequency >= low - 1e-9) & (self.frequency <= high + 1e-9)
        limit = np.where(excited, _KEEP_PERIOD, KEEP_OTHER) * self.displacement_noise
        above = np.abs(self.raw_displacement) ** 2 > limit
        return np.asarray(above & (self.frequency >= f_min) & (self.frequency > 0), dtype=bool)

    @cached_property
    def raw_displacement(self) -> ComplexArray:
        Z: ComplexArray = -(self.channel("a1") - self.channel("a2")) * self.over_omega2
        return Z

    @cached_property
    def Z(self) -> ComplexArray:
        return np.where(self.kept, self.raw_displacement, 0)

    @cached_property
    def path(self) -> tuple[Array, Array, float]:
        """z in m and ż in m/s over one averaged period, oversampled, and the time step in s."""
        return self.spectra.moved(self.Z[self.on_period], self.unseen)

    @cached_property
    def whole_path(self) -> tuple[Array, Array, float] | None:
        """The same over the whole record; None where all that is known of z repeats."""
        if not np.any(self.stray & self.kept):
            return None
        return self.spectra.moved(self.Z[1:], self.unseen, whole=True)

    def lines_of(self, force: Array, whole: bool = False) -> ComplexArray:
        """A force over one period, or over the whole record, on the lines (last axis in and out), without its mean."""
        on = np.arange(len(self.frequency)) > 0 if whole else self.on_period
        F = np.fft.rfft(force, axis=-1) * (self.spectra.samples / force.shape[-1])
        out = np.zeros((*force.shape[:-1], len(self.frequency)), dtype=complex)
        out[..., on] = F[..., 1 : on.sum() + 1]
        return out

    def in_time(self, X: ComplexArray) -> Array:
        """Lines (last axis) as signals over the record, nothing beyond the last line."""
        samples = self.spectra.samples
        whole = np.zeros((*X.shape[:-1], samples // 2 + 1), dtype=complex)
        whole[..., self.lines] = X
        return np.asarray(np.fft.irfft(whole, samples))

    def times(self, X: ComplexArray, course: Array) -> ComplexArray:
        """Lines of a signal times courses along the record, (..., samples), or (..., 1) of what stands still."""
        if course.shape[-1] == 1:
            return np.asarray(X * course)
        return self.lines_of(self.in_time(X) * course, whole=True)

    @cached_property
    def stray(self) -> Mask:
        """Lines between those of the period on which the joint equation is used.

        What does not repeat moves the joint through its linear part there; z is taken as measured, noise and all,
        for what is lost below a threshold would count as missing force.
        """
        return np.asarray(~self.on_period & (self.frequency >= self.band[0]), dtype=bool)

    @cached_property
    def informative(self) -> Mask:
        """Lines on which z is more than noise: what a stiffness can be fitted to."""
        return np.asarray(self.on_period | self.kept, dtype=bool)

    def force_along(self, of: Callable[[Array, Array, float], Array]) -> ComplexArray:
        """A force in N without memory, of z, ż and the time step, on the lines: of all the motion that is known."""
        return self.lines_of(of(*self.path)) if self.whole_path is None else self.lines_of(of(*self.whole_path), True)

    def with_stray(self, force: ComplexArray) -> ComplexArray:
        """A force on the period lines with its linear part on the lines between them where z is more than noise."""
        if self.whole_path is None:
            return force
        k, c = self.linear_part(force)
        return force + np.where(self.stray & self.kept, (k + 1j * self.omega * c) * self.Z, 0)

    def linear_part(self, force: ComplexArray) -> tuple[float, float]:
        """Stiffness in N/m and damping in N s/m that come nearest to a force on the kept lines."""
        use = self.kept & self.on_period
        columns = np.stack([self.Z[use], 1j * self.omega[use] * self.Z[use]])
        size = np.linalg.norm(columns, axis=1)
        A = np.concatenate([columns.real, columns.imag], axis=1).T / size
        b = np.concatenate([force[use].real, force[use].imag])
        k, c = np.linalg.lstsq(A, b, rcond=None)[0] / size
        return float(k), float(c)

    @cached_property
    def joint_force(self) -> ComplexArray:
        """f = m2 a2 + m3 a3 in N and what holds these bodies to ground; without a3 both masses move with a2."""
        parts = [self.apparent_masses[a] * self.channel(a) for a in self.rig.masses if a != "a1"]
        return np.asarray(sum(parts))

    @cached_property
    def apparent_masses(self) -> Mapping[str, ComplexArray]:
        """kg that move with each accelerometer and what holds them to ground, on the lines: see :class:`Rig`."""
        return {a: self.rig.apparent_mass(a, self.omega) for a in self.rig.masses}
