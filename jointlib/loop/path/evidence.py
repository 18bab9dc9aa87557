"""The prepared fit records of a path measurement, and a joint fitted to them."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from jointlib.arrays import Array
from jointlib.effect import Scale
from jointlib.errors import InputError
from jointlib.joint import Covariance, Joint
from jointlib.law import JointLaw, Motion
from jointlib.loop.path.preparation import Run
from jointlib.loop.path.regression import Index, block_grams, clustered_covariance, hold_out
from jointlib.loop.path.repeats import PathFloor
from jointlib.loop.path.strokes import Division
from jointlib.loop.refit import refit
from jointlib.measurement import Mass

_LINEAR_PROBE = np.array([[0.7, -0.3, 0.9, -0.8], [0.2, 0.9, -0.6, -0.5]])


@dataclass(frozen=True)
class Evidence:
    """F = m a + f(z, ż) + F0 on the records that take part in the choice, laid end to end."""

    runs: tuple[Run, ...]
    carriage: Mass | None
    division: Division
    floor: PathFloor
    law_force: Callable[[JointLaw], Array]
    """Force of a law along all records, filtered and thinned like the measured one; remembered."""

    @cached_property
    def force(self) -> Array:
        """Measured force F, N."""
        return np.concatenate([run.force[run.keep] for run in self.runs])

    @cached_property
    def acceleration(self) -> Array:
        return np.concatenate([run.acceleration[run.keep] for run in self.runs])

    @cached_property
    def target(self) -> Array:
        """F less the inertia of a carriage of known mass."""
        known = self.carriage.value if self.carriage else None
        return self.force - known * self.acceleration if known is not None else self.force

    @cached_property
    def rows(self) -> tuple[Index, ...]:
        return self.division.rows(self.runs)

    @cached_property
    def block_power(self) -> Array:
        """Mean of F² over the blocks of the record that a block belongs to, N²."""
        F, rows = self.force, self.rows
        owner = np.array([b.run for b in self.division.blocks])
        squares = np.array([F[r] @ F[r] for r in rows])
        sizes = np.array([len(r) for r in rows])
        by_run = {int(o): squares[owner == o].sum() / sizes[owner == o].sum() for o in set(owner)}
        return np.array([by_run[int(o)] for o in owner])

    @cached_property
    def condition_folds(self) -> Index:
        """Number of the condition of every block."""
        names = self.division.conditions
        return np.array([names.index(b.condition) for b in self.division.blocks], dtype=np.int64)

    @cached_property
    def scale(self) -> Scale:
        paths = [run.path for run in self.runs]
        peak = max(float(np.max(np.abs(p.displacement))) for p in paths)
        return Scale(peak, float(np.sqrt(np.mean(np.concatenate([p.velocity for p in paths]) ** 2))), 0.0)

    def joint_force(self, joint: Joint) -> Array:
        """Σ of the laws' forces, N."""
        return np.asarray(np.sum([self.law_force(law) for law in joint.laws], axis=0) + np.zeros(len(self.force)))

    def plant_columns(self) -> tuple[tuple[str, ...], Array]:
        """Columns that belong to no joint: unit mass where it is unknown, and a constant offset."""
        ones = np.ones(len(self.force))
        if self.carriage is not None and self.carriage.value is None:
            return ("mass", "offset"), np.array([self.acceleration, ones])
        return ("offset",), ones[None]


@dataclass(frozen=True)
class Fitted:
    """A joint refitted together with mass and offset; ``columns`` are its tangents ∂F/∂parameter."""

    joint: Joint
    plant: tuple[float, ...]
    names: tuple[str, ...]
    """Mass and offset first, then the free joint parameters."""
    columns: Array
    model: Array
    """Fitted F less known inertia, N."""
    residual: Array
    covariance: Array
    widened: tuple[bool, ...]
    """True where the spread over condition folds exceeds the error from the noise."""
    in_sample: float
    """rms of the residual over rms of F."""
    condition_loss: Array | None
    """Mean squared held-out residual of every block over the power of its record; None without two conditions."""
    block_loss: Array

    @property
    def deciding_loss(self) -> Array:
        """Losses over condition folds, over block folds where there is one trajectory only."""
        return self.block_loss if self.condition_loss is None else self.condition_loss

    def standard_error(self, name: str) -> float:
        if name not in self.names:
            return float("nan")
        i = self.names.index(name)
        return float(np.sqrt(self.covariance[i, i]))


def law_forces(runs: Sequence[Run]) -> Callable[[JointLaw], Array]:
    """The force of a law along prepared records.

    A linear law commutes with the filter, so the filtered path already gives its filtered force; any other law is
    evaluated on the full-rate path and its force filtered like the measured one.
    """

    def along(law: JointLaw) -> Array:
        out = []
        for run in runs:
            path = run.stepped(bool(law.states))
            full = run.spread(Joint((law,)).force_along(path.displacement, path.velocity, path.time_step))
            out.append(full[run.keep] if _is_linear(law, run) else run.column(full))
        return np.concatenate(out)

    return lru_cache(maxsize=128)(along)


