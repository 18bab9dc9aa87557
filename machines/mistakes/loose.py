"""Motions that nothing holds or nothing dampens although the tool, or the file, needs them to be."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

import numpy as np

from jointlib.arrays import Array

from ..components.connection import GROUND
from ..components.rigid import Rigid
from ..model.machine import Machine
from ..modes.mode_energy import mode_energies
from ..modes.mode_words import dissipaters, holders
from ..modes.natural_modes import NaturalModes
from .contacts import words

_ROUNDING = 1e-6
_PARALLEL = 0.999
_UNDAMPED = 1e-4
"""Damping ratio; machine tools have 0.01 to 0.1 (Koenigsberger, Tlusty, Machine Tool Structures, 1970), a spindle in
steel alone some 0.001, and nothing that is clamped or guided less than a tenth of that."""


def loose(modes: NaturalModes, told: Sequence[Array] = ()) -> Iterator[str]:
    """Free motions that the tool feels, and bodies that can drift in a machine that stands on the ground.

    That a spindle turns freely, which translates nothing, is as it should be. What drifts along a direction that is
    ``told`` of already follows from that, and so does a tool that goes with it.
    """
    machine, free = modes.machine, modes.free
    if not free.shape[1]:
        return
    size = np.max(np.abs(free))
    drifts = list(_drifts(modes))
    if told and drifts and all(_along(direction, told) for _, direction in drifts):
        return
    for axis, row in zip(machine.tool_axes, machine.dof_rows(machine.tool_dofs, "[tool]"), strict=True):
        if np.max(np.abs(row @ free)) > _ROUNDING * size:
            yield (
                f"tool: nothing holds it in {axis} against a constant force, a free motion takes it along; expected a "
                "connection, a drive for example, that does"
            )
    if not _stands(machine):
        return
    for part, direction in drifts:
        if not _along(direction, told):
            yield (
                f"{part}: nothing holds it along {words(direction)}, it drifts freely; expected a connection there, a "
                "screw for example"
            )


def _drifts(modes: NaturalModes) -> Iterator[tuple[str, Array]]:
    """Rigid bodies that can drift, and where to."""
    machine, free = modes.machine, modes.free
    size, start = np.max(np.abs(free)), 0
    for part in machine.components:
        if isinstance(part, Rigid):
            moved = free[start : start + 3]
            U, singular, _ = np.linalg.svd(moved, full_matrices=False)
            yield from ((part.name, direction) for direction in U.T[singular > _ROUNDING * size])
        start += len(part.dofs)


def _along(direction: Array, others: Sequence[Array]) -> bool:
    return any(abs(float(direction @ other)) > _PARALLEL for other in others)


def _stands(machine: Machine) -> bool:
    return any(GROUND in c.between for c in machine.connections)


def undamped(modes: NaturalModes, told: Collection[str] = ()) -> Iterator[str]:
    """Modes that the tool feels and next to nothing dampens: they chatter at no depth at all, or feed themselves.

    That of a bundle whose missing damping is ``told`` already follows from it.
    """
    if not modes.machine.tool:
        return
    felt = np.flatnonzero(modes.felt & (modes.damping_ratio < _UNDAMPED))
    if not len(felt):
        return
    energies = mode_energies(modes)
    first = int(felt[np.argmax(modes.tool_peak[felt])])
    losses = dissipaters(modes, energies, first)
    holder = max(holders(modes, energies, first).items(), key=lambda item: item[1], default=("", 0.0))[0]
    held, lost = holder.strip("()"), max(losses.items(), key=lambda item: item[1], default=("", 0.0))
    ratio = modes.damping_ratio[first]
    others = f" (and {len(felt) - 1} more)" if len(felt) > 1 else ""
    if ratio < -_ROUNDING:
        yield f"the mode at {modes.frequency[first]:.5g} Hz{others} grows by itself: its damping ratio is {ratio:.2g}"
        return
    because = f"; what little there is comes from {lost[0].strip('()')}" if lost[1] > 0 and ratio > _ROUNDING else ""
    said = (
        f"the mode at {modes.frequency[first]:.5g} Hz that the tool feels{others} is undamped, its damping ratio is "
        f"{abs(ratio):.2g}: "
    )
    if held in told:
        return
    if losses.get(holder, 0.0) > _ROUNDING:
        yield (
            f"{said}the damping of {held} holds next to nothing at so low a frequency; expected 0.01 to 0.1 of a "
            "machine: is its damping too low, or does it carry too much?"
        )
        return
    yield (
        f"{said}{held or 'what bends in it'} dissipates nothing{because}; expected 0.01 to 0.1 of a machine, give it a "
        "damping or a loss_factor, or the depths are too low by as much"
    )
