"""The contract of a fault of the rig or its sensors: what no joint law can mend, undone on reading instead."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Protocol

import numpy as np
import scipy
from numpy.typing import NDArray

from jointlib.arrays import Array, ComplexArray
from jointlib.measurement import Mass

Shape = Mapping[str, float]


class RigRecord(Protocol):
    """One record of a rig in its periodic steady state, as a fault sees it.

    Spectra stand on ``frequency`` (Hz, the mean first), in unit of the channel times samples. Equations are ordered
    balance B = P − m1 a1 − m2 a2 − m3 a3, redundancy R = a2 − a3, joint J = m2 a2 + m3 a3 − f(z, ż).
    """

    @property
    def name(self) -> str: ...
    @property
    def frequency(self) -> Array: ...
    @property
    def omega(self) -> Array:
        """rad/s."""
        ...

    @property
    def on_period(self) -> NDArray[np.bool_]:
        """True on the lines of the excitation period."""
        ...

    @property
    def time(self) -> Array:
        """s since the first sample of the record file, (samples,); the run-in before is not part of it."""
        ...

    @property
    def masses(self) -> Mapping[str, float]:
        """kg that move with each accelerometer: {"a1": m1, "a2": m2, "a3": m3}, those that are known."""
        ...

    def suspension(self, channel: str) -> tuple[float, float]:
        """N/m and N s/m that hold what moves with an accelerometer to ground, as far as it is known."""
        ...

    @property
    def displacement(self) -> Array:
        """z in m along ``time``, on the lines where it stands clear of its noise."""
        ...

    @property
    def position(self) -> Array | None:
        """Feed position in m along ``time``, where a channel measures it."""
        ...

    def has(self, channel: str) -> bool: ...

    def masked(self, channel: str) -> ComplexArray:
        """Spectrum of a channel where it stands clear of its noise, 0 elsewhere: what columns are made of."""
        ...

    def averaged(self, channel: str) -> Array:
        """A channel along ``time``: its masked averaged period, repeated, its mean included."""
        ...

    def predicted(self, channel: str) -> Array | None:
        """A channel along ``time`` as the others tell it through R or B (period average); None where they cannot."""
        ...

    def lines_of(self, signal: Array) -> ComplexArray:
        """Signals along ``time`` (last axis) as spectra on the lines."""
        ...

    def on_channel(self, channel: str, X: ComplexArray) -> ComplexArray:
        """What an additive error X (..., lines) on a channel does to B, R, J: shape (..., lines, 3)."""
        ...

    def on_equations(
        self, balance: ComplexArray | float = 0, redundancy: ComplexArray | float = 0, joint: ComplexArray | float = 0
    ) -> ComplexArray:
        """A column from its parts in B, R and J (lines each): shape (lines, 3)."""
        ...


@dataclass(frozen=True)
class Setting:
    """What undoing a fault needs to know beside the samples."""

    sample_rate: float
    first: int = 0
    """Index of the first given sample in the record; faults with a clock count from the beginning of the record."""
    periodic: bool = False
    """True where the samples are whole periods of a steady state, so that a shift wraps around."""
    masses: Mapping[str, float] = field(default_factory=dict)
    """kg that move with each accelerometer of a rig, those that are known."""

    def time(self, samples: int) -> Array:
        """s since the first sample of the record, as in :attr:`RigRecord.time`."""
        return np.asarray((self.first + np.arange(samples)) / self.sample_rate)


class Fault(ABC):
    """Something wrong with a sensor, a mass or the rig: measured = true + error.

    In a contest it stands as columns in B, R, J with linear coefficients and, where it has them, shape parameters.
    Once named it is written as a ``[[correction]]`` with the physical parameters of :meth:`correction`, and undone
    whenever the records are read. Constructed without arguments, found through ``jointlib.effects``.
    """

    family: ClassVar[str]
    words: ClassVar[str] = ""
    """The fault in a clause that follows "The records show"; ``{site}`` stands for the channel or body."""
    look_alikes: ClassVar[Mapping[str, str]] = {}
    """Families with a similar signature, each with the experiment that separates them."""
    declared_pairs: ClassVar[frozenset[str]] = frozenset()
    """Look-alikes that ordinary records can hardly tell apart; the own family stands for its other sites."""
    on: ClassVar[str] = "channel"
    """What ``site`` names: "channel", "body", "rig" (nothing) or "joint" (nothing; a modulation of the joint)."""
    parameters: ClassVar[Mapping[str, str]]
    """Parameters of a correction and their SI units; "1" is relative, "channel" the unit of the channel ("channel/s",
    "1/channel")."""
    per_record: ClassVar[bool] = False
    """True where every record has coefficients of its own (records share no clock); then halves of all records are
    held out instead of records."""
    biased: ClassVar[bool] = False
    """True where the estimate carries an error that no noise explains."""
    needs: ClassVar[frozenset[str]] = frozenset({"P"})
    """Channels without which the fault cannot be decided on a rig."""
    experiment: ClassVar[str] = ""
    """What would decide it where the channels are missing."""

    def sites(self, record: RigRecord) -> tuple[str, ...]:
        """Channels or bodies (named by their accelerometer) to try on a rig; ("",) where there is nothing to name."""
        named = {"channel": ("a1", "a2", "a3", "P"), "body": ("a1", "a2", "a3")}
        return tuple(c for c in named[self.on] if record.has(c)) if self.on in named else ("",)

    def shapes(self, records: Sequence[RigRecord], site: str) -> tuple[Shape, ...]:
        """Grid of shape parameters to try; one empty mapping where there is none, nothing where not applicable."""
        return ({},)

    @abstractmethod
    def columns(self, record: RigRecord, site: str, shape: Shape) -> ComplexArray:
        """What each coefficient being 1 does to (B, R, J): shape (coefficients, lines, 3). Not whitened.

        Whatever is made of a measured channel uses :meth:`RigRecord.masked`, else its noise biases the fit.
        """

    @abstractmethod
    def correction(self, coefficients: Array, shape: Shape) -> Mapping[str, float] | None:
        """The physical parameters; None where the coefficients are not physical (the sign rule)."""

    def possible(self, record: RigRecord, site: str, parameters: Mapping[str, float]) -> bool:
        """Whether the fault can have these parameters, where that depends on what is known of the rig."""
        return True

    def shows(self, parameters: Sequence[Mapping[str, float]], records: Sequence[RigRecord]) -> bool:
        """Whether what it is in all records, one mapping each or one for all, still is what it is named for."""
        return True

    def combined(self, known: Mapping[str, float], further: Mapping[str, float]) -> Mapping[str, float]:
        """One correction that stands for ``known`` undone first and ``further`` next; here coefficients add up.

        Called with the same shape parameters on both sides, which are kept.
        """
        return {n: v if n in self.shape_parameters else v + further[n] for n, v in known.items()}

    shape_parameters: ClassVar[frozenset[str]] = frozenset()
    """Those of ``parameters`` that are no linear coefficients."""

    def undo(
        self, channels: Mapping[str, Array], site: str, parameters: Mapping[str, float], setting: Setting
    ) -> Mapping[str, Array]:
        """The channels as they would have been without the fault."""
        return channels

    def mended_masses(
        self, bodies: Mapping[str, Mass], site: str, parameters: Mapping[str, float]
    ) -> Mapping[str, Mass]:
        """The masses as they should have been declared; ``site`` is the name of the body."""
        return bodies


_REFLECTED = 4096
"""Samples that a signal is carried on at its ends where it is shifted; how it goes on beyond does not matter."""


def shifted(x: Array, samples: float, periodic: bool) -> Array:
    """x(t + samples/rate): a signal advanced by a fraction of samples, band-limited.

    Periodic signals wrap around. Others are continued by odd reflection at both ends, so that nothing jumps there.
    """
    if periodic:
        spectrum = scipy.fft.rfft(x) * np.exp(2j * np.pi * scipy.fft.rfftfreq(len(x)) * samples)
        return np.asarray(scipy.fft.irfft(spectrum, len(x)))
    y = _continued(x)
    spectrum = scipy.fft.rfft(y) * np.exp(2j * np.pi * scipy.fft.rfftfreq(len(y)) * samples)
    return _inside(scipy.fft.irfft(spectrum, len(y), overwrite_x=True), len(x))


def slope_of(x: Array) -> Array:
    """dx/dt times the sample time of a signal that does not repeat, band-limited, continued as in :func:`shifted`."""
    y = _continued(x)
    spectrum = scipy.fft.rfft(y) * (2j * np.pi * scipy.fft.rfftfreq(len(y)))
    return _inside(scipy.fft.irfft(spectrum, len(y), overwrite_x=True), len(x))


def _continued(x: Array) -> Array:
    """A signal with odd reflections before and after, no longer than they matter, and a straight line from the end to
    the beginning, so that nothing jumps there and a spectrum of it is fast."""
    more = _reflected(len(x))
    before, after = 2 * x[0] - x[more:0:-1], 2 * x[-1] - x[-2 : -2 - more : -1]
    count = len(x) + 2 * more
    line = np.linspace(after[-1], before[0], scipy.fft.next_fast_len(count + more, real=True) - count + 2)[1:-1]
    return np.concatenate([before, x, after, line])


def _inside(continued: Array, count: int) -> Array:
    """The signal within what :func:`_continued` made of it."""
    more = _reflected(count)
    return np.asarray(continued[more : more + count])


def _reflected(count: int) -> int:
    return min(count - 1, _REFLECTED)