def _is_linear(law: JointLaw, run: Run) -> bool:
    """True if forces add up over motions whatever the parameters."""
    if law.states:
        return False
    size = np.array([np.max(np.abs(run.path.displacement)), np.max(np.abs(run.path.velocity))])[:, None]
    first, second = _LINEAR_PROBE * size, np.roll(_LINEAR_PROBE, 1, axis=1) * size
    joint = Joint((law,))
    moved = {}
    for i, (name, value) in enumerate(joint.parameters.items()):
        moved[name] = value * (1 + 0.1 / (i + 1)) or 1.0
    for probe in (joint, _try(joint, moved)):
        if probe is None:
            continue
        f1, f2, both = (probe.step(Motion(*z), np.empty((4, 0)))[0] for z in (first, second, first + second))
        if not np.allclose(both, f1 + f2, rtol=1e-9, atol=1e-9 * float(np.max(np.abs(both)) + 1e-300)):
            return False
    return True


def _try(joint: Joint, values: dict[str, float]) -> Joint | None:
    try:
        return joint.with_parameters(values)
    except InputError:
        return None


def tangents(evidence: Evidence, joint: Joint) -> tuple[tuple[str, ...], Array]:
    """∂f/∂θ of every free parameter that has influence, by central differences (exact where f is linear in θ)."""
    names, columns = [], []
    at = joint.parameters
    for name in free_parameters(joint):
        step = 1e-4 * abs(at[name]) or 1e-6
        pair = [(_try(joint, {name: at[name] + h}), h) for h in (step, -step)]
        usable = [(evidence.joint_force(j), h) for j, h in pair if j is not None]
        if len(usable) == 1:
            usable.append((evidence.joint_force(joint), 0.0))
        column = (usable[0][0] - usable[1][0]) / (usable[0][1] - usable[1][1])
        if np.any(column):
            names.append(name)
            columns.append(column)
    return tuple(names), np.array(columns).reshape(len(names), len(evidence.force))


def free_parameters(joint: Joint) -> tuple[str, ...]:
    return tuple(name for name in joint.parameters if name not in joint.fixed)


def fit(evidence: Evidence, joint: Joint) -> Fitted:
    """Refit all free parameters with mass and offset, then judge the model by both kinds of hold-out.

    Mass and offset are eliminated by projection, so that the nonlinear search is over joint parameters alone.
    Standard errors take whole blocks as independent (residuals within one are not), and are widened to the
    jackknife over condition folds where that is larger.
    """
    plant_names, plant = evidence.plant_columns()
    size = np.linalg.norm(plant, axis=1)[:, None]
    Q = np.linalg.qr((plant / size).T)[0]
    target = evidence.target

    def projected(j: Joint) -> Array:
        r = target - evidence.joint_force(j)
        return np.asarray(r - Q @ (Q.T @ r))

    sigma = float(np.sqrt(np.mean(target**2))) or 1.0
    fitted, _ = refit(joint, lambda j: projected(j) / sigma, free_parameters(joint))
    rest = target - evidence.joint_force(fitted)
    beta = np.linalg.lstsq((plant / size).T, rest, rcond=None)[0] / size[:, 0]
    residual = rest - beta @ plant
    names, slopes = tangents(evidence, fitted)
    columns = np.vstack([plant, slopes])
    offset = np.concatenate([beta, np.zeros(len(names))])
    condition, fold_beta, block = held_out_losses(evidence, columns, rest, evidence.rows)
    covariance = clustered_covariance(columns, residual, _clusters(len(target), evidence.rows))
    widened = np.zeros(len(offset), dtype=bool)
    if fold_beta is not None:
        count = len(fold_beta)
        spread = np.sqrt((count - 1) / count * ((fold_beta - fold_beta.mean(axis=0)) ** 2).sum(axis=0))
        error = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
        widened = spread > error
        grow = np.maximum(spread / error, 1.0)
        covariance = covariance * np.outer(grow, grow)
    n = len(beta)
    return Fitted(
        joint=dataclasses.replace(fitted, covariance=Covariance(names, covariance[n:, n:]) if names else None),
        plant=tuple(beta.tolist()),
        names=(*plant_names, *names),
        columns=columns,
        model=target - residual,
        residual=residual,
        covariance=covariance,
        widened=tuple(widened.tolist()),
        in_sample=float(np.sqrt(np.mean(residual**2) / np.mean(evidence.force**2))),
        condition_loss=condition,
        block_loss=block,
    )


def held_out_losses(
    evidence: Evidence, columns: Array, target: Array, rows: Sequence[Index]
) -> tuple[Array | None, Array | None, Array]:
    """Relative losses over condition folds, their coefficients, and relative losses over block folds."""
    grams, sizes = block_grams(columns, target, rows), np.array([len(r) for r in rows])
    block = hold_out(grams, sizes, evidence.floor.block_folds).blocks / evidence.block_power
    if len(evidence.division.conditions) < 2:
        return None, None, block
    held = hold_out(grams, sizes, evidence.condition_folds)
    return held.blocks / evidence.block_power, held.coefficients, block


def _clusters(count: int, rows: Sequence[Index]) -> list[Index]:
    """The blocks, and what lies between them as blocks of its own."""
    free = np.ones(count, dtype=bool)
    for r in rows:
        free[r] = False
    rest = np.flatnonzero(free)
    gaps = np.split(rest, np.flatnonzero(np.diff(rest) > 1) + 1) if rest.size else []
    return [*(r for r in rows if len(r)), *gaps]


def check_laws(joint: Joint, where: str) -> None:
    """A path is followed in time, so every law must exist there."""
    for part, law in zip(joint.part_names, joint.laws, strict=True):
        if not law.in_time:
            raise InputError(f"{where}: law {part!r} exists in the frequency domain only, a path is traced in time")
