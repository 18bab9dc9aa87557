"""What describing functions say of a cut, held against the cut in time before anybody is told."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.errors import CheckFailed, InputError
from jointlib.joint import Joint
from jointlib.law import Motion

from ...model.machine import Machine
from ..amplitude.amplitude_limits import Cycle
from ..amplitude.fate import ABOUT, NEAR, Fate
from ..amplitude.words import mm, um
from .witness import Witness, witness

_LEFT = 0.9
_STANDS = 0.02
"""Change of the logarithm of an amplitude over the simulated time below which it stands."""
_GONE = 1e-3
_SAME = 0.2
"""Share by which amplitudes of a settled chatter may differ and still be told as one."""
_CLOSER, _LONGER = 4, 500
_MOST_DOFS, _MOST_ENDS = 150, 4
_SLOW, _SLOWER = 1e-9, 1e-15
"""m/s; a force that is as different between two such speeds and their opposites jumps."""


@dataclass(frozen=True)
class Ends:
    """Vibrations simulated side by side that end alike, from ``low`` to ``high`` (m).

    At amplitudes between ``least`` and ``most`` (m): both 0 where they die out, inf where they leave what is known.
    """

    low: float
    high: float
    least: float
    most: float

    @property
    def words(self) -> str:
        """What becomes of them."""
        if self.most == 0:
            return "die out"
        if np.isinf(self.least):
            return "grow beyond {reach}"
        if self.most < (1 + _SAME) * self.least:
            return f"settle at {um(float(np.sqrt(self.least * self.most)), True)}"
        return f"stay between {um(self.least)} and {um(self.most)}"


@dataclass(frozen=True)
class Seen:
    """What became of vibrations in time at one speed (rpm) and depth (m); ``reach`` (m) is what was looked at."""

    speed: float
    depth: float
    ends: tuple[Ends, ...]
    reach: float
    frequency: float

    def __str__(self) -> str:
        first, *rest = self.ends
        of = f"{um(first.low)} to {um(self.reach)}" if not rest else f"up to {um(first.high)}"
        said = [f"{'knocks' if self.knocked else 'vibrations'} of {of} at the tool {first.words}"]
        for one in rest[:-1]:
            to = "" if one.high == one.low else f" to {um(one.high)}"
            said.append(f"those of {um(one.low)}{to} {one.words}")
        said += [f"those of {um(one.low)} and more {one.words}" for one in rest[-1:]]
        told = ", ".join(said).format(reach=um(self.reach))
        return f"In time, at {self.speed:g} rpm and {mm(self.depth)}, {told}."

    @property
    def knocked(self) -> bool:
        """Whether a vibration lasts of a size from which others die out: what it began with decides, not its size."""
        return any(
            0 < one.least < np.inf and other.most == 0 and other.low <= one.most <= other.high
            for one in self.ends
            for other in self.ends
        )

    @property
    def cycles(self) -> tuple[Cycle, ...]:
        """The vibrations that last, and the thresholds between those that die out and those that do not."""
        found = list[Cycle]()
        for i, one in enumerate(self.ends):
            if i and (one.most == 0) != (self.ends[i - 1].most == 0):
                edge = float(np.sqrt(self.ends[i - 1].high * one.low))
                found.append(Cycle(edge, self.frequency, stable=False))
            if 0 < one.most < np.inf:
                found.append(Cycle(float(np.sqrt(one.least * one.most)), self.frequency, stable=True))
        return tuple(sorted(found, key=lambda one: one.amplitude))


def denied(fate: Fate, found: Witness) -> bool:
    """Whether vibrations simulated in time end elsewhere than is told."""
    near = ABOUT if fate.milled else NEAR
    for start, end, rate in zip(found.start, found.end, found.rate, strict=True):
        told, trend = fate.end(float(start)), float(rate) * found.duration
        if told == 0:
            fine = end < _GONE * start or trend < -_STANDS
        elif np.isinf(told):
            fine = end > _LEFT * fate.reach or trend > _STANDS
        else:
            there = np.isfinite(end) and end > 0 and abs(np.log(end / told)) < near
            fine = there or (np.isfinite(end) and abs(trend) > _STANDS and (trend > 0) == (end < told))
        if not fine:
            return True
    return False


def seen(found: Witness, reach: float) -> Seen:
    """Simulated vibrations grouped by how they end."""
    start, end, trend = found.start, found.end, found.rate * found.duration
    left = ~(end <= _LEFT * reach)
    gone = ~left & ((end < _GONE * start) | (end == 0))
    stays = end[~left & ~gone & (np.abs(trend) <= _STANDS)]
    groups = list[Ends]()
    for i, size in enumerate(start.tolist()):
        if left[i] or gone[i]:
            at = np.inf if left[i] else 0.0
        elif abs(trend[i]) <= _STANDS:
            at = float(end[i])
        elif trend[i] > 0:  # on its way
            at = float(np.min(stays[stays > end[i] / (1 + _SAME)], initial=np.inf))
        else:
            at = float(np.max(stays[stays < end[i] * (1 + _SAME)], initial=0.0))
        last = groups[-1] if groups else None
        if last is not None and (at == 0, np.isinf(at)) == (last.most == 0, np.isinf(last.most)):
            groups[-1] = Ends(last.low, size, min(last.least, at), max(last.most, at))
        else:
            groups.append(Ends(size, size, at, at))
    return Seen(found.speed, found.depth, tuple(groups), reach, found.frequency)


def in_time(machine: Machine, fate: Fate, doubted: bool = False) -> Seen | None:
    """The cut in time where it denies a fate, or where that is ``doubted``; None where it bears it out.

    None, too, for machines that cannot be stepped, that have so many degrees of freedom that it takes minutes, or a
    joint whose force jumps with the sign of its speed, which no step is short enough for; and where the ends of
    vibrations follow no order of size.
    """
    starts = fate.starts
    if not len(starts) or sum(len(c.dofs) for c in machine.components) > _MOST_DOFS or _jumps(machine):
        return None
    hertz = fate.hertz if np.isfinite(fate.hertz) else None
    try:
        found = witness(machine, fate.speed, fate.depth, starts, rounds=1, frequency=hertz)
        if not doubted and not denied(fate, found):
            return None
        closer = np.geomspace(starts[0], starts[-1], _CLOSER * len(starts))
        found = witness(machine, fate.speed, fate.depth, closer, rounds=1, waves=_LONGER, frequency=hertz)
        told = seen(found, fate.reach)
        return told if len(told.ends) <= _MOST_ENDS else None
    except (CheckFailed, InputError):
        return None


def _jumps(machine: Machine) -> bool:
    """Whether the force of a joint jumps where its motion turns round, as ideal friction does."""

    def turned(joint: Joint, speed: float) -> float:
        rest = joint.initial_state(np.zeros(()))
        forth, back = (joint.step(Motion(np.zeros(()), np.array(v), 0.0), rest)[0] for v in (speed, -speed))
        return abs(float(forth) - float(back))

    return any(turned(joint, _SLOWER) > 0.5 * turned(joint, _SLOW) > 0 for joint in machine.joints())
