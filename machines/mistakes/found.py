"""All mistakes that a machine seems to hold, a sentence each."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from jointlib.errors import InputError

from ..model.machine import Machine
from ..modes.natural_modes import NaturalModes, natural_modes
from ..statics.statics import NO_EQUILIBRIUM, UNHELD
from ..statics.working_point import tangents
from .axes import across, blocked_travels, torn_apart, wrong_directions
from .bodies import far_centres, wrong_bodies
from .contacts import wrong_contacts
from .cutter import band_of_none, wrong_cutter
from .doubled import doubled
from .elements import Element, elements
from .forgotten import forgotten_damping
from .free_parts import strained_nodes
from .left_out import without_workpiece
from .loose import loose, undamped
from .loss_factors import short_losses
from .materials import oversized, wrong_beams, wrong_modes
from .operation import hanging, wrong_operation
from .places import far_places, too_large, wrong_sizes
from .shafts import odd_bearings, thick_shafts
from .tool_point import mixed_directions, wrong_tool_point


def mistakes(machine: Machine, modes: NaturalModes | None = None) -> tuple[str, ...]:
    """What looks like a mistake, by rules of the trade; nothing of a machine that is as machines are.

    ``modes`` are those at rest where they are known already. Where the machine has none (measured parts, joints that
    stick, beams of kilometres), what needs them is left out, and so is what follows from a mistake that is named.
    """
    with np.errstate(all="ignore"):  # values far out of range overflow on the way
        seen = _seen(machine)
        said = list(seen.said)
        if seen.astray:
            return seen.said
        if modes is None and may_be_solved(machine):
            try:
                modes = natural_modes(machine)
            except InputError as error:
                said += _at_rest(machine, seen, str(error).removeprefix(f"{machine.where}: "))
            except (np.linalg.LinAlgError, ValueError):
                said.append(
                    "its modes cannot be computed: stiffnesses, masses or dampings lie too far apart for floats"
                )
        if modes is not None:
            crossed = list(across(modes, seen.elements))
            said += [*(sentence for sentence, _ in crossed), *([] if seen.bodies else band_of_none(modes))]
            said += loose(modes, [*blocked_travels(seen.elements), *(travel for _, travel in crossed)])
            if not seen.bodies:
                said += [*undamped(modes, seen.undamped), *short_losses(modes)]
    return tuple(dict.fromkeys(said))


def _at_rest(machine: Machine, seen: _Seen, refused: str) -> Iterator[str]:
    """Why nothing is known of the modes; a load that nothing holds or leaves at rest has a cause, which is told."""
    if refused.startswith(NO_EQUILIBRIUM):
        told = bool(seen.said)
    elif refused.startswith(UNHELD):
        told = seen.bodies or bool(blocked_travels(seen.elements))
        if not told:
            free = natural_modes(replace(machine, static=None))
            crossed = list(across(free, seen.elements))
            yield from (said for said, _ in crossed)
            told = bool(crossed)
            if not told:
                yield from loose(free, [])
    else:
        told = False
    if not told:
        yield refused


def in_file(machine: Machine) -> tuple[str, ...]:
    """Those that show without the modes."""
    return _seen(machine).said


@dataclass(frozen=True)
class _Seen:
    """What shows without the modes, and what may follow from it."""

    said: tuple[str, ...]
    elements: tuple[Element, ...] = ()
    bodies: bool = False
    """A mass, an inertia or a centre is wrong: so are what hangs, what a load does, and how modes are damped."""
    undamped: tuple[str, ...] = ()
    """Bundles that were given no damping."""
    astray: bool = False
    """A place lies far outside: nothing of the modes is to be trusted."""


def _seen(machine: Machine) -> _Seen:
    said = [
        *wrong_beams(machine),
        *thick_shafts(machine),
        *odd_bearings(machine),
        *wrong_modes(machine),
        *wrong_operation(machine),
    ]
    said += [*mixed_directions(machine), *wrong_tool_point(machine), *without_workpiece(machine)]
    said += wrong_cutter(machine)
    said += torn_apart(machine)
    if oversized(machine):  # such a beam would be cut into more elements than there is memory for
        return _Seen(tuple(said))
    found = elements(machine)
    said += strained_nodes(machine)
    bodies, sizes = list(wrong_bodies(machine)), dict(wrong_sizes(machine))
    pointed = {sentence.partition(":")[0] for sentence in said}
    far = [*sizes.values(), *far_centres(machine, found)]
    far += far_places(machine, found, [*sizes, *pointed])
    if not (far or bodies or said):
        far += too_large(machine)
    said += [*bodies, *far]
    if not (far or bodies):
        said += hanging(machine)
    said += wrong_contacts(machine, found)
    forgotten = list(forgotten_damping(machine, found))
    said += forgotten
    said += wrong_directions(machine, found)
    said += doubled(machine, found)
    undamped_ones = tuple(sentence.partition(":")[0] for sentence in forgotten)
    return _Seen(tuple(dict.fromkeys(said)), found, bool(bodies), undamped_ones, bool(far))


def may_be_solved(machine: Machine) -> bool:
    """Whether its modes can be asked for: every part has equations of a size, every joint gives way."""
    if oversized(machine) or any(c.joint is None for c in machine.flexible) or machine.without_equations:
        return False
    return bool(np.all(np.isfinite(tangents(replace(machine, static=None), 1.0))))
