"""The lowest depth while the tool vibrates with an amplitude: every joint held at the gain that it has there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import Outcome

from ..cutting.amplitude.chattering_tool import chattering_point, on_lines
from ..cutting.loops.regeneration import limiting_depth
from ..cutting.process.cutting import Cutting
from ..operating.operating_point import OperatingPoint
from ..tool.chatter_band import chatter_band
from .natural_modes import NaturalModes

_STRONG = 0.02
"""Share of the largest compliance at the tool from which on a mode gets lines of its own."""
_WIDTHS, _PER_MODE = 4.0, 7
"""Of these lines: how far to each side in |Re s|, and how many."""
_OVER_BAND = 40
"""Lines over the whole band beside them."""
_LOOKED_INTO = 2
"""Lowest dips between lines that are followed down."""
_FINER = 11
"""Lines between the two beside a dip."""
_CLOSE = 60.0
"""Share of the last interval that the lines of the last parabola span."""


@dataclass(frozen=True, eq=False)
class HeldDepth:
    """The lowest depth over all spindle speeds at an amplitude, and what the joints are there."""

    depth: float
    """m; inf where the cut never chatters."""
    frequency: float
    """Chatter frequency in Hz."""
    gain: ComplexArray
    """Gain of every joint in N/m at that frequency, (joints,)."""
    warnings: tuple[str, ...]


def held_depth(modes: NaturalModes, cutting: Cutting, loop: Array) -> HeldDepth:
    """Lowest −1/(2 Re λ) over the frequency, λ the eigenvalues of D·G(ω; A) with ``loop`` D in N/m².

    At every frequency the joints have the gain at which the tool vibrates with `NaturalModes.amplitude` along the force
    that chatters first there, as in `lobes_at_amplitude`, whose minimum this is.
    """
    machine, A = modes.machine, modes.amplitude
    band = chatter_band(machine)

    def depths(lines: Array) -> Array:
        return _depths(loop, on_lines(machine, cutting, lines, A))

    strong = modes.pole[modes.tool_peak > _STRONG * np.max(modes.tool_peak, initial=0.0)]
    near = (np.abs(strong) + np.abs(strong.real) * np.linspace(-_WIDTHS, _WIDTHS, _PER_MODE)[:, None]).ravel()
    near = near / (2 * np.pi)
    near = near[(near > band.low) & (near < band.high)]
    lines = np.union1d(np.geomspace(band.low, band.high, _OVER_BAND), near)
    found = depths(lines)
    if not np.any(np.isfinite(found)):
        return HeldDepth(np.inf, np.nan, np.zeros(0, dtype=complex), band.said)
    dips = np.flatnonzero((found <= np.append(np.inf, found[:-1])) & (found <= np.append(found[1:], np.inf)))
    for count in (_LOOKED_INTO, 1, 1):
        dips = dips[np.argsort(found[dips], kind="stable")][:count]
        near = np.concatenate([np.linspace(*_beside(lines, i), _FINER) for i in dips.tolist()])
        near = np.setdiff1d(near, lines)
        lines, found = np.append(lines, near), np.append(found, depths(near))
        order = np.argsort(lines)
        lines, found = lines[order], found[order]
        dips = np.array([np.argmin(found)])
    i = int(dips[0])
    frequency = _vertex(lines, found, i)
    if 0 < i < len(lines) - 1:  # slopes are off by ∂²b/∂ω∂K times what the frequency is off
        near = frequency + np.array([-1.0, 0.0, 1.0]) * (lines[i + 1] - lines[i - 1]) / _CLOSE
        frequency = _vertex(near, depths(near), 1)
    point = chattering_point(machine, cutting, frequency, A)[0]
    said = list(band.said)
    if point.outcomes[0] is not Outcome.CONVERGED:
        said.append(
            f"At {frequency:.4g} Hz, where the depth is lowest, a joint is held at its limit "
            f"({point.outcomes[0].value})."
        )
    return HeldDepth(float(_depths(loop, point)[0]), frequency, np.asarray(point.gain[0]), tuple(said))


def _depths(loop: Array, point: OperatingPoint) -> Array:
    """Limiting depth in m on every line."""
    value: ComplexArray = np.linalg.eigvals(loop @ point.frf.receptance).astype(complex)
    return np.asarray(np.min(limiting_depth(value), axis=1))


def _beside(lines: Array, i: int) -> tuple[float, float]:
    return float(lines[max(i - 1, 0)]), float(lines[min(i + 1, len(lines) - 1)])


def _vertex(lines: Array, depth: Array, i: int) -> float:
    """Frequency in Hz at which the parabola through a lowest depth and its neighbours is lowest."""
    if not 0 < i < len(lines) - 1 or not np.all(np.isfinite(depth[i - 1 : i + 2])):
        return float(lines[i])
    left, right = lines[i] - lines[i - 1], lines[i + 1] - lines[i]
    fall, rise = (depth[i] - depth[i - 1]) / left, (depth[i + 1] - depth[i]) / right
    if not rise > fall:
        return float(lines[i])
    # The slope is fall at the middle of the left interval and rise at that of the right one, a straight line between.
    at = lines[i] - left / 2 - fall * (left + right) / 2 / (rise - fall)
    return float(np.clip(at, lines[i - 1], lines[i + 1]))
