"""What describing functions say of a cut, held against the cut in time before anybody is told."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import CheckFailed, InputError
from jointlib.joint import Joint
from jointlib.law import Motion

from ...indices import Mask
from ...model.machine import Machine
from ..amplitude.amplitude_limits import Cycle
from ..amplitude.fate import Fate
from ..amplitude.words import mm, um
from .witness import Witness, begun_in_every_way

_STANDS = 0.02
"""Change of the logarithm of an amplitude over the simulated time below which it stands."""
_GONE = 1e-3
_SAME = 0.2
"""Share by which amplitudes of a settled chatter may differ and still be told as one."""
_CLOSER, _LONGER, _FARTHER = 4, 500, 1.4
"""Sizes, waves and the largest size of the second look, as shares and number: beyond what is known, since where
another chatter takes over depends on how a vibration begins."""
_MOST_DOFS, _MOST_ENDS = 150, 4
_SLOW, _SLOWER = 1e-9, 1e-15
"""m/s; a force that is as different between two such speeds and their opposites jumps."""


@dataclass(frozen=True)
class Ends:
    """Vibrations simulated side by side that end alike, from ``low`` to ``high`` (m).

    At amplitudes between ``least`` and ``most`` (m): 0 where they die out, inf where they leave what is known.
    """

    low: float
    high: float
    least: float
    most: float

    def alike(self, other: Ends) -> bool:
        """Whether both die out, last or leave, or both may do the same two of these."""
        ends = ((self.least, other.least), (self.most, other.most))
        return all((a == 0, np.isinf(a)) == (b == 0, np.isinf(b)) for a, b in ends)

    @property
    def words(self) -> str:
        """What becomes of them."""
        if self.most == 0:
            return "die out"
        if np.isinf(self.least):
            return "grow beyond {reach}"
        if self.least == 0:
            ends = "grow beyond {reach}" if np.isinf(self.most) else f"last, at up to {um(self.most)}"
            return f"die out or {ends}, as they begin"
        if np.isinf(self.most):
            return f"stay at {um(self.least)} or grow beyond {{reach}}, as they begin"
        if self.most < (1 + _SAME) * self.least:
            return f"settle at {um(float(np.sqrt(self.least * self.most)), True)}"
        return f"stay between {um(self.least)} and {um(self.most)}"


@dataclass(frozen=True)
class Seen:
    """What became of knocks in time at one speed (rpm) and depth (m); ``reach`` (m) is what was looked at."""

    speed: float
    depth: float
    ends: tuple[Ends, ...]
    reach: float
    frequency: float

    def __str__(self) -> str:
        first, *rest = self.ends
        of = f"{um(first.low)} to {um(self.reach)}" if not rest else f"up to {um(first.high)}"
        said = [f"knocks of {of} at the tool {first.words}"]
        for one in rest[:-1]:
            to = "" if one.high == one.low else f" to {um(one.high)}"
            said.append(f"those of {um(one.low)}{to} {one.words}")
        said += [f"those of {um(one.low)} and more {one.words}" for one in rest[-1:]]
        told = ", ".join(said).format(reach=um(self.reach))
        return f"In time, at {self.speed:g} rpm and {mm(self.depth)}, {told}."

    @property
    def cycles(self) -> tuple[Cycle, ...]:
        """The vibrations that last, and the thresholds between those that die out and those that do not."""
        found = list[Cycle]()
        for i, one in enumerate(self.ends):
            if i and (one.most == 0) != (self.ends[i - 1].most == 0):
                edge = float(np.sqrt(self.ends[i - 1].high * one.low))
                found.append(Cycle(edge, self.frequency, stable=False))
            if 0 < one.most < np.inf:
                size = float(np.sqrt((one.least or one.most) * one.most))
                found.append(Cycle(size, self.frequency, stable=True))
        return tuple(sorted(found, key=lambda one: one.amplitude))


def denied(fate: Fate, found: Witness) -> bool:
    """Whether vibrations simulated in time end elsewhere than is told."""
    near, lasts = fate.near, np.isfinite(found.end) & (found.end > 0)
    trend = _of_its_neighbours(found.end, found.rate * found.duration, lasts)
    # What grows for a while may settle below: the largest that were begun must have grown, too.
    grown = bool(np.any(~(found.end <= found.start)[found.start == found.start[-1]]))

    def bears_out(size: float, start: float, end: float, trend: float) -> bool:
        told = fate.end(size)
        if told == 0:
            return end < _GONE * start or trend < -_STANDS
        if np.isinf(told):
            return end > (1 + near) * fate.reach or (trend > _STANDS and grown)
        there = np.isfinite(end) and end > 0 and abs(np.log(end / told)) < near
        return bool(there or (np.isfinite(end) and abs(trend) > _STANDS and (trend > 0) == (end < told)))

    smallest = found.start if found.least is None else found.least
    certain = fate.certain(found.start)
    for start, end, change, least in zip(*(x[certain] for x in (found.start, found.end, trend, smallest)), strict=True):
        between = found.start[(found.start > least) & (found.start < start)]
        sizes = {float(start), float(least), *between.tolist()}
        if not any(bears_out(size, float(start), float(end), float(change)) for size in sizes):
            return True
    return False


def seen(found: Witness, reach: float) -> Seen:
    """Simulated vibrations grouped by how those of one size end, however they began."""
    start, end, trend = found.start, found.end, found.rate * found.duration
    left = ~(end <= reach)
    gone = ~left & ((end < _GONE * start) | (end == 0))
    lasts = ~left & ~gone
    at = np.where(left, np.inf, np.where(gone, 0.0, end))
    trend = _of_its_neighbours(end, trend, lasts)
    for i in np.flatnonzero(lasts & ~(np.abs(trend) <= _STANDS)):  # on its way
        # It goes on to the next that stays or comes to meet it; not for ever where all larger ones have shrunk.
        if trend[i] > 0:
            larger = start > end[i]
            bounded = np.any(larger) and np.all(end[larger] < start[larger])
            meets = end[lasts & (end > end[i] / (1 + _SAME)) & (trend < _STANDS)]
            at[i] = np.min(meets, initial=np.max(end[lasts]) if bounded else np.inf)
        else:
            meets = end[lasts & (end < end[i] * (1 + _SAME)) & (trend > -_STANDS)]
            at[i] = np.max(meets, initial=0.0)
    groups = list[Ends]()
    for size in np.unique(start).tolist():
        these = at[start == size]
        one = Ends(size, size, float(np.min(these)), float(np.max(these)))
        last = groups[-1] if groups else None
        if last is not None and last.alike(one):
            groups[-1] = Ends(last.low, size, min(last.least, one.least), max(last.most, one.most))
        else:
            groups.append(one)
    if len(groups) > _MOST_ENDS:  # in no order of size
        least, most = min(one.least for one in groups), max(one.most for one in groups)
        groups = [Ends(float(start[0]), float(start[-1]), least, most)]
    return Seen(found.speed, found.depth, tuple(groups), reach, found.frequency)


def _of_its_neighbours(end: Array, trend: Array, lasts: Mask) -> Array:
    """Trends; of one that goes against those of about its size, smaller and larger, theirs: another mode dies down."""
    found = trend.copy()
    for i in np.flatnonzero(lasts & (np.abs(trend) > _STANDS)):
        against = lasts & (trend * np.sign(trend[i]) < -_STANDS)
        beyond = np.log(np.where(against, end, end[i]) / end[i])
        near = against & (np.abs(beyond) < np.log(1 + _SAME))
        if np.any(beyond[near] > 0) and np.any(beyond[near] < 0):
            found[i] = np.mean(trend[near])
    return found


def in_time(machine: Machine, fate: Fate, doubted: bool = False) -> Seen | None:
    """The cut in time where it denies a fate, or where that is ``doubted``; None where it bears it out.

    None, too, for machines that cannot be stepped, that have so many degrees of freedom that it takes minutes, or a
    joint whose force jumps with the sign of its speed, which no step is short enough for.
    """
    starts = fate.starts
    if not len(starts) or sum(len(c.dofs) for c in machine.components) > _MOST_DOFS or _jumps(machine):
        return None
    hertz = fate.hertz if np.isfinite(fate.hertz) else None
    try:
        found = begun_in_every_way(machine, fate.speed, fate.depth, starts, hertz)
        if not doubted and not denied(fate, found):
            return None
        closer = np.union1d(starts, np.geomspace(starts[0], _FARTHER * starts[-1], _CLOSER * len(starts)))
        found = begun_in_every_way(machine, fate.speed, fate.depth, closer, hertz, _LONGER)
        # What looked like another end may have been on its way.
        return seen(found, fate.reach) if doubted or denied(fate, found) else None
    except (CheckFailed, InputError):
        return None


def _jumps(machine: Machine) -> bool:
    """Whether the force of a joint jumps where its motion turns round, as ideal friction does."""

    def turned(joint: Joint, speed: float) -> float:
        rest = joint.initial_state(np.zeros(()))
        forth, back = (joint.step(Motion(np.zeros(()), np.array(v), 0.0), rest)[0] for v in (speed, -speed))
        return abs(float(forth) - float(back))

    return any(turned(joint, _SLOWER) > 0.5 * turned(joint, _SLOW) > 0 for joint in machine.joints())
