"""What the errors of measured parts, such as the uncoupled end of a spindle, make of a machine's response."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from jointlib.arrays import Array

from ...components.component import Component
from ...components.measured import Measured
from ...harmonic_balance.assembly import Assembly
from ...model.machine import Machine
from ...statics.working_point import tangents
from ..records import LevelFRF


def with_doubt_of_parts(frfs: Sequence[LevelFRF], machine: Machine) -> tuple[LevelFRF, ...]:
    """The records, their deviations with what errors of the machine's parts make of its response for small motion.

    A response is analytic in every entry of a measured part, so that an error ε of one moves it by ∂H/∂S ε, whatever
    the phase: a step by the deviation tells its share. Entries err independently, and one stands for both sides of
    the diagonal. They are common to all records of one response, where the fit takes deviations as independent: the
    variance is multiplied by their number, so that together they tell no more than one of them.
    """
    others = [(part, other) for part in machine.components for other in _stepped(part)]
    if not others:
        return tuple(frfs)
    # An error of a part is the same at every level: more levels do not average it out.
    shared = Counter((r.drive, r.response) for r in frfs if not r.sealed)
    return tuple(
        replace(
            r,
            deviation=np.sqrt(r.deviation**2 + max(shared[r.drive, r.response], 1) * _doubt(machine, r, others) ** 2),
        )
        for r in frfs
    )


def _doubt(machine: Machine, record: LevelFRF, others: Sequence[tuple[Component, Component]]) -> Array:
    """√(Σ |δH|²) on the lines of a record, m/N."""
    omega, gains = 2 * np.pi * record.frequency, tangents(machine, record.frequency)

    def response(model: Machine) -> Array:
        return np.asarray(Assembly(model, (record.response,), (record.drive,)).coupled(omega, gains)[:, 0, 0])

    known, total = response(machine), np.zeros(len(omega))
    for part, other in others:
        parts = tuple(other if one is part else one for one in machine.components)
        total += np.abs(response(replace(machine, components=parts)) - known) ** 2
    return np.sqrt(total)


def _stepped(part: Component) -> Iterator[Component]:
    """A measured part with one entry a deviation away, for every entry that has one."""
    if not isinstance(part, Measured) or part.variance is None:
        return
    for i in range(len(part.dofs)):
        for k in range(i, len(part.dofs)):
            error = np.sqrt(np.maximum(part.variance[:, i, k], part.variance[:, k, i]))
            if np.any(error > 0):
                value = part.value.copy()
                value[:, i, k] += error
                if i != k:
                    value[:, k, i] += error
                yield replace(part, value=value)
