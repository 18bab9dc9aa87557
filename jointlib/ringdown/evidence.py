"""Backbones of several decays against a joint: residual in stiffness and damping, in units of what is known of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.measurement import Measurement
from jointlib.ringdown.backbone import Backbone
from jointlib.ringdown.free_gain import free_gain, grid

DRIFT = 1e-3
"""Of a natural frequency, by which a structure differs from one record to the next (standard deviation)."""
FORM = 0.01
"""Of what an effect makes of k and ωc, by which averaging and the shape of a law may be off."""


@dataclass(frozen=True)
class Evidence:
    """The first mode of every decay, with the mass that carries it."""

    backbones: tuple[Backbone, ...]
    modal_mass: float

    @property
    def alone(self) -> bool:
        """No other mode stands out of any record."""
        return all(b.alone for b in self.backbones)

    @cached_property
    def amplitudes(self) -> Array:
        """m, the grid on which a gain is worked out."""
        every = np.concatenate([b.amplitude for b in self.backbones])
        return grid(float(np.min(every)), float(np.max(every)))

    @cached_property
    def omegas(self) -> Array:
        """rad/s, as measured at the amplitudes of the grid."""
        a, w = (np.concatenate([getattr(b, name) for b in self.backbones]) for name in ("amplitude", "omega"))
        order = np.argsort(a)
        return np.asarray(np.interp(self.amplitudes, a[order], w[order]))

    @cached_property
    def _doubts(self) -> tuple[Array, ...]:
        """N/m; standard deviations of k and ωc, shape (2, pieces) by record.

        What an effect makes of k is known by the span of k alone. Of ωc it makes no more than there is at an amplitude:
        friction that is large at small ones excuses nothing at large ones. A loop trades one for the other, so that ωc
        is in doubt by the span of k as well, up to its own.
        """
        spans = np.max([np.ptp(b.smoothed, axis=1) for b in self.backbones], axis=0)
        out = []
        for b in self.backbones:
            error = np.array([b.stiffness_error, b.omega * b.damping_error])
            loss = np.minimum(spans[1], np.hypot(b.smoothed[1], spans[0]))
            form = FORM * np.array([np.full(len(b), spans[0]), loss])
            out.append(self.modal_mass * np.hypot(error, form))
        return tuple(out)

    def gains(self, joint: Joint) -> ComplexArray:
        """G in N/m on the grid."""
        return free_gain(joint, self.amplitudes, self.omegas, self.modal_mass, alone=self.alone)

    def left(self, joint: Joint) -> tuple[ComplexArray, ...]:
        """Measured minus modelled gain in N/m, by record."""
        model = self.at_pieces(self.gains(joint))
        return tuple(self.modal_mass * b.gain - one for b, one in zip(self.backbones, model, strict=True))

    def at_pieces(self, gains: ComplexArray) -> tuple[ComplexArray, ...]:
        """Gains on the grid, at the amplitudes of each record."""
        along = scipy.interpolate.CubicSpline(np.log(self.amplitudes), gains)
        return tuple(along(np.log(b.amplitude)) for b in self.backbones)

    def damping(self) -> tuple[Array, Array]:
        """1/doubt in m/N, and ωc measured in units of it; the pieces of all records."""
        weight = np.concatenate([1 / one[1] for one in self._doubts])
        return weight, weight * self.modal_mass * np.concatenate([b.gain.imag for b in self.backbones])

    def residual(self, joint: Joint, records: Sequence[int] | None = None) -> Array:
        """Real, of unit variance: k before ωc, record after record.

        The stiffness of one record is off by a common share of its own (`DRIFT`), which is taken out by the root of
        the inverse of 1 + d dᵀ.
        """
        return np.concatenate(self.whitened(joint, records))

    def whitened(self, joint: Joint, records: Sequence[int] | None = None) -> list[Array]:
        """The residual by record."""
        left = self.left(joint)
        return self.whiten(left if records is None else [left[i] for i in records], records)

    def whiten(self, left: Sequence[ComplexArray], records: Sequence[int] | None = None) -> list[Array]:
        """Gains in N/m at the pieces of records, in units of what is known of them."""
        out = []
        for i, one in zip(range(len(left)) if records is None else records, left, strict=True):
            doubt = self._doubts[i]
            r = np.array([one.real, one.imag]) / doubt
            d = 2 * DRIFT * self.modal_mass * self.backbones[i].stiffness / doubt[0]
            size = float(d @ d)
            r[0] = r[0] - d * (d @ r[0]) * (1 - 1 / np.sqrt(1 + size)) / size
            out.append(r.ravel())
        return out

    def share(self, joint: Joint, records: Sequence[int] | None = None) -> float:
        """rms of what is left over rms of the force, each piece weighed by its amplitude."""
        left, chosen = self.left(joint), range(len(self.backbones)) if records is None else records
        over = sum(float(np.sum(np.abs(left[i] * self.backbones[i].amplitude) ** 2)) for i in chosen)
        force = [self.modal_mass * self.backbones[i].gain * self.backbones[i].amplitude for i in chosen]
        return float(np.sqrt(over / sum(float(np.sum(np.abs(f) ** 2)) for f in force)))


def free_of(joint: Joint) -> list[str]:
    """Parameters that a decay is asked for: all but what is fixed, angles and exponents."""
    return [n for n, unit in joint.units.items() if n not in joint.fixed and unit not in ("rad", "1")]


def evidence_of(measurement: Measurement, found: Sequence[Sequence[Backbone]]) -> Evidence:
    """The evidence of a measurement whose modal mass is known."""
    mass = measurement.carriage
    if mass is None or mass.value is None:
        raise InputError(
            f"{measurement.source}: modal_mass is missing, expected the modal mass in kg at the place where the motion "
            "is measured: a free decay tells stiffness and damping over the mass only"
        )
    return Evidence(tuple(modes[0] for modes in found), mass.value)
