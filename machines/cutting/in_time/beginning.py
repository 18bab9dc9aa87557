"""How a simulated cut begins: the machine in harmonic motion, and the surface that it left before."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ...indices import Mask
from ...model.machine import Machine
from ..amplitude.chattering_tool import chattering_point
from ..process.cutting import Cutting
from ..process.stretch import Stretch
from .moving_parts import MovingParts, moving_parts
from .surface import Surface

_SLOWLY = 1e-3
"""Of the chatter frequency: a force so slow bends a machine aside as one at rest does, and moves a free one whole."""


def vibrating(
    machine: Machine, cutting: Cutting, hertz: float, amplitude: Array, phase: float, aside: Mask | None = None
) -> tuple[MovingParts, Array, ComplexArray, ComplexArray]:
    """The machine in harmonic motion at time 0 with each tool amplitude: its states, and phasors of joints and tool.

    Those ``aside`` stand still instead, bent by a force at the tool along the axis that chatters most.
    """
    omega = 2 * np.pi * hertz
    points = [chattering_point(machine, cutting, hertz, float(A)) for A in amplitude]
    middle = points[len(points) // 2][0].joint_amplitude[0]
    parts = moving_parts(machine, middle, omega)
    j = len(parts.rest)
    states = []
    let_go = np.zeros(len(amplitude), dtype=bool) if aside is None else aside
    for (point, direction), A, still in zip(points, amplitude, let_go, strict=True):
        sizes = point.joint_amplitude[0][list(parts.index)]
        gains = np.array(
            [
                complex(part.first_harmonic(max(a, 1e-12), omega).gain)
                for part, a in zip(parts.rest, sizes, strict=True)
            ],
            dtype=complex,
        )
        phasor = parts.harmonic(omega, gains, direction)
        tip = (parts.P @ phasor)[2 * j : 2 * j + parts.tool]
        largest, turned = np.argmax(np.abs(tip)), np.exp(1j * phase)
        if still:
            pull = np.eye(parts.tool, dtype=complex)[largest]
            phasor = parts.harmonic(_SLOWLY * omega, parts.spring.astype(complex), pull).real.astype(complex)
            tip, turned = (parts.P @ phasor)[2 * j : 2 * j + parts.tool], np.exp(0j)
        # With phase 0 the moment of the largest excursion is time 0.
        states.append(phasor * A * turned / tip[largest])
    moving = np.stack(states, axis=1)
    y = parts.P @ moving
    return parts, moving.real.copy(), y[:j], y[2 * j : 2 * j + parts.tool]


def begins(cut: tuple[Stretch, ...]) -> Array:
    """Times in s, before 0, at which the stretches of the period before begin."""
    lengths = np.array([s.steps * s.step for s in cut])
    return np.asarray(np.cumsum(lengths) - lengths - np.sum(lengths))


def ploughed(stretch: Stretch, begins: float, tool: ComplexArray, hertz: float) -> Surface:
    """Surface that the tool in harmonic motion left in the period before time 0."""
    omega = 2 * np.pi * hertz
    time = begins + stretch.step * np.arange(stretch.steps + 1)
    turned = tool * np.exp(1j * omega * time)[:, None, None]
    x, v = turned.real, (1j * omega * turned).real
    return Surface.ploughed(stretch, x, v)
