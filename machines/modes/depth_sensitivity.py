"""What the lowest stable depth owes to every joint: first-order perturbation of the cut's loop."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.laws.linear import Linear

from ..cutting.amplitude.frozen_lobes import lobes_at_amplitude
from ..cutting.loops.regeneration import wave_fraction
from ..cutting.process import turning, zero_order
from ..cutting.process.chart import StabilityLobes
from ..cutting.process.cutting import Cutting
from ..cutting.process.flutes import UNLIKE
from ..harmonic_balance.assembly import Assembly
from ..indices import Index
from ..model.machine import Machine
from ..statics.working_point import at_working_point, tangents
from .held_depth import HeldDepth, held_depth
from .natural_modes import NaturalModes, natural_modes

_ANY_SPEED = 1000.0
"""rpm; the lowest depth over all speeds does not depend on it."""
_SPEEDS = 200


@dataclass(frozen=True, eq=False)
class DepthSensitivity:
    """The lowest depth over all spindle speeds and d ln b/d ln K of every joint, its damping unchanged.

    At an amplitude every joint is held at the gain that it has while the tool vibrates so far, at every frequency its
    own, and stays so while the stiffness of one of them changes: what that does to the amplitudes of the joints, and so
    to their gains, is left out. In turning that depth is exact; in milling it is that of the zero-order approximation,
    which alone is smooth in the joints: the depths of exact methods touch it or pass from lobe to lobe.

    It is told of straight edges, evenly spaced, that rub on nothing. A helix leaves the mean of the cut as it is, with
    unequal pitches no depth of the mean is lower (−b Re λ = Re 1/(1 − p) ≥ 1/2, as the mean p of the delays has
    |p| ≤ 1), and what flanks damp fades as the speed grows.
    """

    depth: float
    """b in m."""
    frequency: float
    """Chatter frequency in Hz."""
    method: str
    joints: Array
    """(joints,)."""
    mode: int
    """The mode that limits the depth: the one that adds most to the negative real part of the loop there."""
    warnings: tuple[str, ...]
    wave: float
    """ψ, the fraction of a wave between two cuts at the lowest depth: lobes touch it at 60 f/(N (k + ψ)) rpm."""
    machine: Machine
    """The machine that it is told of."""
    gain: ComplexArray
    """Gain of every joint in N/m at the chatter frequency, (joints,)."""
    amplitude: float = 0.0
    """Tool-point amplitude in m that the joints are held at; 0: at rest."""
    instead: str = ""
    """What the cut has that it is told without, in words."""

    @property
    def missed(self) -> tuple[float, float] | None:
        """The speeds of the file in rpm, low and high, where no lobe touches the lowest depth at any of them."""
        cutting = Cutting(**(self.machine.cutting or {}))
        if cutting.speed is None:
            return None
        fewest, most = (60 * self.frequency / (cutting.cuts_per_revolution * n) for n in reversed(cutting.speed))
        return None if max(np.ceil(fewest - self.wave), 0.0) + self.wave <= most else cutting.speed

    def at_its_speeds(self, modes: NaturalModes) -> tuple[float, float, int] | None:
        """Lowest depth in m, chatter frequency in Hz and limiting mode at the speeds of the file; None if it has none.

        By the same method, at rest and at `_SPEEDS` speeds; at an amplitude it is not computed.
        """
        cutting = Cutting(**(self.machine.cutting or {}))
        if cutting.speed is None or self.amplitude:
            return None
        chart = lobes_at_amplitude(self.machine, cutting.speeds(_SPEEDS), 0.0, self.method)
        if not np.any(np.isfinite(chart.depth)):
            return None
        i = int(np.argmin(chart.depth))
        f = float(chart.chatter_frequency[i])
        limiting = _loop_at(self.machine, modes, f, tangents(self.machine, f)[0])[1]
        return float(chart.depth[i]), f, limiting

    def stiffer(self, joints: Index, share: float) -> float:
        """The depth in m, computed again, where these joints have ``share`` more stiffness than `gain`.

        They get a spring beside them, so that their damping stays. The slope tells of small changes only: past a
        maximum of the depth, or where another mode begins to limit it, more stiffness may do the opposite.
        """
        changed = at_working_point(self.machine)
        held, own = changed.flexible, changed.joints()
        beside = {held[i].name: own[i] + Linear(share * float(self.gain[i].real)) for i in joints}
        return _lowest(changed.with_joints(beside), self.amplitude).depth


def lowest_depth(machine: Machine) -> StabilityLobes:
    """The chart whose `minimum_depth` is the lowest depth over all speeds, at rest."""
    return lobes_at_amplitude(machine, [_ANY_SPEED], 0.0, _method(machine))


def depth_sensitivity(modes: NaturalModes) -> DepthSensitivity | None:
    """Sensitivity of the lowest depth b = −1/(2 Re λ) to the joints; None where the cut never chatters.

    λ is an eigenvalue of D·G(ω), G the receptance of the tool. At the lowest depth ∂b/∂ω = 0, so that
    d ln b = −Re dλ/Re λ at its frequency, with dG = −H_tz dK H_zt of the coupled machine: no lobe is computed again.
    dK is K = Re G of the joint there, times its relative change.

    Parameters
    ----------
    modes
        Of a machine with ``[cutting]``, at rest or at an amplitude.
    """
    machine = modes.machine
    if machine.cutting is None:
        raise InputError(f"{machine.where}: no [cutting], the depth needs a cutting operation")
    unlike = Cutting(**machine.cutting).unlike
    if unlike:
        machine = replace(machine, cutting={k: v for k, v in machine.cutting.items() if k not in UNLIKE})
        modes = replace(modes, machine=machine)
    held = _lowest(machine, modes.amplitude, modes)
    if not np.isfinite(held.depth):
        return None
    f, gain = held.frequency, held.gain
    slope, mode, value = _loop_at(machine, modes, f, gain)
    return DepthSensitivity(
        held.depth,
        f,
        _method(machine),
        slope,
        mode,
        held.warnings,
        float(wave_fraction(np.asarray(value))),
        machine,
        gain,
        modes.amplitude,
        unlike,
    )


def _loop_at(machine: Machine, modes: NaturalModes, f: float, gain: ComplexArray) -> tuple[Array, int, complex]:
    """d ln b/d ln K of every joint at a frequency in Hz, the mode that adds most there, and the eigenvalue λ."""
    D, axes = _loop(machine), machine.tool_axes
    H = _closed(Assembly(machine, machine.tool_dofs, machine.tool_dofs).free(np.array([2 * np.pi * f]))[0], gain)
    joints, tool = slice(0, len(gain)), slice(len(gain), len(gain) + len(axes))
    values, vectors = np.linalg.eig(D @ H[tool, tool])
    first = int(np.argmin(values.real))
    v, w = vectors[:, first], np.linalg.inv(vectors)[first]
    moved = -(w @ D @ H[tool, joints]) * (H[joints, tool] @ v) * gain.real
    added = (w @ D @ modes.tool) * (modes.tool.T @ v) / (2 * modes.pole * (2j * np.pi * f - modes.pole))
    return np.asarray(-moved.real / values[first].real), int(np.argmin(added.real)), complex(values[first])


def _method(machine: Machine) -> str:
    assert machine.cutting is not None
    return "zero-order" if machine.cutting.get("process") == "milling" else "turning"


def _loop(machine: Machine) -> Array:
    """D in N/m² between the axes of the tool."""
    cutting, axes = Cutting(**(machine.cutting or {})), machine.tool_axes
    if cutting.process == "milling":
        return zero_order.loop_stiffness(cutting, axes)
    share = cutting.rotation[0][["xy".index(axis) for axis in axes]]
    return np.asarray(turning.loop_stiffness(cutting)[0, 0] * np.outer(share, share))


def _lowest(machine: Machine, amplitude: float, modes: NaturalModes | None = None) -> HeldDepth:
    """The lowest depth over all speeds, at rest or at an amplitude in m, and the joints there."""
    if amplitude > 0:
        held = modes or natural_modes(machine, amplitude)
        return held_depth(held, Cutting(**(machine.cutting or {})), _loop(machine))
    chart = lowest_depth(machine)
    f = chart.minimum_frequency
    gain = tangents(machine, f)[0] if np.isfinite(chart.minimum_depth) else np.zeros(0, dtype=complex)
    return HeldDepth(chart.minimum_depth, f, gain, chart.warnings)


def _closed(H: ComplexArray, gain: ComplexArray) -> ComplexArray:
    """Receptance between joints and tool, ports in this order and the tool twice, with the joints closed."""
    n = len(gain)
    return np.asarray(H - H[:, :n] @ np.linalg.solve(np.eye(n) + gain[:, None] * H[:n, :n], gain[:, None] * H[:n]))
