"""One record as rows of a regression: measured force against the force of a joint along the measured motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.identification.force_samples import RestoringForce
from jointlib.joint import Joint

Groups: TypeAlias = NDArray[np.int64]

BLOCKS = 25
"""Stretches into which a record in time is cut; noise is taken as independent between them, not within."""


@dataclass(frozen=True)
class ForceBalance:
    """``target`` = rows(joint force along z, ż) + extra @ unknowns + noise.

    A periodic record becomes the real and imaginary parts of its spectral lines, scaled so that the mean square of
    the rows is the mean square of the signal; any other one stays in time. Rows of one ``group`` share their noise.
    """

    name: str
    z: Array
    """m."""
    v: Array
    """m/s."""
    time_step: float
    """s."""
    target: Array
    """Measured force in rows, N."""
    rows: Callable[[Array], Array]
    """From a force along the path to rows."""
    groups: Groups
    peak: float
    """Largest measured force in N."""
    run_in: int = 0
    """Samples from the end of a closed path that a joint with memory walks first, to forget its virgin state."""
    extra: Array | None = None
    """Further linear columns, shape (rows, number of unknowns)."""

    def of(self, joint: Joint) -> Array:
        """The force of a joint, in rows."""
        if not joint.states:
            return self.rows(joint.force_along(self.z, self.v))
        z, v = self.path()
        return self.rows(joint.force_along(z, v, self.time_step)[-len(self.z) :])

    def path(self) -> tuple[Array, Array]:
        """Displacement and velocity with the run-in before them."""
        start = len(self.z) - self.run_in
        return np.concatenate([self.z[start:], self.z]), np.concatenate([self.v[start:], self.v])


def balance_of(surface: RestoringForce) -> ForceBalance:
    """Rows of a rig record."""
    n, inside = len(surface.z), surface.inside
    peak = float(np.max(np.abs(surface.f[inside])))
    if surface.periodic:
        lines = np.flatnonzero(surface.gain)
        factor = np.sqrt(2) / n * np.sqrt(2 * len(lines))

        def spectral(force: Array) -> Array:
            kept = np.fft.rfft(force)[lines] * factor
            return np.concatenate([kept.real, kept.imag])

        groups: Groups = np.tile(np.arange(len(lines), dtype=np.int64), 2)
        target = spectral(surface.f)
        return ForceBalance(
            surface.name, surface.z, surface.v, 1 / surface.sample_rate, target, spectral, groups, peak, run_in=n // 4
        )

    def temporal(force: Array) -> Array:
        return surface.filtered(force)[inside]

    target = surface.f[inside]
    groups = blocks(len(target))
    return ForceBalance(surface.name, surface.z, surface.v, 1 / surface.sample_rate, target, temporal, groups, peak)


def blocks(samples: int) -> Groups:
    """Block number of every sample."""
    return np.minimum(np.arange(samples, dtype=np.int64) * BLOCKS // max(samples, 1), BLOCKS - 1)


def stacked_groups(balances: tuple[ForceBalance, ...]) -> Groups:
    """Group numbers over all balances, none shared between two of them."""
    start, parts = 0, []
    for balance in balances:
        parts.append(balance.groups + start)
        start += int(balance.groups.max()) + 1
    return np.concatenate(parts)


def stacked_extra(balances: tuple[ForceBalance, ...]) -> Array:
    """Further columns of all balances, shape (rows, number of unknowns)."""
    widths = {0 if b.extra is None else b.extra.shape[1] for b in balances}
    if len(widths) > 1:
        raise InputError("identify: rig and path records in one fit, expected records of one kind")
    return np.concatenate([np.empty((len(b.target), 0)) if b.extra is None else b.extra for b in balances])
