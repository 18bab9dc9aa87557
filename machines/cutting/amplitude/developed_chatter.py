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

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import CheckFailed, InputError, Outcome

from ...deadline import in_time
from ...operating.operating_point import OperatingPoint
from ...tool.bounded_band import Shape
from ..loops.critical_depth import first_crossings, near
from ..loops.loop_branches import NONE, Crossing
from ..process.cutting import Cutting
from .held_joints import Constant, Held, HeldJoints

_CLOSE = 1.5
"""Times the lowest depth so far up to which a resonance is searched: its joints are not yet those of the crossing."""
_DEEPEST = 1.0
"""m; no cut is deeper, and what a loop closes on far above its limit is what its discretisation left over."""
_SAME, _ALIKE = 0.05, 3e-3
_ROUNDS = 40
_SETTLED = 1e-9
_BESIDE = 1e-4
_PEAK, _MOST = 0.01, 16
_RAISES = 6
_TRIES = 3

Point = Callable[[Array, ComplexArray], OperatingPoint]


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
    point
        The machine at that amplitude at frequencies in Hz, moved by a force along a direction.
    search, method
        How crossings are found, and how they are settled.
    """

    cutting: Cutting
    table: OperatingPoint
    point: Point
    search: HeldJoints
    method: HeldJoints

    def persistent(self, speed: float) -> Persistent:
        """The lowest one at a speed in rpm; its depth is inf where there is none."""
        before: list[Persistent] | None = None
        for level in range(_RAISES):
            found = self._found(speed, level)
            if found or (found is not None and before is not None):
                return min(found, key=lambda one: one.crossing.depth, default=Persistent(NONE))
            before = found
        raise CheckFailed(
            f"lobes: at {speed:g} rpm the depth at that amplitude still changes with the resolution of a tooth period"
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

    def _found(self, speed: float, level: int) -> list[Persistent] | None:
        """The lowest of every resonance, with those that do not settle only if none does; None if under-resolved."""
        settled: list[Persistent] = []
        stalled: list[Persistent] = []
        for group in self.groups:
            tried: list[Persistent] = []
            for _ in range(_TRIES):
                in_time()
                ceiling = min((one.crossing.depth for one in settled), default=np.inf)
                some = self._crossings(speed, level, group, tried, ceiling)
                if some is None:
                    return None
                ends = [self._settled(one, speed) for one in some]
                settled += [one for one in ends if one is not None]
                tried += [one for one, end in zip(some, ends, strict=True) if end is None]
                if not some or any(one is not None for one in ends):
                    break
            stalled += [replace(one, outcome=Outcome.STALLED) for one in tried]
        return settled or stalled

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

    def _settled(self, found: Persistent, speed: float) -> Persistent | None:
        """The vibration with joints, frequency and force that agree, resolved until a finer level changes nothing."""
        for level in range(_RAISES):
            after = self._agreeing(found, speed, level)
            if after is None:
                return None
            if level and abs(after.crossing.depth / found.crossing.depth - 1) <= self.method.tolerance:
                return after
            found = after
        return None

    def _agreeing(self, found: Persistent, speed: float, level: int) -> Persistent | None:
        tooth = self.cutting.cuts_per_revolution * speed / 60
        for _ in range(_ROUNDS):
            in_time()
            loop = self.method.loop(speed, level, self._following(found, tooth))
            try:
                crossing = near(loop, found.crossing)
            except InputError:  # so far from where it was that gains run straight no longer and a joint would feed it
                return None
            if not crossing.kind:
                return None
            order, direction = loop.strongest(crossing, found.order)
            change = abs(crossing.depth / found.crossing.depth - 1)
            found = Persistent(crossing, order, direction)
            if change <= _SETTLED:
                point = self.point(np.array([found.line * tooth]), direction)
                return replace(found, gain=point.gain[0], outcome=point.outcomes[0])
        return None

    def _following(self, found: Persistent, tooth: float) -> Held:
        """The joints as they are when the line of the vibration is at ν; near by, their gains run straight."""
        assert found.direction is not None
        start = found.line * tooth
        here, beside = self.point(np.array([start, start * (1 + _BESIDE)]), found.direction).gain
        slope = (beside - here) / (_BESIDE * start)

        def held(fraction: Array) -> tuple[Array, ComplexArray]:
            chatter = np.abs(fraction + found.order) * tooth
            return chatter, here + (chatter - start)[:, None] * slope

        return held
