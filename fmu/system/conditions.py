"""Conditions that parameters of joints follow, as inputs of an FMU."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.modulation import CONDITIONS, Modulation
from jointlib.parameter import Role

_NAMED = {kind: "elapsed_time" if kind == "time" else kind.replace("-", "_") for kind in CONDITIONS}
"""As variables; every FMU has a time of its own."""
NAMES = frozenset(_NAMED.values())


@dataclass(frozen=True)
class Condition:
    """One condition for all joints that depend on it, in SI (the speed of a spindle in rpm)."""

    kind: str
    """What it is in :data:`jointlib.modulation.CONDITIONS`."""
    start: float
    """The reference of the joints, at which their parameters are those of their laws."""
    low: float
    high: float
    """Where all factors are known; beyond, they stay what they are at the end."""

    @property
    def name(self) -> str:
        """``temperature``; ``spindle_speed``; ``elapsed_time`` of what warms up or wears."""
        return _NAMED[self.kind]

    @property
    def description(self) -> str:
        """What the input is."""
        return f"{self.kind.replace('-', ' ')} that parameters of joints follow"

    @property
    def unit(self) -> str:
        return CONDITIONS[self.kind]

    @property
    def size(self) -> float:
        """How large it usually is."""
        return max((abs(x) for x in (self.start, self.low, self.high) if abs(x) < float("inf")), default=0.0) or 1.0

    @property
    def elsewhere(self) -> float:
        """Between the start and the end that is further from it: where reference runs are."""
        if self.high == float("inf"):
            return self.start + self.size / 3
        end = self.high if self.high - self.start >= self.start - self.low else self.low
        return self.start + (end - self.start) / 3


def by_role(joint: Joint) -> dict[Role, list[Modulation]]:
    """The modulations of a joint by the role of the parameters that they multiply, one after the other."""
    found: dict[Role, list[Modulation]] = {}
    for m in joint.modulations:
        found.setdefault(m.role, []).append(m)
    return found


def least_and_largest(of: Iterable[Modulation]) -> tuple[float, float]:
    """Products of the least and of the largest factors of modulations of one role."""
    low = high = 1.0
    for m in of:
        low, high = low * min(y for _, y in m.table), high * max(y for _, y in m.table)
    return low, high


def conditions_of(where: str, joints: Iterable[Joint]) -> tuple[Condition, ...]:
    """What the joints depend on, in the order of the table of conditions."""
    joints = tuple(joints)
    found: dict[str, list[Modulation]] = {}
    for m in (m for joint in joints for m in joint.modulations):
        found.setdefault(m.condition, []).append(m)
    return tuple(_condition(where, kind, found[kind]) for kind in CONDITIONS if kind in found)


def _condition(where: str, kind: str, of: list[Modulation]) -> Condition:
    references = sorted({m.reference for m in of})
    if len(references) > 1:
        told = " and ".join(f"{x:g}" for x in references)
        raise InputError(
            f"{where}: parameters that follow the {kind} are those at {told} {CONDITIONS[kind]}, expected one value at "
            f"which an FMU starts: `{kind}` in the [conditions] of a machine, Joint.based in Python"
        )
    ends = [(-float("inf"), float("inf")) if m.period is not None else (m.table[0][0], m.table[-1][0]) for m in of]
    low, high = max(low for low, _ in ends), min(high for _, high in ends)
    return Condition(kind, references[0], low, high)
