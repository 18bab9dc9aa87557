"""Which further measurement tells two explanations apart: both are computed at every place a force or sensor may go."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.joint import Joint

from ..harmonic_balance.newton import solve
from ..indices import Mask
from ..model.machine import Machine
from .forward import Forward, Points

_DOFS = 16
_LINES = 120
_FURTHER = (2.0, 4.0)
"""Forces above the highest one that was measured, times it."""
_WORTH = 1.5
"""A force that was not measured must separate so much better to be asked for."""


@dataclass(frozen=True)
class Separation:
    """A measurement, and by how many deviations of the noise two models differ there."""

    drive: str
    response: str
    force: float
    frequency: float
    """Hz, where they differ most."""
    deviations: float
    """There."""
    total: float
    """Root of the sum of squares over all lines."""
    measured: float
    """The largest difference, in deviations, where it was measured."""

    @property
    def words(self) -> str:
        """The advice in a sentence."""
        return (
            f"Measure the response of {self.response} to a force of {self.force:.3g} N on {self.drive}: there the two "
            f"models differ by up to {self.deviations:.3g} deviations of the noise (at {self.frequency:.4g} Hz), "
            f"against {self.measured:.2g} where it was measured."
        )


def separation(
    forward: Forward, sigma: Array, one: Sequence[Joint], other: Sequence[Joint], moving: tuple[int, ...]
) -> Separation | None:
    """The pair of drive and response, and the force, at which two machines differ most; None if nothing can be solved.

    The noise there is taken to be as large a share of the response as in the records.
    """
    points, machine = forward.points, forward.machine
    relative = float(np.sqrt(np.mean(sigma**2) / np.mean(np.abs(points.measured) ** 2)))
    dofs = _candidates(machine, forward)
    lines = np.unique(points.frequency)
    lines = lines[np.unique(np.linspace(0, len(lines) - 1, min(len(lines), _LINES)).astype(int))]
    levels = np.unique(points.force)
    measured = sorted({float(levels[0]), float(levels[-1])})
    forces = [*measured, *(float(levels[-1]) * f for f in _FURTHER)]
    grid = [(d, F) for d in range(len(dofs)) for F in forces]
    drive = np.repeat([d for d, _ in grid], len(lines))
    force = np.repeat([F for _, F in grid], len(lines))
    f = np.tile(lines, len(grid))
    none = np.zeros(len(f), dtype=np.intp)
    laid = Points(f, force, none, drive, none, np.ones(len(f), dtype=complex), np.ones(len(f)))
    wide = Forward.at_points(machine, laid, dofs, dofs)
    answers = [_everywhere(wide, joints, moving, measured[-1]) for joints in (one, other)]
    shape = (len(grid), len(lines), len(dofs))
    H1, H2 = (a.reshape(shape) for a, _ in answers)
    usable = (answers[0][1] & answers[1][1]).reshape(shape[:2])
    here = np.abs(_residuals(forward, one, moving) - _residuals(forward, other, moving)) / sigma
    now = float(np.max(here, initial=0.0))
    size = np.sqrt(np.mean(np.where(usable[:, :, None], np.abs(H1) ** 2, 0.0), axis=1))
    far = np.abs(H1 - H2) / np.maximum(relative * size[:, None, :], 1e-300)
    far = np.where(usable[:, :, None], far, 0.0)
    total = np.sqrt(np.sum(far**2, axis=1))
    # A level at which a curve is not found throughout is no level to advise.
    total[np.mean(usable, axis=1) < 0.9] = 0.0
    new = np.array([F not in measured for _, F in grid])
    total_weighted = np.where(new[:, None], total / _WORTH, total)
    if not np.any(total > 0):
        return None
    g, r = np.unravel_index(int(np.argmax(total_weighted)), total.shape)
    top = int(np.argmax(far[g, :, r]))
    return Separation(
        dofs[grid[g][0]], dofs[r], grid[g][1], float(lines[top]), float(far[g, top, r]), float(total[g, r]), now
    )


def _candidates(machine: Machine, forward: Forward) -> tuple[str, ...]:
    """Degrees of freedom that a force or sensor may be tried on: all of a small machine, of a large one a share."""
    first = dict.fromkeys([*forward.drives, *forward.responses, *machine.tool.values()])
    rest = [d for d in machine.dofs if d not in first]
    room = max(_DOFS - len(first), 0)
    if len(rest) > room:
        rest = [rest[i] for i in np.unique(np.linspace(0, len(rest) - 1, room).astype(int))] if room else []
    return (*first, *rest)


def _residuals(forward: Forward, joints: Sequence[Joint], moving: tuple[int, ...]) -> ComplexArray:
    answer = forward.answer(joints, moving)
    return np.asarray(np.where(answer.fine, answer.receptance, forward.points.measured))


def _everywhere(
    forward: Forward, joints: Sequence[Joint], moving: tuple[int, ...], known: float
) -> tuple[ComplexArray, Mask]:
    """Receptance to every response (points, responses), and where a solution inside the joints' ranges was found."""
    view, points = forward.view(moving), forward.points
    H = forward.linear(moving)[forward.line]
    n, at = len(forward.standing), np.arange(len(points))
    outputs = list(range(n, n + len(forward.responses)))
    f = n + len(forward.responses) + points.drive
    direct = H[:, outputs][at, :, f]
    found = solve(view, forward.movers(joints, moving), points.force)
    through = H[:, outputs][:, :, list(moving)]
    x = direct - (through @ found.force[:, :, None])[:, :, 0] / points.force[:, None]
    inside = found.converged.copy()
    for j, i in enumerate(moving):
        reach = joints[i].validity.get("amplitude", (0.0, np.inf))[1]
        # A level that was measured may pass the range; one that is advised must not.
        inside &= (np.abs(found.z[:, j]) <= reach) | (points.force <= known)
    return x, inside & np.all(np.isfinite(x), axis=1)
