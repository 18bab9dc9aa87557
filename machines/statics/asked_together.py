"""Joints that are asked together: equal ones at once, and those of the same laws as arrays over them."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import overload

import numpy as np

from jointlib.joint import Joint
from jointlib.law import JointLaw
from jointlib.parameter import parameters_of

from .at_bias import AtBias


@dataclass(frozen=True, eq=False)
class Several(Sequence[Joint]):
    """Joints that are asked again and again."""

    joints: tuple[Joint, ...]

    def __len__(self) -> int:
        return len(self.joints)

    @overload
    def __getitem__(self, index: int) -> Joint: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Joint]: ...
    def __getitem__(self, index: int | slice) -> Joint | Sequence[Joint]:
        return self.joints[index]

    def __iter__(self) -> Iterator[Joint]:
        return iter(self.joints)

    @cached_property
    def laws(self) -> list[tuple[JointLaw, list[int]]]:
        """`laws_together` of them."""
        return laws_together(self.joints)

    @cached_property
    def alike(self) -> list[list[int]]:
        """Places of joints of equal laws, whatever they are called."""
        groups: dict[tuple[Hashable, ...], list[int]] = {}
        for i, joint in enumerate(self.joints):
            groups.setdefault(tuple(_itself(law) for law in joint.laws), []).append(i)
        return list(groups.values())


def same_joints(joints: Sequence[Joint]) -> list[list[int]]:
    """Joints by their place, those together that are the same one and so can be asked together."""
    groups: dict[int, list[int]] = {}
    for i, joint in enumerate(joints):
        groups.setdefault(id(joint), []).append(i)
    return list(groups.values())


def asked_together(joints: Sequence[Joint]) -> list[tuple[Joint, list[int]]]:
    """Joints by their place, in as few as can be asked: equal ones, and those of the same laws, whose parameters are
    then arrays over them (`JointLaw.side_by_side`)."""
    groups: dict[tuple[Hashable, ...], list[int]] = {}
    for i, joint in enumerate(joints):
        groups.setdefault(tuple(_alike(law) for law in joint.laws), []).append(i)
    found = []
    for columns in groups.values():
        some = [joints[i] for i in columns]
        parts = zip(*(joint.laws for joint in some), strict=True)
        found.append((some[0] if len(some) == 1 else Joint(tuple(_side_by_side(laws) for laws in parts)), columns))
    return found


def laws_together(joints: Sequence[Joint]) -> list[tuple[JointLaw, list[int]]]:
    """The laws of joints with the places of those that hold them, all first laws before all second ones: equal laws at
    once, and those of one kind as arrays over the joints where that may be (`JointLaw.side_by_side`).
    """
    groups: dict[tuple[int, Hashable], list[int]] = {}
    for i, joint in enumerate(joints):
        for k, law in enumerate(joint.laws):
            groups.setdefault((k, _alike(law)), []).append(i)
    order = sorted(groups, key=lambda group: group[0])
    return [(_side_by_side([joints[i].laws[k] for i in groups[k, kind]]), groups[k, kind]) for k, kind in order]


def _alike(law: JointLaw) -> Hashable:
    """What laws share that can be asked together: their kind where their parameters may be arrays, else all of them."""
    if isinstance(law, AtBias):
        return AtBias, _alike(law.law)
    return type(law) if law.side_by_side else _itself(law)


def _itself(law: JointLaw) -> Hashable:
    """What equal laws share; one that holds a table is equal to itself alone."""
    try:
        hash(law)
    except TypeError:
        return id(law)
    return law


def _side_by_side(laws: Sequence[JointLaw]) -> JointLaw:
    """One law whose parameters are arrays over those of several of its kind; equal ones are one."""
    first = laws[0]
    if all(law is first or law == first for law in laws):
        return first
    if isinstance(first, AtBias):
        seen = [law for law in laws if isinstance(law, AtBias)]
        return AtBias(_side_by_side([law.law for law in seen]), np.array([law.bias for law in seen]))
    every = {p.name: np.array([getattr(law, p.name) for law in laws]) for p in parameters_of(first)}
    return type(first)(**every)
