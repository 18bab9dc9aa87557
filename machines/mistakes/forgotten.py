"""Damping that was given to some elements of a kind and not to others."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ..model.machine import Machine
from .elements import Element


def forgotten_damping(machine: Machine, found: Sequence[Element]) -> Iterator[str]:
    """Bundles that dissipate nothing beside others of their kind that do, a sentence each.

    What slips or creeps dissipates once it moves, whatever it does at rest.
    """
    bundles: dict[tuple[str, str], list[Element]] = {}
    for element in found:
        if element.kind:
            name = machine.flexible[element.rows[0]].bundle.partition(" (")[0]
            bundles.setdefault((name, element.kind), []).append(element)
    damped = {bundle: any(_dissipates(machine, e) for e in carriages) for bundle, carriages in bundles.items()}
    for (name, kind), dissipates in damped.items():
        others = [other for (other, its), so in damped.items() if its == kind and so]
        if not dissipates and others:
            yield (
                f"{name}: this {kind} has no damping, while {others[0]} has some; give it a damping too, or it "
                "dissipates nothing"
            )


def _dissipates(machine: Machine, element: Element) -> bool:
    joints = [machine.flexible[i].joint for i in element.rows]
    return bool(np.any(element.damping)) or any(law.states for j in joints if j is not None for law in j.laws)
