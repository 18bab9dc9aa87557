"""What may be hidden: an effect of the catalogue, in a size at which it matters, no sharper than real ones are."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array
from jointlib.effect import JointEffect, Path
from jointlib.errors import InputError
from jointlib.fault import Fault
from jointlib.joint import Joint
from jointlib.planning.motion import Moved, joint_force
from jointlib.planning.simulated import Bench, Hidden
from jointlib.planning.spoiled import spoiled

SPREAD = (0.8, 1.0, 1.25)
"""No contact has the corner of a formula: an effect is the mean of three whose shape parameters differ so."""
_SIZINGS, _SIZED = 12, 0.02
_LARGE_ENOUGH = 0.4
"""Logarithm of wanted over found size."""
_SET = 3.0
"""The same for an effect that sets a parameter, which has a size of its own."""
_FURTHER = (0.3, 0.9)
"""Further coefficients, where the first is 1."""


class Truth(ABC):
    """An effect in question that can be simulated."""

    @property
    @abstractmethod
    def name(self) -> str:
        """As it is asked for and answered: the family, with its channel or body."""

    @abstractmethod
    def drawn(self, rng: np.random.Generator, bench: Bench, size: float) -> Hidden | None:
        """One that makes ``size`` of the force or channel; None where it does not apply to this joint."""


@dataclass(frozen=True)
class InJoint(Truth):
    """Of one family, one of these members."""

    effects: tuple[JointEffect, ...]

    @property
    def name(self) -> str:
        return self.effects[0].family

    def drawn(self, rng: np.random.Generator, bench: Bench, size: float) -> Hidden | None:
        """A shape from the middle of those that the loop tries, of either sign that is physical."""
        joint, moved, scale = bench.joint, bench.top, bench.scale
        effect = self.effects[int(rng.integers(len(self.effects)))]
        shapes = [s for s in effect.shapes(scale, joint) if effect.reached(s, scale)]
        if not shapes:
            return None
        shape = _middle(shapes, rng)
        moving = [n for n in shape if min(s[n] for s in shapes) >= 0 and len({s[n] for s in shapes}) > 1]
        sign = float(rng.choice([-1.0, 1.0]))
        for way in (sign, -sign):
            found = self._sized(rng, effect, shape, moving, joint, moved, size, way)
            if found is not None:
                left = _beside_linear(_added_force(found, joint, moved), moved) / float(np.std(moved.force))
                return Hidden(self.name, found, left)
        return None

    def _sized(
        self,
        rng: np.random.Generator,
        effect: JointEffect,
        shape: Mapping[str, float],
        moving: Collection[str],
        joint: Joint,
        moved: Moved,
        size: float,
        way: float,
    ) -> Joint | None:
        """The joint in which the effect leaves ``size`` of the force, beside what spring and damper take up of it."""
        wanted = size * float(np.std(moved.force))
        units = _units(effect, shape, joint, rng)
        reach = np.abs(moved.z).max()
        adds = _adds(effect, shape, joint, units)
        amount = way * (float(np.std(moved.force)) / float(reach) if adds else 1.0)
        best: tuple[float, Joint] | None = None
        for _ in range(_SIZINGS):
            made = _with(effect, shape, moving, joint, amount * units)
            if made is None:
                amount *= 0.5
                continue
            left = _beside_linear(_added_force(made, joint, moved), moved)
            off = abs(np.log(left / wanted)) if left > 0 and np.isfinite(left) else np.inf
            if best is None or off < best[0]:
                best = off, made
            if off < _SIZED or not np.isfinite(off):
                break
            amount *= float(np.clip(wanted / left, 1e-12, 1e12))
        return None if best is None or best[0] > (_LARGE_ENOUGH if adds else _SET) else best[1]


def _adds(effect: JointEffect, shape: Mapping[str, float], joint: Joint, units: Array) -> bool:
    """Whether an effect adds laws to the joint, rather than to set a parameter of one."""
    for way in (1e-6, -1e-6):
        made = _applied(effect, way * units, shape, joint)
        if made is not None:
            return made.laws[: len(joint.laws)] == joint.laws and len(made.laws) > len(joint.laws)
    return True


@dataclass(frozen=True)
class OfSensors(Truth):
    """A fault at one channel or body, or of the rig."""

    fault: Fault
    site: str

    @property
    def name(self) -> str:
        return f"{self.fault.family}@{self.site}" if self.site else self.fault.family

    def drawn(self, rng: np.random.Generator, bench: Bench, size: float) -> Hidden | None:
        c, way = bench.campaign, float(rng.choice([-1.0, 1.0]))
        top = {n: x[:, 0] for n, x in bench.shown(bench.top).items()}
        seconds = c.periods * c.period / c.sample_rate
        found = spoiled(self.fault, self.site, top, bench.setup, c.sample_rate, seconds, size, way)
        return Hidden(self.name, bench.joint, size, found)


def _added_force(made: Joint, joint: Joint, moved: Moved) -> Array:
    """N, of the laws that an effect added; where it set a parameter, the difference that this makes."""
    if made.laws[: len(joint.laws)] == joint.laws:
        return joint_force(Joint(made.laws[len(joint.laws) :]), moved.z, moved.v, moved.step)
    return joint_force(made, moved.z, moved.v, moved.step) - moved.force


def _with(
    effect: JointEffect, shape: Mapping[str, float], moving: Collection[str], joint: Joint, amount: Array
) -> Joint | None:
    """The joint with the effect spread over three shapes; one that only sets a parameter is applied once."""
    once = _applied(effect, amount, shape, joint)
    if once is None:
        return None
    if once.laws[: len(joint.laws)] != joint.laws or not moving:
        return once
    made = joint
    for factor in SPREAD:
        part = {n: v * factor if n in moving else v for n, v in shape.items()}
        found = _applied(effect, amount / len(SPREAD), part, made)
        if found is None:
            return once
        made = found
    return made


def _units(effect: JointEffect, shape: Mapping[str, float], joint: Joint, rng: np.random.Generator) -> Array:
    """Coefficients of about one, as many as the effect has, not all alike."""
    path = Path(np.array([0.0, 1e-6, 0.0]), np.array([1e-3, 0.0, -1e-3]), 1e-5)
    count = len(effect.columns(path, shape, joint))
    return np.concatenate([[1.0], rng.uniform(*_FURTHER, count - 1)])


def _applied(effect: JointEffect, amount: Array, shape: Mapping[str, float], joint: Joint) -> Joint | None:
    try:
        return effect.apply(amount, shape, joint)
    except InputError:
        return None


def _middle(shapes: Sequence[Mapping[str, float]], rng: np.random.Generator) -> Mapping[str, float]:
    """A shape none of whose numbers is the smallest or largest that is tried, where there are that many."""
    inside = []
    for s in shapes:
        edges = 0
        for name, value in s.items():
            tried = sorted({o[name] for o in shapes})
            edges += len(tried) > 3 and value in (tried[0], tried[-1])
        inside.append(edges == 0)
    kept = [s for s, inner in zip(shapes, inside, strict=True) if inner] or list(shapes)
    return kept[int(rng.integers(len(kept)))]


def _beside_linear(force: Array, moved: Moved) -> float:
    """Rms of a force along the highest level, less what a spring, a damper and a mean take up of it; N."""
    z, v, f = (x[:, -1] for x in (moved.z, moved.v, force))
    known = np.array([z / np.std(z), v / np.std(v), np.ones_like(z)])
    left = f - np.linalg.solve(known @ known.T, known @ f) @ known
    return float(np.std(left))
