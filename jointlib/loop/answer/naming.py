"""When an effect may be named, how it is named, and what would tell it from another; shared by both routes."""

from __future__ import annotations

from typing import TypeAlias

from jointlib.effect import JointEffect
from jointlib.fault import Fault
from jointlib.joint import Joint
from jointlib.loop.answer.catalogue import catalogue
from jointlib.loop.answer.following import Following, changes_in_words, following_in_words
from jointlib.loop.answer.report import Candidate, figures
from jointlib.path_fault import PathFault

Effect: TypeAlias = JointEffect | Fault | PathFault

NAMED_FROM = 0.95
"""Share of the excess that one effect must explain alone: stacks of wrong effects reach as much together."""
NAMED_ON_A_RIG_FROM = 0.97
"""The same where B and R stand beside J: on simulated rigs effects of no family of the catalogue reach 0.969."""
NEAREST_FROM = 0.5


def in_words(family: str, where: str = "", member: str = "") -> str:
    """A family as its effect (that of ``member`` first) says it in a sentence; its own name where it says nothing."""
    if family == Following.family:
        return following_in_words(member)
    known = catalogue()
    everything: tuple[Effect, ...] = (*known.joint, *known.rig, *known.path)
    own = [e for e in everything if e.family == family and e.words]
    words = next((e.words for e in own if isinstance(e, JointEffect) and e.member == member), None)
    words = words or next((e.words for e in own), family)
    if "{site}" in words or not where:
        return words.replace("{site}", where)
    return f"{words} at {where}"


def with_sizes(c: Candidate, joint: Joint) -> str:
    """An effect in a sentence with its parameters; of a modulation of the joint what it changes at each input."""
    sizes = changes_in_words(c.parameters, joint) or figures(c.parameters)
    return f"{in_words(c.family, c.where, c.member)}: {sizes}".rstrip(": ")


def is_of_joint(family: str) -> bool:
    """Whether a family is an effect of the joint; else it sits in the sensors, the masses or the rig."""
    known = catalogue()
    return (
        family == Following.family
        or any(e.family == family for e in known.joint)
        or any(e.family == family and e.on == "joint" for e in known.rig)
    )


def experiment(a: Effect, b: Effect) -> str:
    """What separates two families, from what either declares."""
    text = a.look_alikes.get(b.family) or b.look_alikes.get(a.family)
    return text or "Repeat at more levels, from the smallest that can be measured to the largest that is safe."


def is_declared_pair(a: Effect, b: Effect) -> bool:
    return b.family in a.declared_pairs or a.family in b.declared_pairs
