"""Whether two laws are one: the same force at every size of motion, though they go by other names."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from jointlib.arrays import Array
from jointlib.effect import Scale
from jointlib.joint import Joint
from jointlib.law import JointLaw
from jointlib.loop.path.steps import Finding, Row, is_rival
from jointlib.loop.path.trials import Effect
from jointlib.parameter import parameters_of

_ALIKE = 0.02
"""Of the largest force, by which the forces of one law differ at most."""
_SIZES = (0.2, 1.0, 5.0)
"""Times the largest motion of the records, at which they are held against each other."""
_SAMPLES, _CYCLES = 200, 2
_STRETCHES = np.linspace(0.9, 1.1, 21)
_SEEN = 1e-2
"""Share of the motion up to which play is not seen."""


def without_itself(rows: Sequence[Row], found: Finding) -> tuple[tuple[Row, ...], list[Effect]]:
    """Rows in which a rival that is the chosen law by another name, or in a limit, is none; and their effects."""
    same = [r.entry.effect for r in found.rows if is_rival(r) and _is_chosen_law(r, found)]
    reason = "the same law as the chosen one, in a limit of its parameters"
    told = (replace(r, reason=reason) if r.entry.effect in same and is_rival(r) else r for r in rows)
    return tuple(told), same


def _is_chosen_law(row: Row, found: Finding) -> bool:
    """Whether a rival is a law that the mended joint has: of its kind with what tells them apart gone to nothing, or
    another one that does the same in the limit of a parameter, as a loop whose corner is as sharp as that of slip.

    Of another family it is another cause: a guide whose preload is high has the cubic spring of its shape.
    """
    trial, known = row.entry.best.model, len(found.before.joint.laws)
    if trial is None or row.entry.effect.family not in {term.family for term in found.terms}:
        return False
    new, chosen = trial.joint.laws[known:], found.after.joint.laws[known:]
    return len(new) == 1 and any(same_law(new[0], law, found.before.evidence.scale) for law in chosen)


def same_law(one: JointLaw, other: JointLaw, scale: Scale) -> bool:
    """Whether two laws give one force along slow cycles smaller than a motion, as large, and larger.

    Two of one kind are the same but for their sizes, which a search tells on a grid, if no play in them is to be seen.
    Of two kinds the sizes may differ by a tenth for the same reason.
    """
    if one.kind == other.kind:
        return max(_play(one), _play(other)) <= _SEEN * scale.displacement
    sizes = np.multiply(_SIZES, scale.displacement)
    wanted = [_cycle(other, size) for size in sizes]
    return any(
        all(_apart(_cycle(one, stretch * size), force) <= _ALIKE for size, force in zip(sizes, wanted, strict=True))
        for stretch in _STRETCHES
    )


def _play(law: JointLaw) -> float:
    """The largest of the lengths among its parameters, m."""
    return max(
        (abs(float(getattr(law, p.name))) for p in parameters_of(law) if p.unit == "m" and p.table == 0), default=0.0
    )


def _cycle(law: JointLaw, amplitude: float) -> Array:
    """The force over slow cycles, N."""
    phase = 2 * np.pi * np.arange(_CYCLES * _SAMPLES) / _SAMPLES
    step = 1.0 / _SAMPLES
    return Joint((law,)).force_along(amplitude * np.sin(phase), 2 * np.pi * amplitude * np.cos(phase), step)[_SAMPLES:]


def _apart(force: Array, wanted: Array) -> float:
    """The largest difference over the largest force, the first in the size that makes the two most alike."""
    energy = float(force @ force)
    scaled = force * (float(force @ wanted) / energy) if energy > 0 else force
    return float(np.max(np.abs(scaled - wanted)) / max(float(np.max(np.abs(wanted))), 1e-300))
