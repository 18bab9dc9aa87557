"""What an effect adds to the joint force in the records, with each of its coefficients 1."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.effect import JointEffect, Path
from jointlib.fault import Shape
from jointlib.joint import Joint
from jointlib.law import JointLaw
from jointlib.loop.balance.equations import Observed, forces_of_law, periodic_forces, under_inputs
from jointlib.modulation import acting


def features(
    records: Sequence[Observed], effect: JointEffect, shapes: Sequence[Shape], joint: Joint
) -> list[list[ComplexArray]]:
    """For each shape the force of an effect with each coefficient 1 on the lines of each record, (q, lines).

    An effect without memory is a function of the path. One with memory is stepped to its periodic steady state, all
    shapes at once where the law takes columns of parameters; what does not repeat moves it through its linear part.
    """
    z, v, step = records[0].path
    count = len(effect.columns(Path(z[:8], v[:8], step), shapes[0], joint))
    first = [_added(effect, e, shapes[0], joint) for e in np.eye(count)]
    laws = [law for unit in first if unit is not None for law in unit.laws]
    if None in first or not any(law.states for law in laws):
        if not any(acting(law, o.inputs.active(joint.modulations)) for law in laws for o in records):
            return [
                [o.force_along(lambda *p, s=s: effect.columns(Path(*p), s, joint)) for o in records] for s in shapes
            ]
        units = [[_added(effect, e, s, joint) for e in np.eye(count)] for s in shapes]
        return [_of_units(records, [u.laws for u in row if u is not None], joint) for row in units]
    together = {n: np.array([[s[n]] for s in shapes]) for n in shapes[0]}
    variants, rows = partial(periodic_forces, variants=len(shapes)), []
    for e in np.eye(count):
        unit = _added(effect, e, together, joint)  # type: ignore[arg-type]
        added = unit.laws if unit is not None else ()
        rows.append([under_inputs(records, law, joint.modulations, variants) for law in added])
    return [
        [np.array([o.with_stray(sum(law[i][k] for law in row)) for row in rows]) for i, o in enumerate(records)]
        for k in range(len(shapes))
    ]


def _of_units(records: Sequence[Observed], units: Sequence[Sequence[JointLaw]], joint: Joint) -> list[ComplexArray]:
    """Forces of laws without memory whose parameters follow inputs, one row for the laws of each unit coefficient."""
    rows = [[forces_of_law(records, law, joint.modulations) for law in laws] for laws in units]
    return [np.array([np.sum([law[i] for law in row], axis=0) for row in rows]) for i in range(len(records))]


def _added(effect: JointEffect, unit: Array, shape: Shape, joint: Joint) -> Joint | None:
    """The laws that a unit coefficient adds, where the effect only adds."""
    mended = effect.apply(unit, shape, joint)
    if mended is None or mended.laws[: len(joint.laws)] != joint.laws:
        return None
    return Joint(mended.laws[len(joint.laws) :])
