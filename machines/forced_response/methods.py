"""How the describing functions of a machine are solved: which method where, and what each finds."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.shown.progress import Progress

from ..continuation.all_curves import by_raising_the_force, from_branches
from ..continuation.curve_results import Followed, by_arc_length
from ..continuation.fold_windows import by_windows
from ..continuation.line_by_line import by_lines
from ..harmonic_balance.assembly import Assembly
from ..model.machine import Machine
from ..operating.branches import Branch
from ..operating.resonances import NO_MOTION


@dataclass(frozen=True)
class AmplitudeMap:
    """For one nonlinear joint: all branches, their folds and stability. ``amplitudes`` is the size of the axis."""

    amplitudes: int = 150


@dataclass(frozen=True)
class Newton:
    """For any number of nonlinear joints: the branch that grows out of the linear response, line by line."""


@dataclass(frozen=True)
class ArcLength:
    """For any number of nonlinear joints: curves followed round their folds over a range of frequency.

    They are begun at the edges of the range and, so that isolated curves are found as well, on every branch of the
    amplitude map (one joint) or wherever raising the force from nothing to three times the largest leads (several).
    """


def in_one_harmonic(
    assembly: Assembly,
    forces: Array,
    lines: Array,
    refine: bool,
    method: AmplitudeMap | Newton | ArcLength | None,
    during: Progress,
) -> list[Followed]:
    """Branches of describing functions, per force."""
    count = len(assembly.nonlinear)
    if isinstance(method, AmplitudeMap) and count > 1:
        raise InputError(
            f"{assembly.machine.where}: the amplitude map takes one nonlinear joint and there are {count}; "
            "use ArcLength() or Newton()"
        )
    if _at_rest(assembly, lines):
        return by_lines(assembly, forces, lines, refine, None)
    traced = isinstance(method, ArcLength)
    if method is None and count > 1 and refine:
        return by_windows(assembly, forces, lines, during)
    if traced and len(lines) > 1 and count > 1:
        low, high = 2 * np.pi * float(lines[0]), 2 * np.pi * float(lines[-1])
        return by_arc_length(assembly, forces, lines, (1,), by_raising_the_force(assembly, forces, low, high))
    mapped = count == 1 and not isinstance(method, Newton)
    axis = (method if isinstance(method, AmplitudeMap) else AmplitudeMap()).amplitudes
    with during.step(f"solving {len(lines)} lines"):
        found = by_lines(assembly, forces, lines, refine, axis if mapped else None)
    if traced and len(lines) > 1 and count:
        starts = from_branches(assembly, [part.branches for part in found], (1,))
        return by_arc_length(assembly, forces, lines, (1,), starts)
    return found


def unmoved(machine: Machine, driven: str, branches: Iterable[Branch]) -> tuple[str, ...]:
    """A sentence where a force moves none of the joints: the machine is then linear, whatever they are."""
    names = [c.name for c in machine.flexible]
    sizes = [(float(np.max(np.abs(b.joint))), float(np.max(np.abs(b.output), initial=0.0))) for b in branches if names]
    if not sizes or max(z for z, _ in sizes) > NO_MOTION * max(x for _, x in sizes):
        return ()
    return (f"the force on {driven} moves no joint ({', '.join(names)}), so none of them bears on the answer",)


def _at_rest(assembly: Assembly, lines: Array) -> bool:
    """Whether the force moves no nonlinear joint, so that there is no amplitude to map or to follow."""
    view = assembly.at(2 * np.pi * lines[[0, len(lines) // 2, -1]])
    return bool(np.max(np.abs(view.Hzf), initial=0.0) <= NO_MOTION * np.max(np.abs(view.Hof), initial=0.0))
