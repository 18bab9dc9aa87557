"""Things that a file has twice: contacts at one place, parts on top of each other, joints beside rigid connections."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from ..components.beam import Beam
from ..components.component import Component
from ..components.rigid import Rigid
from ..model.machine import Machine
from .elements import Element

_PLACE = 1e-4
"""m."""
_ALONG = 1e-6
_SAME = 0.01
"""Relative difference of stiffnesses, masses and dimensions that are the same."""
_HELD = 1e-9


def doubled(machine: Machine, found: Sequence[Element]) -> Iterator[str]:
    """A sentence for every two that seem to be one."""
    for first, second in combinations(found, 2):
        if set(first.sides) == set(second.sides) and _same_contacts(first, second):
            yield (
                f"{first.name} and {second.name}: they hold the same parts at the same place along the same "
                "line, as stiff as "
                "each other, so that it holds twice; expected one of them"
            )
    for one, other in combinations(machine.components, 2):
        if _same_part(one, other):
            yield (
                f"{one.name} and {other.name}: two parts of the same mass at the same place, as if it were "
                "modelled twice; "
                "expected one of them"
            )
    rigid = machine.rows([c for c in machine.connections if c.rigid])
    if len(rigid):
        basis = np.linalg.svd(rigid / np.linalg.norm(rigid, axis=1, keepdims=True), full_matrices=False)[2]
        for connection, row in zip(machine.flexible, machine.rows(machine.flexible), strict=True):
            if np.linalg.norm(row - (row @ basis.T) @ basis) < _HELD * np.linalg.norm(row):
                yield (
                    f"{connection.name}: rigid connections hold its motion already, so its joint never moves; "
                    "expected one "
                    "or the other"
                )


def _same_contacts(first: Element, second: Element) -> bool:
    if len(first.rows) != len(second.rows) or np.any(first.stiffness <= 0) or np.any(second.stiffness <= 0):
        return False
    if first.at is None or second.at is None or first.direction is None or second.direction is None:
        same = set(first.words) == set(second.words) and first.at is second.at is None
        return same and bool(np.allclose(first.stiffness, second.stiffness, rtol=_SAME))
    return (
        bool(np.all(np.linalg.norm(first.at - second.at, axis=1) < _PLACE))
        and bool(np.all(np.abs(np.sum(first.direction * second.direction, axis=1)) > 1 - _ALONG))
        and bool(np.allclose(first.stiffness, second.stiffness, rtol=_SAME))
    )


def _same_part(one: Component, other: Component) -> bool:
    if isinstance(one, Rigid) and isinstance(other, Rigid):
        assert one.centre is not None
        assert other.centre is not None
        near = float(np.linalg.norm(one.centre - other.centre)) < 10 * _PLACE
        return (
            near
            and abs(one.mass - other.mass) < _SAME * one.mass
            and np.allclose(one.inertia, other.inertia, rtol=_SAME)
        )
    if isinstance(one, Beam) and isinstance(other, Beam):
        assert one.start is not None
        assert other.start is not None
        near = float(np.linalg.norm(one.start - other.start)) < 10 * _PLACE
        return near and bool(np.allclose(one.frame[0], other.frame[0], atol=_ALONG)) and one.segments == other.segments
    return False
