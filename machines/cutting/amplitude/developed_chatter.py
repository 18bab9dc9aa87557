"""Developed chatter in milling: the depth at which a vibration of given size at the tool just persists.

Chatter holds the lines ω + qω_T. Its amplitude A is that of the line at which the tool moves most, and the joints are
held, on all lines, as the springs and dampers that they are at A and the frequency f of that line, moved by the force
that the crossing has there. Neither f nor that force is known before: with the joints as they are at each resonance in
turn, the crossings whose strongest line is nearest to that resonance are found (for resonances at which the joints are
alike, in one go); each is then followed until joints, frequency and force agree. Of those that do, the one of lowest
depth is the limit. Where two lines of one crossing are nearly alike, that is the case with either as the chatter: a
line is kept while the tool moves half as much as at most.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import CheckFailed, InputError, Outcome
from jointlib.system.processes import on_every_core

from ...deadline import in_time
from ...operating.operating_point import Gains, OperatingPoint
from ...tool.bounded_band import Shape
from ..loops.critical_depth import first_crossings, near
from ..loops.loop_branches import NONE, Crossing
from ..process.cutting import Cutting
from .held_joints import Constant, Held, HeldJoints

_CLOSE, _ENOUGH = 1.5, 1.2
"""Times the lowest depth so far up to which a resonance is searched: its joints are not yet those of the crossing; and
how much deeper than was thought the one that settles may lie without another search."""
_DEEPEST = 1.0
"""m; no cut is deeper, and what a loop closes on far above its limit is what its discretisation left over."""
_SAME, _ALIKE = 0.05, 3e-3
_SETTLED = 1e-9
_BESIDE = 1e-4
_PEAK, _MOST = 0.01, 16
_RAISES, _TRIES, _ROUNDS = 6, 3, 40
_TOGETHER = 16
"""Speeds at once."""

Joints = Callable[[Array, ComplexArray], Gains]


@dataclass(frozen=True, eq=False)
class Persistent:
    """A vibration that just persists: its crossing, the order q of its strongest line, and the joints then.

    ``gain`` in N/m of every connection; ``direction`` of the force on that line, (axes,).
    """

    crossing: Crossing
    order: int = 0
    direction: ComplexArray | None = None
    gain: ComplexArray | None = None
    outcome: Outcome = Outcome.CONVERGED

    @property
    def line(self) -> float:
        """Frequency of the chatter in tooth frequencies, nan where there is none."""
        return abs(self.crossing.fraction + self.order)


@dataclass(frozen=True, eq=False)
class DevelopedChatter:
    """What vibrates with an amplitude in a cut.

    Parameters
    ----------
    table
        The machine at that amplitude over its band, moved by the mean cut.
    joints
        What they are at that amplitude at frequencies in Hz, (n,), moved by forces along directions, (n, axes).
    search, method
        How crossings are found, and how they are settled.
    """

    cutting: Cutting
    table: OperatingPoint
    joints: Joints
    search: HeldJoints
    method: HeldJoints

    def persistent(self, speeds: Sequence[float]) -> Iterator[Persistent]:
        """The lowest one at each speed in rpm; its depth is inf where there is none."""
        together = [speeds[i : i + _TOGETHER] for i in range(0, len(speeds), _TOGETHER)]
        for found in on_every_core(self._lowest, together, len(together)):
            yield from found

    def _lowest(self, speeds: Sequence[float]) -> list[Persistent]:
        lowest, before = dict[int, Persistent](), set[int]()
        for level in range(_RAISES):
            left = [i for i in range(len(speeds)) if i not in lowest]
            for i, found in zip(left, self._found([speeds[i] for i in left], level), strict=True):
                if found or (found is not None and i in before):
                    lowest[i] = min(found, key=lambda one: one.crossing.depth, default=Persistent(NONE))
                (before.discard if found is None else before.add)(i)
            if len(lowest) == len(speeds):
                return [lowest[i] for i in range(len(speeds))]
        rpm = next(rpm for i, rpm in enumerate(speeds) if i not in lowest)
        raise CheckFailed(
            f"lobes: at {rpm:g} rpm the depth at that amplitude still changes with the resolution of a tooth period"
        )

    @cached_property
    def starts(self) -> list[tuple[float, ComplexArray]]:
        """The resonances at that amplitude in Hz and the gains of the joints there, the most flexible one first."""
        size = np.linalg.norm(self.table.frf.receptance, axis=(1, 2))
        padded = np.concatenate([[np.inf], size, [np.inf]])
        peak = np.flatnonzero((size > padded[:-2]) & (size >= padded[2:]) & (size >= _PEAK * np.max(size)))
        if not len(peak):
            peak = np.array([np.argmax(size)])
        peak = peak[np.argsort(-size[peak], kind="stable")][:_MOST]
        return [(float(self.table.frf.frequency[i]), self.table.gain[i]) for i in peak]

    @cached_property
    def groups(self) -> list[list[int]]:
        """The resonances, those together at which the joints are alike."""
        found: list[list[int]] = []
        for i, (f, gain) in enumerate(self.starts):
            for group in found:
                other, first = self.starts[group[0]]
                apart = np.abs(gain.real - first.real) + np.abs(gain.imag * other / f - first.imag)
                if np.all(apart <= _ALIKE * np.abs(first)):
                    group.append(i)
                    break
            else:
                found.append([i])
        return found

    def _found(self, speeds: list[float], level: int) -> list[list[Persistent] | None]:
        """At each speed the lowest of every resonance, with those that do not settle only if none does.

        None where the level resolves too little.
        """
        looks = [[_Look(group) for group in self.groups] for _ in speeds]
        lost, before = set[int](), 0
        while True:
            some: list[tuple[int, _Look, list[Persistent]]] = []
            for i, speed in enumerate(speeds):
                ceiling = min((one.crossing.depth for look in looks[i] for one in look.settled), default=np.inf)
                # Most often the resonance that is lowest at one speed is so at the next: it tells how deep to look.
                for look in sorted(looks[i], key=lambda look: look is not looks[i][before]):
                    if i in lost or not look.further(ceiling):
                        continue
                    in_time()
                    crossings = self._crossings(speed, level, look.group, look.tried, ceiling)
                    if crossings is None:
                        lost.add(i)
                        continue
                    look.up_to = ceiling
                    if crossings:
                        some.append((i, look, crossings))
                        if crossings[0].crossing.depth < ceiling:
                            ceiling, before = crossings[0].crossing.depth, looks[i].index(look)
            if not some:
                break
            every = [(one, speeds[i]) for i, _, found in some for one in found]
            ends = iter(self._settled([one for one, _ in every], [speed for _, speed in every]))
            for _, look, found in some:
                for one in found:
                    if (end := next(ends)) is None:
                        look.tried.append(one)
                    else:
                        look.settled.append(end)
                look.searches += 1
                look.up_to = 0.0  # where nothing settled, beside that
        return [None if i in lost else _lowest_of(each) for i, each in enumerate(looks)]

    def _crossings(
        self, speed: float, level: int, group: list[int], tried: list[Persistent], ceiling: float
    ) -> list[Persistent] | None:
        """Crossings with the joints held as at the first of some resonances; their strongest line is nearest to one."""
        tooth = self.cutting.cuts_per_revolution * speed / 60
        frequency, gain = self.starts[group[0]]
        centres = np.log([f for f, _ in self.starts])
        held = Constant(frequency, gain)
        loop = self.search.loop(speed, level, held, coarse=True)
        seen: dict[Crossing, tuple[int, ComplexArray]] = {}

        def own(crossing: Crossing) -> bool:
            if any(abs(crossing.depth / one.crossing.depth - 1) < _SAME for one in tried):
                return False
            seen[crossing] = loop.strongest(crossing)
            line = abs(seen[crossing][0] + crossing.fraction) * tooth
            return int(np.argmin(np.abs(np.log(line) - centres))) in group

        found = first_crossings(loop, self._shapes[group[0]].folded(tooth), own, min(_CLOSE * ceiling, _DEEPEST))
        finer = self.search.loop(speed, level, held)
        again = [(one, near(finer, one)) for one in found]
        real = [one for one, other in again if other.kind and abs(other.depth / one.depth - 1) <= _SAME]
        if len(real) < len(found) and not tried:
            return None
        return [Persistent(one, *seen[one], gain) for one in real]

    @cached_property
    def _shapes(self) -> list[Shape]:
        return [self.search.resolved(frequency, gain) for frequency, gain in self.starts]

    def _settled(self, found: list[Persistent], speeds: list[float]) -> list[Persistent | None]:
        """The vibrations with joints, frequency and force that agree, resolved until a finer level changes nothing."""
        tooth = self.cutting.cuts_per_revolution * np.array(speeds) / 60
        ends: list[Persistent | None] = [None] * len(found)
        going = dict(enumerate(found))
        for level in range(_RAISES):
            agreeing = self._agreeing(going, speeds, tooth, level)
            for i, after in agreeing.items():
                if level and abs(after.crossing.depth / going[i].crossing.depth - 1) <= self.method.tolerance:
                    ends[i] = after
            going = {i: after for i, after in agreeing.items() if ends[i] is None}
        done = [(i, one) for i, one in enumerate(ends) if one is not None]
        if done:
            held = self.joints(*_lines([one for _, one in done], tooth[[i for i, _ in done]]))
            for (i, one), gain, outcome in zip(done, held.gain, held.outcomes, strict=True):
                ends[i] = replace(one, gain=gain, outcome=outcome)
        return ends

    def _agreeing(
        self, found: dict[int, Persistent], speeds: list[float], tooth: Array, level: int
    ) -> dict[int, Persistent]:
        """Those of some vibrations whose joints, frequency and force can be made to agree."""
        agreed: dict[int, Persistent] = {}
        going = dict(found)
        for _ in range(_ROUNDS):
            if not going:
                break
            in_time()
            each, going = going, {}
            for i, held in zip(each, self._following(list(each.values()), tooth[list(each)]), strict=True):
                loop = self.method.loop(speeds[i], level, held)
                try:
                    crossing = near(loop, each[i].crossing)
                except InputError:  # so far from where it was that gains run straight no longer and a joint would feed
                    continue
                if not crossing.kind:
                    continue
                order, direction = loop.strongest(crossing, each[i].order)
                change = abs(crossing.depth / each[i].crossing.depth - 1)
                (agreed if change <= _SETTLED else going)[i] = Persistent(crossing, order, direction)
        return agreed

    def _following(self, found: list[Persistent], tooth: Array) -> list[Held]:
        """The joints as they are when the line of each vibration is at ν; near by, their gains run straight."""
        start, direction = _lines(found, tooth)
        both = np.concatenate([start, start * (1 + _BESIDE)])
        here, beside = np.split(self.joints(both, np.concatenate([direction, direction])).gain, 2)
        slope = (beside - here) / (_BESIDE * start)[:, None]
        orders = [one.order for one in found]
        return [Straight(*one) for one in zip(orders, tooth.tolist(), start.tolist(), here, slope, strict=True)]


@dataclass(eq=False)
class _Look:
    """What a group of resonances has shown at a speed: ``up_to`` which depth (m), and after how many ``searches``."""

    group: list[int]
    settled: list[Persistent] = field(default_factory=list)
    tried: list[Persistent] = field(default_factory=list)
    up_to: float = 0.0
    searches: int = 0

    def further(self, ceiling: float) -> bool:
        """Whether it has to be searched up to a depth in m."""
        return not self.settled and self.searches < _TRIES and _ENOUGH * self.up_to < ceiling


def _lowest_of(looks: list[_Look]) -> list[Persistent]:
    """What settled, else all that did not."""
    stalled = [replace(one, outcome=Outcome.STALLED) for look in looks for one in look.tried]
    return [one for look in looks for one in look.settled] or stalled


@dataclass(frozen=True, eq=False)
class Straight:
    """Joints at the line ν + ``order`` of the tooth frequency (Hz): ``here`` at ``start`` (Hz), with that slope."""

    order: int
    tooth: float
    start: float
    here: ComplexArray
    slope: ComplexArray

    def __call__(self, fraction: Array) -> tuple[Array, ComplexArray]:
        chatter = np.abs(fraction + self.order) * self.tooth
        return chatter, self.here + (chatter - self.start)[:, None] * self.slope


def _lines(found: list[Persistent], tooth: Array) -> tuple[Array, ComplexArray]:
    """Frequencies in Hz and directions of the force of some vibrations, (n,) and (n, axes)."""
    return np.array([one.line for one in found]) * tooth, np.array([one.direction for one in found])
