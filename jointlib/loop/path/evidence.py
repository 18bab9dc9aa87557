"""The prepared fit records of a path measurement, with the faults of the force that are known so far undone."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.effect import Scale
from jointlib.joint import Joint
from jointlib.law import JointLaw
from jointlib.loop.path.force.followed import Followed
from jointlib.loop.path.preparation import Run
from jointlib.loop.path.regression import Index
from jointlib.loop.path.repeats import PathFloor
from jointlib.loop.path.strokes import Division
from jointlib.measurement import Mass
from jointlib.modulation import Modulation, is_fitted, lag_name, lags_of, names_of
from jointlib.parameter import parameters_of
from jointlib.path_fault import PathFault, PathRecord

_OF_THE_MOTION = (
    *("acceleration", "rows", "sizes", "run_power", "block_power", "run_weight", "block_weight", "root_weight"),
    *("condition_folds", "scale", "followed_force"),
)
"""Of what an evidence remembers, that which is the same whatever faults of the force are undone."""
_STEP = 1e-2
"""Of a lag, for the slope of the force over it."""
_SLOPE = 1e-5
"""Share of a shape, such as a wavelength, over which the slope of a fault of the force is taken."""


@dataclass(frozen=True)
class Known:
    """A fault of the force that is undone, with its physical parameters."""

    fault: PathFault
    parameters: Mapping[str, float]

    @property
    def shape(self) -> dict[str, float]:
        return {n: value for n, value in self.parameters.items() if n in self.fault.shape_parameters}

    @property
    def names(self) -> tuple[str, ...]:
        """Of its parameters, in the order of its columns: linear ones first."""
        linear = [p for p in self.fault.parameters if p not in self.shape]
        return tuple(f"{self.fault.family.replace('-', '_')}.{p}" for p in (*linear, *self.shape))

    def moved(self, step: Array) -> Known:
        """With the parameters moved by the coefficients that are left beside the undone fault."""
        own, shape = step[: len(step) - len(self.shape)], self.shape
        further = self.fault.correction(own, shape)
        if further is None:
            return self
        steps = zip(shape.items(), step[len(own) :].tolist(), strict=True)
        turned = {n: value + float(np.clip(by, -value / 2, value / 2)) for (n, value), by in steps}
        return replace(self, parameters={**self.fault.combined(self.parameters, further), **turned})

    def columns(self, record: PathRecord) -> Array:
        """What each parameter adds to F per unit, at the full rate, (parameter, sample): a shape by its slope there."""
        slopes = []
        for name, value in self.shape.items():
            step = _SLOPE * value
            more, less = (self._added(record, {**self.parameters, name: value + h}) for h in (step, -step))
            slopes.append((more - less) / (2 * step))
        return np.vstack([self.fault.columns(record, self.shape), *slopes])

    def _added(self, record: PathRecord, parameters: Mapping[str, float]) -> Array:
        return -self.fault.undo(np.zeros_like(record.force), record.time, record.position, parameters)


@dataclass(frozen=True)
class Model:
    """A joint, and what is wrong with the force beside it."""

    joint: Joint
    faults: tuple[Known, ...] = ()


@dataclass(frozen=True)
class Evidence:
    """F = m a + f(z, ż) + F0 on the records that take part in the choice, laid end to end."""

    recorded: tuple[Run, ...]
    """As they were read."""
    carriage: Mass | None
    division: Division
    floor: PathFloor
    law_force: Callable[[JointLaw], Array]
    """Force of a law along all records, filtered and thinned like the measured one; remembered."""
    faults: tuple[Known, ...] = ()
    own_offsets: bool = False
    """True where every record has an offset F0 of its own: forces and columns are then less their mean over each
    record, of those left out of a fit as well. The mean says what came before a record, or where its zero was."""

    def without(self, faults: tuple[Known, ...]) -> Evidence:
        """The same records with these faults undone, and no others; what no fault changes is not computed again."""
        if faults == self.faults:
            return self
        return self._with(faults=faults)

    def with_own_offsets(self) -> Evidence:
        """The same records, each with an offset of its own."""
        return self._with(own_offsets=True)

    def _with(self, **changed: Any) -> Evidence:
        other = replace(self, **changed)
        other.__dict__.update({name: getattr(self, name) for name in _OF_THE_MOTION})
        return other

    @cached_property
    def runs(self) -> tuple[Run, ...]:
        """The records with the known faults undone."""
        runs = self.recorded
        for known in self.faults:
            runs = tuple(run.without(known.fault, known.parameters) for run in runs)
        return runs

    @cached_property
    def force(self) -> Array:
        """Measured force F, N."""
        return np.concatenate([run.force[run.keep] for run in self.runs])

    @cached_property
    def acceleration(self) -> Array:
        return np.concatenate([run.acceleration[run.keep] for run in self.runs])

    @cached_property
    def mass(self) -> float | None:
        """kg that is known to move along the path, declared or found; None where it is fitted or there is none."""
        found = [known.parameters["mass"] for known in self.faults if known.fault.inertia]
        return sum(found) if found else self.carriage.value if self.carriage else None

    def centred(self, x: Array) -> Array:
        """Forces along the records, (…, sample), less their mean over each where every record has its own offset."""
        if not self.own_offsets:
            return x
        return np.concatenate([own - own.mean(axis=-1, keepdims=True) for own in self._apart(x)], axis=-1)

    def _apart(self, x: Array) -> list[Array]:
        return np.split(x, np.cumsum([len(run.time) for run in self.recorded])[:-1], axis=-1)

    @cached_property
    def target(self) -> Array:
        """F less the inertia of a known mass."""
        return self.centred(self._driving)

    @cached_property
    def _driving(self) -> Array:
        return self.force - self.mass * self.acceleration if self.mass is not None else self.force

    def offsets(self, joint: Joint) -> Array:
        """The mean of what a joint leaves of the force of each record, N, (record,)."""
        return np.array([own.mean() for own in self._apart(self._driving - self._pull(joint))])

    @cached_property
    def rows(self) -> tuple[Index, ...]:
        return self.division.rows(self.runs)

    @cached_property
    def sizes(self) -> Array:
        return np.array([len(r) for r in self.rows])

    @cached_property
    def run_power(self) -> Array:
        """Mean of F² over the blocks of each record as it was read, N²; its whole where it has no blocks."""
        out = []
        force, start = np.concatenate([run.force[run.keep] for run in self.recorded]), 0
        for i, run in enumerate(self.recorded):
            own = [r for b, r in zip(self.division.blocks, self.rows, strict=True) if b.run == i]
            rows = np.concatenate(own) if own else np.arange(start, start + len(run.time))
            out.append(float(np.mean(force[rows] ** 2)))
            start += len(run.time)
        return np.array(out)

    @cached_property
    def block_power(self) -> Array:
        """Mean of F² of the record that a block belongs to, N²."""
        return np.asarray(self.run_power[[b.run for b in self.division.blocks]])

    @cached_property
    def run_weight(self) -> Array:
        """Every record counts the same in a fit, whatever its length and power; mean 1 over the samples."""
        lengths = np.array([len(run.time) for run in self.recorded])
        weight = 1 / (lengths * np.maximum(self.run_power, 1e-12 * self.run_power.max()))
        return np.asarray(weight * lengths.sum() / (weight @ lengths))

    @cached_property
    def block_weight(self) -> Array:
        return np.asarray(self.run_weight[[b.run for b in self.division.blocks]])

    @cached_property
    def root_weight(self) -> Array:
        """Square root of the weight of every sample."""
        return np.sqrt(np.repeat(self.run_weight, [len(run.time) for run in self.recorded]))

    @cached_property
    def condition_folds(self) -> Index:
        """Number of the condition of every block."""
        names = self.division.conditions
        return np.array([names.index(b.condition) for b in self.division.blocks], dtype=np.int64)

    @property
    def deciding_folds(self) -> Index:
        """Fold number of every block: conditions, or the blocks themselves where there is one trajectory."""
        return self.condition_folds if len(self.division.conditions) > 1 else self.floor.block_folds

    @cached_property
    def scale(self) -> Scale:
        paths = [run.path for run in self.recorded]
        peak = max(float(np.max(np.abs(p.displacement))) for p in paths)
        return Scale(peak, float(np.sqrt(np.mean(np.concatenate([p.velocity for p in paths]) ** 2))), 0.0)

    def joint_force(self, joint: Joint) -> Array:
        """Σ of the laws' forces, N."""
        return self.centred(self._pull(joint))

    def _pull(self, joint: Joint) -> Array:
        total = np.zeros(len(self.force))
        followed = self.followed(joint)
        roles = {m.role for m in followed}
        for law in joint.laws:
            if roles & {p.role for p in parameters_of(law)}:
                total = total + self.followed_force.force(law, followed)
            else:
                total = total + self.law_force(law)
        return total

    def followed(self, joint: Joint) -> tuple[Modulation, ...]:
        """The modulations of a joint whose input these records have; the others stay at their reference."""
        return tuple(m for m in joint.modulations if all(m.condition in run.inputs for run in self.recorded))

    @cached_property
    def followed_force(self) -> Followed:
        """Forces of laws whose parameters follow inputs; remembered."""
        return Followed(self.recorded)

    def follower_columns(self, joint: Joint, modulation: Modulation) -> Array:
        """What each coefficient of a modulation of the joint adds to F, filtered and thinned, (coefficient, sample)."""
        return self.centred(self.followed_force.columns(joint, modulation))

    def lag_column(self, joint: Joint, condition: str, lag: float) -> Array:
        """What a second of lag adds to F where the parameters follow an input with such a lag, (1, sample)."""
        return (self.joint_force(joint.lagging(condition, lag)) - self.joint_force(joint))[None] / lag

    def beside(self, joint: Joint) -> tuple[tuple[str, ...], Array]:
        """Columns that are fitted linearly beside a joint's parameters: the plant, and what its modulations lack."""
        names, columns = list(self.plant[0]), [self.plant[1]]
        for m in filter(is_fitted, self.followed(joint)):
            found = self.follower_columns(replace(joint, modulations=self.followed(joint)), m)
            names += names_of(m)
            columns.append(found)
        for condition, lag in lags_of(self.followed(joint)).items():
            more, less = (self.joint_force(joint.lagging(condition, f * lag)) for f in (1 + _STEP, 1 - _STEP))
            names.append(lag_name(condition))
            columns.append((more - less)[None] / (2 * _STEP * lag))
        return tuple(names), np.concatenate(columns)

    def fault_columns(self, fault: PathFault, shape: Mapping[str, float]) -> Array:
        """What each coefficient of a fault adds to F, filtered and thinned, (coefficient, sample)."""
        return self._of_fault(fault, lambda record: fault.columns(record, shape))

    def _of_fault(self, fault: PathFault, columns: Callable[[PathRecord], Array]) -> Array:
        if fault.inertia:
            return self.centred(self.acceleration[None])
        return self.centred(np.concatenate([run.column(columns(run.recorded)) for run in self.runs], axis=1))

    @cached_property
    def plant(self) -> tuple[tuple[str, ...], Array]:
        """Columns that belong to no joint: unit mass where it is unknown, a constant offset, and what is left of the
        known faults."""
        names, columns = ["offset"], [np.ones((1, len(self.force)))]
        if self.carriage is not None and self.carriage.value is None:
            names, columns = ["mass", *names], [self.centred(self.acceleration[None]), *columns]
        for known in self.faults:
            names += known.names
            columns.append(self._of_fault(known.fault, known.columns))
        return tuple(names), np.concatenate(columns)
