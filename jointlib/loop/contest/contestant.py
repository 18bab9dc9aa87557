"""Who takes part in a contest: an effect of the joint, or a fault at one channel or body."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array
from jointlib.effect import JointEffect, Scale
from jointlib.errors import InputError
from jointlib.fault import Fault, Shape
from jointlib.joint import Joint
from jointlib.loop.answer.report import Estimate
from jointlib.loop.balance.bench import Found, label_of, view_of
from jointlib.loop.contest.features import features
from jointlib.loop.contest.fitted import Fitted, columns_of, fault_block, fault_parts, fit, free_parameters
from jointlib.loop.contest.trial import Trial, trial, trial_of_its_own


class Contestant(ABC):
    """What a contest needs of a candidate, whether it acts in the joint or in the measurement."""

    @property
    @abstractmethod
    def effect(self) -> JointEffect | Fault: ...

    @property
    def label(self) -> str:
        """What it competes as: the family, with the channel or body where it has one."""
        return self.effect.family

    @property
    def site(self) -> str:
        return ""

    @abstractmethod
    def shapes(self, fitted: Fitted) -> tuple[Shape, ...]:
        """Grid of shape parameters; empty where it does not apply."""

    @abstractmethod
    def trials(self, fitted: Fitted, shapes: Sequence[Shape]) -> list[Trial]:
        """Fits beside the model at each shape that the model cannot imitate."""

    @abstractmethod
    def block(self, fitted: Fitted, shape: Shape) -> Array:
        """Whitened real columns at one shape, (q, n)."""

    @abstractmethod
    def admissible(self, coefficients: Array, shape: Shape, fitted: Fitted) -> bool:
        """The sign rule."""

    @abstractmethod
    def grown(self, coefficients: Array, shape: Shape, fitted: Fitted) -> Fitted | None:
        """The model with the candidate in it, everything that may move refitted."""

    @abstractmethod
    def parameters(self, coefficients: Array, shape: Shape, fitted: Fitted) -> Mapping[str, Estimate]:
        """Physical parameters at the linear fit, without errors."""


@dataclass(frozen=True)
class InJoint(Contestant):
    """An effect that a joint law can express."""

    joint_effect: JointEffect

    @property
    def effect(self) -> JointEffect:
        return self.joint_effect

    def shapes(self, fitted: Fitted) -> tuple[Shape, ...]:
        return self.joint_effect.shapes(scale_of(fitted), fitted.joint)

    def trials(self, fitted: Fitted, shapes: Sequence[Shape]) -> list[Trial]:
        try:
            forces = features(fitted.records, self.joint_effect, shapes, fitted.joint)
        except InputError:
            return []
        found, repeats = [], all(o.whole_path is None for o in fitted.records)
        row = fitted.layout.joint_row if repeats else fitted.layout.row
        for shape, F in zip(shapes, forces, strict=True):
            columns = [o.whitened_force(f) for o, f in zip(fitted.records, F, strict=True)]
            found.append(trial(fitted.model, shape, row(columns), joint_only=repeats))
        return [t for t in found if t is not None]

    def block(self, fitted: Fitted, shape: Shape) -> Array:
        return columns_of(fitted.records, features(fitted.records, self.joint_effect, [shape], fitted.joint)[0])

    def admissible(self, coefficients: Array, shape: Shape, fitted: Fitted) -> bool:
        if not self.joint_effect.reached(shape, scale_of(fitted)):
            return False
        return self._applied(coefficients, shape, fitted) is not None

    def _applied(self, coefficients: Array, shape: Shape, fitted: Fitted) -> Joint | None:
        try:
            return self.joint_effect.apply(coefficients, shape, fitted.joint)
        except InputError:
            return None

    def grown(self, coefficients: Array, shape: Shape, fitted: Fitted) -> Fitted | None:
        mended = self._applied(coefficients, shape, fitted)
        if mended is None:
            return None
        new = moved_by(self.joint_effect, coefficients, shape, fitted.joint)
        wanted = dict.fromkeys([*free_parameters(mended), *new])
        # What the effect brought in or set, and what was free before; what was held stays held.
        brought = set(new) | (mended.parameters.keys() - fitted.joint.parameters.keys())
        names = [n for n in wanted if n in brought or (n in fitted.free and n not in fitted.held)]
        return fit(fitted.raws, mended, names, fitted.found)

    def parameters(self, coefficients: Array, shape: Shape, fitted: Fitted) -> Mapping[str, Estimate]:
        mended = self._applied(coefficients, shape, fitted)
        if mended is None:
            return {n: bare(v, "") for n, v in shape.items()}
        values, units = mended.parameters, mended.units
        return {n: bare(values[n], units[n]) for n in moved_by(self.joint_effect, coefficients, shape, fitted.joint)}


@dataclass(frozen=True)
class InRig(Contestant):
    """A fault at one place of the rig."""

    fault: Fault
    where: str

    @property
    def effect(self) -> Fault:
        return self.fault

    @property
    def label(self) -> str:
        return label_of(self.fault, self.where)

    @property
    def site(self) -> str:
        return self.where

    def shapes(self, fitted: Fitted) -> tuple[Shape, ...]:
        if any(f.label == self.label for f in fitted.found):
            return ()
        return self.fault.shapes(fitted.views, self.where)

    def trials(self, fitted: Fitted, shapes: Sequence[Shape]) -> list[Trial]:
        found = []
        for shape in shapes:
            parts = fault_parts(fitted.views, self._found(np.zeros(0), shape, fitted))
            if self.fault.per_record:
                found.append(trial_of_its_own(fitted.model, shape, parts))
            else:
                found.append(trial(fitted.model, shape, fitted.layout.row(parts), joint_only=False))
        return [t for t in found if t is not None]

    def block(self, fitted: Fitted, shape: Shape) -> Array:
        return fault_block(fitted.views, self._found(np.zeros(0), shape, fitted))

    def _found(self, coefficients: Array, shape: Shape, fitted: Fitted) -> Found:
        sets = self._sets(coefficients, fitted)
        corrections = [self.fault.correction(c, shape) if c.size else {} for c in sets]
        return Found(self.fault, self.where, shape, tuple(c or {} for c in corrections), tuple(sets))

    def _sets(self, coefficients: Array, fitted: Fitted) -> list[Array]:
        """One set of coefficients, or one a record."""
        return list(coefficients.reshape(len(fitted.raws), -1)) if self.fault.per_record else [coefficients]

    def admissible(self, coefficients: Array, shape: Shape, fitted: Fitted) -> bool:
        found = [self.fault.correction(c, shape) for c in self._sets(coefficients, fitted)]
        known = [p for p in found if p is not None]
        possible = all(self.fault.possible(fitted.views[0], self.where, p) for p in known)
        return possible and len(known) == len(found) and self.fault.shows(known, fitted.views)

    def grown(self, coefficients: Array, shape: Shape, fitted: Fitted) -> Fitted | None:
        if not self.admissible(coefficients, shape, fitted):
            return None
        found = (*fitted.found, self._found(coefficients, shape, fitted))
        try:
            return fit(fitted.raws, fitted.joint, fitted.free, found)
        except InputError:
            return None

    def parameters(self, coefficients: Array, shape: Shape, fitted: Fitted) -> Mapping[str, Estimate]:
        found = self._found(coefficients, shape, fitted)
        return fault_estimates(found, {}, self._unit(fitted))

    def _unit(self, fitted: Fitted) -> str:
        return channel_unit(self.where)


def tried(c: Contestant, fitted: Fitted, shapes: Sequence[Shape]) -> list[Trial]:
    """Trials of a contestant beside a model, those of an earlier contest over the same model remembered."""
    known, keys = fitted.tried, [(c, *s.items()) for s in shapes]
    new = {k: s for k, s in zip(keys, shapes, strict=True) if k not in known}
    if new:
        known.update(dict.fromkeys(new))
        known.update({(c, *t.shape.items()): t for t in c.trials(fitted, [*new.values()])})
    return [t for k in keys if (t := known[k]) is not None]


def channel_unit(channel: str) -> str:
    """SI unit of a channel of a rig."""
    return "N" if channel == "P" else "m/s^2"


def fault_estimates(found: Found, errors: Mapping[str, float], unit: str) -> dict[str, Estimate]:
    """Parameters of a fault; where every record has its own, the root mean square over the records."""
    out = {}
    for name, declared in found.fault.parameters.items():
        values = [p[name] for p in found.parameters if name in p]
        if not values:
            continue
        value = values[0] if len(found.parameters) == 1 else float(np.sqrt(np.mean(np.square(values))))
        error = errors.get(name, float("nan"))
        per = f"({unit})" if "/" in unit else unit
        shown = {"channel": unit, "1": ""}.get(declared, declared.replace("channel", per))
        out[name] = Estimate(
            value, shown, error, (value - 1.96 * error, value + 1.96 * error), "noise", found.fault.biased
        )
    return out


def bare(value: float, unit: str) -> Estimate:
    """A value without an error."""
    nan = float("nan")
    return Estimate(float(value), unit, nan, (nan, nan))


def scale_of(fitted: Fitted) -> Scale:
    """Size of the motion, over all records."""
    paths = [o.path for o in fitted.records]
    z = max(float(np.abs(p[0]).max()) for p in paths)
    v = float(np.sqrt(np.mean([np.mean(p[1] ** 2) for p in paths])))
    return Scale(z, v, max(0.0, float(np.mean([o.stiffness for o in fitted.records]))))


def moved_by(effect: JointEffect, coefficients: Array, shape: Shape, joint: Joint) -> tuple[str, ...]:
    """Parameters of the mended joint that the coefficients and shape of an effect set."""
    mended = effect.apply(coefficients, shape, joint)
    if mended is None:
        return ()
    here, moved = mended.parameters, set()
    variants: list[tuple[Array, Shape]] = []
    for i in range(len(coefficients)):
        changed = np.array(coefficients, dtype=float)
        changed[i] *= 1.001
        variants.append((changed, shape))
    variants += [(coefficients, {**shape, n: v * 1.001}) for n, v in shape.items()]
    for c, s in variants:
        try:
            other = effect.apply(c, s, joint)
        except InputError:
            continue
        if other is not None and other.parameters.keys() == here.keys():
            moved |= {n for n, v in other.parameters.items() if v != here[n]}
    return tuple(n for n in here if n in moved)


def contestants(effects: Sequence[JointEffect], faults: Sequence[Fault], fitted: Fitted) -> tuple[Contestant, ...]:
    """Every effect, and every fault at each place where these records can show it."""
    view = view_of(fitted.raws[0], fitted.records[0])
    rig = fitted.raws[0].rig
    have = {name for name in ("a1", "a2", "a3") if view.has(name)} | ({"P"} if rig.has_balance else set())
    sited = [InRig(f, site) for f in faults if f.needs <= have for site in f.sites(view)]
    return (*(InJoint(e) for e in effects), *sited)
