"""All mistakes that a machine seems to hold, a sentence each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from jointlib.errors import InputError

from ..model.machine import Machine
from ..modes.natural_modes import NaturalModes, natural_modes
from ..statics.statics import NO_EQUILIBRIUM
from ..statics.working_point import tangents
from .axes import torn_apart, wrong_directions
from .bodies import wrong_bodies
from .contacts import wrong_contacts
from .doubled import doubled
from .elements import elements
from .forgotten import forgotten_damping
from .free_parts import strained_nodes
from .left_out import without_workpiece
from .loose import loose, undamped
from .loss_factors import short_losses
from .materials import oversized, wrong_beams, wrong_modes
from .operation import wrong_operation
from .shafts import odd_bearings, thick_shafts
from .tool_point import mixed_directions, wrong_tool_point


def mistakes(machine: Machine, modes: NaturalModes | None = None) -> tuple[str, ...]:
    """What looks like a mistake, by rules of the trade; nothing of a machine that is as machines are.

    ``modes`` are those at rest where they are known already. Where the machine has none (measured parts, joints that
    stick, beams of kilometres), what needs them is left out.
    """
    with np.errstate(all="ignore"):  # values far out of range overflow on the way
        said = list(in_file(machine))
        if modes is None and may_be_solved(machine):
            try:
                modes = natural_modes(machine)
            except InputError as error:
                # A machine that no load leaves at rest is told so beside its masses; here stands what may be the cause.
                if not (said and NO_EQUILIBRIUM in str(error)):
                    said.append(str(error).removeprefix(f"{machine.where}: "))
            except (np.linalg.LinAlgError, ValueError):
                said.append(
                    "its modes cannot be computed: stiffnesses, masses or dampings lie too far apart for floats"
                )
        if modes is not None:
            said += [*loose(modes), *undamped(modes), *short_losses(modes)]
    return tuple(dict.fromkeys(said))


def in_file(machine: Machine) -> tuple[str, ...]:
    """Those that show without the modes."""
    said = [
        *wrong_beams(machine),
        *thick_shafts(machine),
        *odd_bearings(machine),
        *wrong_modes(machine),
        *wrong_operation(machine),
    ]
    said += [*mixed_directions(machine), *wrong_tool_point(machine), *without_workpiece(machine)]
    said += torn_apart(machine)
    if oversized(machine):  # such a beam would be cut into more elements than there is memory for
        return tuple(said)
    found = elements(machine)
    said += strained_nodes(machine)
    said += wrong_bodies(machine, found)
    said += wrong_contacts(machine, found)
    said += forgotten_damping(machine, found)
    said += wrong_directions(machine, found)
    said += doubled(machine, found)
    return tuple(dict.fromkeys(said))


def may_be_solved(machine: Machine) -> bool:
    """Whether its modes can be asked for: every part has equations of a size, every joint gives way."""
    if oversized(machine) or any(c.joint is None for c in machine.flexible) or machine.without_equations:
        return False
    return bool(np.all(np.isfinite(tangents(replace(machine, static=None), 1.0))))
