"""When an effect may be named, how it is named, and what would tell it from another; shared by both routes."""

from __future__ import annotations

from jointlib.effect import JointEffect
from jointlib.loop.catalogue import catalogue

NAMED_FROM = 0.95
"""Share of the excess that one effect must explain alone: stacks of wrong effects reach as much together."""
NEAREST_FROM = 0.5


def in_words(family: str) -> str:
    """A family as its effect says it in a sentence; the family's own name where it says nothing."""
    return next((e.words for e in catalogue()[0] if e.family == family and e.words), family)


def experiment(a: JointEffect, b: JointEffect) -> str:
    """What separates two families, from what either declares."""
    text = a.look_alikes.get(b.family) or b.look_alikes.get(a.family)
    return text or "Repeat at more levels, from the smallest that can be measured to the largest that is safe."


def is_declared_pair(a: JointEffect, b: JointEffect) -> bool:
    return b.family in a.declared_pairs or a.family in b.declared_pairs
