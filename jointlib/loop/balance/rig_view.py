"""A record of a rig as a fault sees it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.loop.balance.equations import Observed
from jointlib.loop.balance.spectra import Mask

_CHANNELS = ("a1", "a2", "a3", "P")


@dataclass(frozen=True)
class RigView:
    """:class:`jointlib.fault.RigRecord` over one record; ``first`` samples of run-in were dropped before it."""

    observed: Observed
    first: int = 0
    feed: Array | None = None
    """Feed position in m along :attr:`time`, where a channel measures it."""

    @property
    def name(self) -> str:
        return self.observed.spectra.name

    @property
    def frequency(self) -> Array:
        return self.observed.frequency

    @property
    def omega(self) -> Array:
        return self.observed.omega

    @property
    def on_period(self) -> Mask:
        return self.observed.on_period

    @cached_property
    def time(self) -> Array:
        spectra = self.observed.spectra
        return (self.first + np.arange(spectra.samples)) / spectra.sample_rate

    @property
    def masses(self) -> Mapping[str, float]:
        return self.observed.rig.masses

    @cached_property
    def displacement(self) -> Array:
        o = self.observed
        return self.observed.in_time(np.where(o.on_period, o.lines_of(o.path[0]), o.Z))

    @cached_property
    def open_ends(self) -> ComplexArray:
        """What a ramp of z and a parabola of z, on which the acceleration says nothing, do to B, R, J: (2, lines, 3).

        Their spectra are those of the samples: lines of a motion that does not close fold back at half the rate.
        """
        o = self.observed
        t = self.time - self.time.mean()
        ramp, parabola = self.lines_of(t), self.lines_of(t**2 / 2)
        force = o.stiffness * parabola + o.damping * ramp
        return np.stack([self.on_equations(joint=o.stiffness * ramp), self.on_equations(joint=force)])

    @property
    def position(self) -> Array | None:
        return self.feed

    def suspension(self, channel: str) -> tuple[float, float]:
        return self.observed.rig.suspension(channel)

    def has(self, channel: str) -> bool:
        return channel in self.observed.spectra.channels

    def masked(self, channel: str) -> ComplexArray:
        return self.observed.significant(channel)

    def averaged(self, channel: str) -> Array:
        mean = float(self.observed.channel(channel)[0].real) / self.observed.spectra.samples
        return self._repeated(self.masked(channel)) + mean

    def predicted(self, channel: str) -> Array | None:
        rig = self.observed.rig
        if channel in ("a2", "a3") and rig.has_third:
            return self.averaged("a3" if channel == "a2" else "a2")
        if not rig.has_balance or channel not in ("a1", "P"):
            return None
        masses = self.observed.apparent_masses
        passive = sum(m * self._mean_and_period(a) for a, m in masses.items() if a != "a1")
        if channel == "P":
            return self.observed.in_time(masses["a1"] * self._mean_and_period("a1") + passive)
        return self.observed.in_time((self._mean_and_period("P") - passive) / masses["a1"])

    def lines_of(self, signal: Array) -> ComplexArray:
        return np.asarray(np.fft.rfft(signal, axis=-1)[..., self.observed.lines])

    def on_channel(self, channel: str, X: ComplexArray) -> ComplexArray:
        i = _CHANNELS.index(channel)
        out: ComplexArray = np.asarray(X)[..., None] * self.observed.rows[:, :, i]
        return out

    def on_equations(
        self, balance: ComplexArray | float = 0, redundancy: ComplexArray | float = 0, joint: ComplexArray | float = 0
    ) -> ComplexArray:
        rig, out = self.observed.rig, np.zeros((len(self.frequency), 3), dtype=complex)
        out[:, 0] = balance if rig.has_balance else 0
        out[:, 1] = redundancy if rig.has_third else 0
        out[:, 2] = joint
        return out

    def _mean_and_period(self, channel: str) -> ComplexArray:
        """Spectrum of :meth:`averaged`."""
        X = np.where(self.on_period, self.masked(channel), 0)
        X[0] = self.observed.channel(channel)[0]
        return X

    def _repeated(self, X: ComplexArray) -> Array:
        """Period lines of a spectrum along time, without the mean."""
        return self.observed.in_time(np.where(self.on_period, X, 0))
