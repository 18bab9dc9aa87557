"""Suspects that are modes of the tool: elsewhere, damped otherwise, softened by speed or by slip, or missing."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from scipy.special import ndtr

from jointlib.arrays import Array

from .sampled_tool import Drawn
from .suspects import Suspect

_BEYOND, _HEARD, _FARTHEST = 1.6, 1.15, 4.0
"""Times the highest mode of the model up to which one may be missing; times the highest chatter that was heard, if that
is more; and times the highest mode again, at most."""
_NODES = 1.15 / 1.6
"""Times the same for which nodes lie closely enough: 2.9 to a period of the fastest that may be missing."""

_PLACED = 1.5
"""Times the lower end of its interval up to which the frequency of a mode is told by one number."""


@dataclass(frozen=True)
class ModeFrequency(Suspect):
    """A mode of the tool that lies elsewhere than the model has it, at every speed alike.

    Which share of that is another mass, and which another stiffness, nobody knows: ω² = k/m by a factor f² is k by
    f^(2 − 2s) and m by f^(−2s), 0 ≤ s ≤ 1.
    """

    mode: int
    at: float
    """Hz, in the model."""

    family: ClassVar[str] = "mode-frequency"
    parameters: ClassVar[tuple[tuple[str, str], ...]] = (("factor", "1"), ("mass_share", "1"))

    @property
    def member(self) -> str:
        return f"{self.at:.0f} Hz"

    def values(self, z: Array) -> Array:
        return np.stack([np.exp(0.05 * z[:, 0]), ndtr(z[:, 1])], axis=1)

    def changed(self, drawn: Drawn, values: Array, speed: float, depth: float) -> Drawn:
        factor, share = values.T
        moved = drawn.moved(self.mode, factor, np.ones(len(values)))
        moved.residue[:, self.mode] *= (factor ** (2 * share))[:, None, None]
        return moved

    def told(self, value: dict[str, float]) -> str:
        return f"the mode at {self.at:.0f} Hz lies at {self.at * value['factor']:.4g} Hz"


@dataclass(frozen=True)
class SpindleSoftening(Suspect):
    """A mode whose frequency falls with the speed of the spindle, as where bearings lose stiffness by it."""

    mode: int
    at: float
    fastest: float
    """rpm of the fastest cut, where the share is told."""

    family: ClassVar[str] = "spindle-softening"
    parameters: ClassVar[tuple[tuple[str, str], ...]] = (("share", "1"),)
    by_speed: ClassVar[bool] = True

    @property
    def member(self) -> str:
        return f"{self.at:.0f} Hz"

    def values(self, z: Array) -> Array:
        return np.asarray(0.06 * z)

    def changed(self, drawn: Drawn, values: Array, speed: float, depth: float) -> Drawn:
        factor = np.exp(-values[:, 0] * speed / self.fastest)
        return drawn.moved(self.mode, factor, np.ones(len(values)))

    def told(self, value: dict[str, float]) -> str:
        way = "falls" if value["share"] > 0 else "rises"
        return f"the mode at {self.at:.0f} Hz {way} by {100 * abs(value['share']):.2g} % up to {self.fastest:g} rpm"


@dataclass(frozen=True)
class ModeDamping(Suspect):
    """A mode that is damped otherwise than the model has it."""

    mode: int
    at: float

    family: ClassVar[str] = "mode-damping"
    parameters: ClassVar[tuple[tuple[str, str], ...]] = (("factor", "1"),)

    @property
    def member(self) -> str:
        return f"{self.at:.0f} Hz"

    def values(self, z: Array) -> Array:
        return np.asarray(np.exp(0.5 * z))

    def changed(self, drawn: Drawn, values: Array, speed: float, depth: float) -> Drawn:
        return drawn.moved(self.mode, np.ones(len(values)), values[:, 0])

    def told(self, value: dict[str, float]) -> str:
        return f"the mode at {self.at:.0f} Hz is damped {value['factor']:.3g} times as much"


@dataclass(frozen=True)
class MissingMode(Suspect):
    """A mode along one axis of the tool that the model does not have."""

    axis: int
    name: str
    low: float
    high: float
    """Hz of the modes that the model has."""
    compliance: float
    """m/N, dynamic, of the strongest of them along the axis: 1/(2kζ)."""
    heard: float = 0.0
    """Hz of the highest chatter that was heard; 0 where none was."""

    family: ClassVar[str] = "missing-mode"
    parameters: ClassVar[tuple[tuple[str, str], ...]] = (
        ("frequency", "Hz"),
        ("stiffness", "N/m"),
        ("damping_ratio", "1"),
    )

    @property
    def member(self) -> str:
        return self.name

    @property
    def highest(self) -> float:
        return _NODES * self.top

    @property
    def top(self) -> float:
        """Hz up to which it may lie."""
        return min(max(_BEYOND * self.high, _HEARD * self.heard), _FARTHEST * self.high)

    def values(self, z: Array) -> Array:
        share = 0.5 * (1 + np.tanh(0.8 * z[:, 0]))  # nearly even between both ends
        frequency = 0.6 * self.low * (self.top / (0.6 * self.low)) ** share
        ratio = np.minimum(0.03 * np.exp(0.4 * z[:, 2]), 0.5)
        peak = 0.7 * self.compliance * np.exp(0.7 * z[:, 1])
        return np.stack([frequency, 1 / (2 * ratio * peak), ratio], axis=1)

    def changed(self, drawn: Drawn, values: Array, speed: float, depth: float) -> Drawn:
        f, k, zeta = values.T
        omega = 2 * np.pi * f
        pole = omega * (-zeta + 1j * np.sqrt(1 - zeta**2))
        residue = np.zeros((len(f), 1, *drawn.residue.shape[2:]), dtype=complex)
        residue[:, 0, self.axis, self.axis] = omega**2 / k / (2j * pole.imag)
        return replace(
            drawn,
            poles=np.concatenate([drawn.poles, pole[:, None]], axis=1),
            residue=np.concatenate([drawn.residue, residue], axis=1),
        )

    def told(self, value: dict[str, float]) -> str:
        return f"a mode along {self.name} near {value['frequency']:.4g} Hz that the model does not have"

    def told_within(self, value: dict[str, float], inside: dict[str, tuple[float, float]]) -> str:
        low, high = inside["frequency"]
        if high <= _PLACED * low:
            return self.told(value)
        return f"a mode along {self.name} that the model does not have, from {low:.4g} to {high:.4g} Hz by these cuts"


@dataclass(frozen=True)
class JointSlip(Suspect):
    """A joint in a mode that slips at an amplitude, and so the deeper the cut, the more.

    A Jenkins element holds a share s of the mode's stiffness. The vibration that the teeth force grows with the depth;
    at r = b/b₀ times the amplitude of slip the element is worth (θ − sin 2θ/2)/π of its stiffness, cos θ = 1 − 2/r, and
    has the loss 4·(r − 1)/(π·r²) (the describing function of a stuck and slipping spring).
    """

    mode: int
    at: float
    usual: float
    """m, a depth in the middle of the cuts."""

    family: ClassVar[str] = "joint-slip"
    parameters: ClassVar[tuple[tuple[str, str], ...]] = (("share", "1"), ("depth", "m"))
    by_depth: ClassVar[bool] = True

    @property
    def member(self) -> str:
        return f"{self.at:.0f} Hz"

    def values(self, z: Array) -> Array:
        return np.stack([0.45 * ndtr(z[:, 0]), 0.6 * self.usual * np.exp(0.8 * z[:, 1])], axis=1)

    def changed(self, drawn: Drawn, values: Array, speed: float, depth: float) -> Drawn:
        share, r = values[:, 0], np.maximum(depth / values[:, 1], 1.0)
        theta = np.arccos(1 - 2 / r)
        stiffness = 1 - share + share * (theta - np.sin(2 * theta) / 2) / np.pi
        loss = share * 4 * (r - 1) / (np.pi * r**2)
        s = drawn.poles[:, self.mode]
        zeta = -s.real / np.abs(s)
        # The loss is that of a spring, c·ω = k·loss, and c of the mode stays.
        ratio = (1 + loss / (2 * zeta)) / np.sqrt(stiffness)
        return drawn.moved(self.mode, np.sqrt(stiffness), ratio)

    def told(self, value: dict[str, float]) -> str:
        return (
            f"a joint that holds {100 * value['share']:.2g} % of the mode at {self.at:.0f} Hz slips from a depth of "
            f"{1e3 * value['depth']:.2g} mm on"
        )
