"""A joint refitted along a path together with mass, offset and the faults of the force, and judged by hold-out."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from jointlib.arrays import Array
from jointlib.joint import Covariance, Joint
from jointlib.law import JointLaw
from jointlib.loop.answer.refit import bounds_of, refit
from jointlib.loop.path.columns import moved_or_none
from jointlib.loop.path.evidence import Evidence, Model
from jointlib.loop.path.regression import Index, block_grams, clustered_covariance, hold_out, products
from jointlib.modulation import lag_name, lags_of, names_of, stepped
from jointlib.parameter import Role, parameters_of

_FAULT_ROUNDS = 4
"""Rounds in which a fault is undone by what the round before left of it; a lag converges quadratically."""
_STANDS = 1e-4
"""Share of themselves by which a round moves parameters of faults that it leaves as they are."""
_NOTHING = 1e-9
"""Share of the motion below which a length does nothing."""
_LEAST_LAG = 0.3
"""Share of itself to which a round shortens a lag at most."""
_UNKNOWN = 1e100
"""A standard error that held-out conditions widen so many times says nothing any more."""


@dataclass(frozen=True)
class Fitted:
    """A model refitted together with mass and offset; ``columns`` are its tangents ∂F/∂parameter."""

    model: Model
    evidence: Evidence
    """The records with the faults of the model undone."""
    plant: tuple[float, ...]
    names: tuple[str, ...]
    """Mass, offset and parameters of faults first, then the free joint parameters."""
    columns: Array
    residual: Array
    """Of the force with the faults undone, N."""
    covariance: Array
    widened: tuple[bool, ...]
    """True where the spread over condition folds exceeds the error from the noise."""
    in_sample: float
    """rms of the residual over rms of F."""
    condition_loss: Array | None
    """Mean squared held-out residual of every block over the power of its record; None without two conditions."""
    block_loss: Array

    @property
    def joint(self) -> Joint:
        return self.model.joint

    @property
    def deciding_loss(self) -> Array:
        """Losses over condition folds, over block folds where there is one trajectory only."""
        return self.block_loss if self.condition_loss is None else self.condition_loss

    @cached_property
    def stacked(self) -> Array:
        """Its columns, and last what the joint leaves of the force."""
        return np.vstack([self.columns, self.evidence.target - self.evidence.joint_force(self.joint)])

    @cached_property
    def grams(self) -> Array:
        """[C y]ᵀ[C y] of every block, see :func:`jointlib.loop.path.regression.block_grams`."""
        return products(self.stacked, None, self.evidence.rows)

    @cached_property
    def bounds(self) -> tuple[tuple[str, ...], Array, Array]:
        """The joint parameters among its names, and how low and how high they may be."""
        names = tuple(n for n in self.names if n in self.joint.parameters)
        return names, *bounds_of(self.joint, names)

    def standard_error(self, name: str) -> float:
        if name not in self.names:
            return float("nan")
        i = self.names.index(name)
        return float(np.sqrt(self.covariance[i, i]))


def fit(evidence: Evidence, model: Model, *, quick: bool = False, rounding: bool = False) -> Fitted:
    """Refit all free parameters with mass and offset, then judge the model by both kinds of hold-out.

    Mass and offset are eliminated by projection, so that the nonlinear search is over joint parameters alone. Faults
    are undone exactly and what is left of them is fitted linearly, round after round. Standard errors take whole
    blocks as independent (residuals within one are not), and are widened to the jackknife over condition folds where
    that is larger. ``quick`` ends early and opens no play that a law does not have yet, and ``rounding`` fits the
    smoothing of corners too, within half a decade.
    """
    closed = closed_plays(model.joint) if quick else frozenset()
    free = tuple(n for n in free_parameters(model.joint) if n not in closed)
    if rounding:
        every = tuple(n for n in model.joint.parameters if n not in closed)
        loose = _solved(evidence.without(model.faults), model.joint, every, quick)[0]
        model = dataclasses.replace(model, joint=_rounded(model.joint, loose))
    for _ in range(_FAULT_ROUNDS if model.faults or model.joint.modulations else 0):
        here = evidence.without(model.faults)
        joint, beta = _solved(here, model.joint, free, quick)
        before, model = model, _moved(here, model, joint, beta)
        if _stands(before, model):
            break
    here = evidence.without(model.faults)
    joint, beta = _solved(here, model.joint, free, quick)
    judged = _judged(here, Model(joint, model.faults), beta, free)
    return dataclasses.replace(judged, model=dataclasses.replace(judged.model, joint=_without_nothing(judged)))


def _without_nothing(fitted: Fitted) -> Joint:
    """The joint with lengths that the fit sent to nothing, such as a play, at zero; they have no standard error."""
    joint, none = fitted.joint, _NOTHING * fitted.evidence.scale.displacement
    units, known = joint.units, joint.parameters
    gone = {
        n: 0.0 for n in free_parameters(joint) if units[n] == "m" and n not in fitted.names and abs(known[n]) < none
    }
    return (moved_or_none(joint, gone) or joint) if gone else joint


def _moved(evidence: Evidence, model: Model, joint: Joint, beta: Array) -> Model:
    """The refitted joint and the faults with what the fit found to be left of them and of its modulations."""
    left = dict(zip(evidence.beside(model.joint)[0], beta, strict=True))
    faults = tuple(known.moved(np.array([left[n] for n in known.names])) for known in model.faults)
    modulations = [
        (stepped(m, np.array([left[n] for n in names_of(m)])) or m) if left.keys() >= set(names_of(m)) else m
        for m in joint.modulations
    ]
    joint = dataclasses.replace(joint, modulations=tuple(modulations))
    for condition, lag in lags_of(modulations).items():
        if lag_name(condition) in left:
            joint = joint.lagging(condition, max(lag + left[lag_name(condition)], _LEAST_LAG * lag))
    return Model(joint, faults)


def _stands(before: Model, after: Model) -> bool:
    """True if a round hardly moved faults and modulations, so that the next one, which converges faster, would not."""
    old, new = (
        np.array([*(x for k in m.faults for x in k.parameters.values()), *_factors(m.joint)]) for m in (before, after)
    )
    return len(old) == len(new) and bool(np.all(np.abs(new - old) <= _STANDS * np.abs(new)))


def _factors(joint: Joint) -> list[float]:
    """And lags of its modulations."""
    return [x for m in joint.modulations for x in (*(factor for _, factor in m.table), m.lag)]


def _rounded(joint: Joint, loose: Joint) -> Joint:
    """The joint with the smoothing of another one, as far as that is near its own."""
    new, limit = loose.parameters, np.sqrt(10.0)
    own = {n: joint.parameters[n] for n in named_by_role(joint, Role.SMOOTHING) if n not in joint.fixed}
    return joint.with_parameters({n: float(np.clip(new[n], x / limit, x * limit)) for n, x in own.items()})


def _solved(evidence: Evidence, joint: Joint, free: Sequence[str], quick: bool) -> tuple[Joint, Array]:
    """The refitted joint, and the coefficients of the plant's columns."""
    w, target = evidence.root_weight, evidence.target
    plant = evidence.beside(joint)[1] * w
    size = np.maximum(np.linalg.norm(plant, axis=1), 1e-300)[:, None]
    Q = np.linalg.qr((plant / size).T)[0]
    sigma = float(np.sqrt(np.mean((w * target) ** 2))) or 1.0

    def projected(j: Joint) -> Array:
        r = w * (target - evidence.joint_force(j)) / sigma
        return np.asarray(r - Q @ (Q.T @ r))

    # Two laws that do the same make the search run away; hold-out refuses what it then finds.
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        fitted, _ = refit(joint, projected, [n for n in free if n not in joint.fixed], quick=quick, errors=False)
    rest = w * (target - evidence.joint_force(fitted))
    return fitted, np.linalg.lstsq((plant / size).T, rest, rcond=None)[0] / size[:, 0]


def _judged(evidence: Evidence, model: Model, beta: Array, free: Sequence[str]) -> Fitted:
    plant_names, plant = evidence.beside(model.joint)
    rest = evidence.target - evidence.joint_force(model.joint)
    residual = rest - beta @ plant
    names, slopes = tangents(evidence, model.joint, free)
    columns = np.vstack([plant, slopes])
    condition, fold_beta, block = held_out_losses(evidence, columns, rest)
    w = evidence.root_weight
    covariance = clustered_covariance(columns * w, residual * w, _clusters(len(rest), evidence.rows))
    widened = np.zeros(len(columns), dtype=bool)
    if fold_beta is not None:
        count = len(fold_beta)
        spread = np.sqrt((count - 1) / count * ((fold_beta - fold_beta.mean(axis=0)) ** 2).sum(axis=0))
        error = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
        widened = spread > error
        grow = np.clip(spread / error, 1.0, _UNKNOWN)
        covariance = covariance * np.outer(grow, grow)
    n = len(beta)
    own = Covariance(names, covariance[n:, n:]) if names else None
    return Fitted(
        model=dataclasses.replace(model, joint=dataclasses.replace(model.joint, covariance=own)),
        evidence=evidence,
        plant=tuple(beta.tolist()),
        names=(*plant_names, *names),
        columns=columns,
        residual=residual,
        covariance=covariance,
        widened=tuple(widened.tolist()),
        in_sample=float(np.sqrt(np.mean(residual**2) / np.mean(evidence.force**2))),
        condition_loss=condition,
        block_loss=block,
    )


def tangents(evidence: Evidence, joint: Joint, free: Sequence[str]) -> tuple[tuple[str, ...], Array]:
    """∂f/∂θ of every free parameter that has influence, by central differences (exact where f is linear in θ)."""
    names, columns = [], []
    at = joint.parameters
    for name in free:
        step = 1e-4 * abs(at[name]) or 1e-6
        pair = [(moved_or_none(joint, {name: at[name] + h}), h) for h in (step, -step)]
        usable = [(evidence.joint_force(j), h) for j, h in pair if j is not None]
        if not usable:
            continue
        if len(usable) == 1:
            usable.append((evidence.joint_force(joint), 0.0))
        column = (usable[0][0] - usable[1][0]) / (usable[0][1] - usable[1][1])
        if np.any(column):
            names.append(name)
            columns.append(column)
    return tuple(names), np.array(columns).reshape(len(names), len(evidence.force))


def free_parameters(joint: Joint) -> tuple[str, ...]:
    """What a fit moves: not what the joint holds fixed, nor a smoothing, which would imitate other effects."""
    held = joint.fixed | named_by_role(joint, Role.SMOOTHING)
    return tuple(name for name in joint.parameters if name not in held)


def closed_plays(joint: Joint) -> frozenset[str]:
    """Plays that a joint does not have, in series with an element whose force along a path has a closed form without:
    one step after the other is slow."""
    return frozenset(
        f"{part}.{p.name}"
        for part, law in zip(joint.part_names, joint.laws, strict=True)
        for p in parameters_of(law)
        if type(law).along is not JointLaw.along and p.role is Role.CLEARANCE and getattr(law, p.name) == 0.0
    )


def named_by_role(joint: Joint, role: Role) -> frozenset[str]:
    """Parameters of a joint that have a role."""
    return frozenset(
        f"{part}.{p.name}"
        for part, law in zip(joint.part_names, joint.laws, strict=True)
        for p in parameters_of(law)
        if p.role is role
    )


def drives(fitted: Fitted) -> bool:
    """True where a damping of the joint is below zero by more than its 95 % interval."""
    damping = named_by_role(fitted.joint, Role.DAMPING).intersection(fitted.names)
    return any(fitted.joint.parameters[n] < -1.96 * fitted.standard_error(n) for n in damping)


def held_out_losses(evidence: Evidence, columns: Array, target: Array) -> tuple[Array | None, Array | None, Array]:
    """Relative losses over condition folds, their coefficients, and relative losses over block folds."""
    grams, sizes, weights = block_grams(columns, target, evidence.rows), evidence.sizes, evidence.block_weight
    block = hold_out(grams, sizes, evidence.floor.block_folds, weights).blocks / evidence.block_power
    if len(evidence.division.conditions) < 2:
        return None, None, block
    held = hold_out(grams, sizes, evidence.condition_folds, weights)
    return held.blocks / evidence.block_power, held.coefficients, block


def _clusters(count: int, rows: Sequence[Index]) -> list[Index]:
    """The blocks, and what lies between them as blocks of its own."""
    free = np.ones(count, dtype=bool)
    for r in rows:
        free[r] = False
    rest = np.flatnonzero(free)
    gaps = np.split(rest, np.flatnonzero(np.diff(rest) > 1) + 1) if rest.size else []
    return [*(r for r in rows if len(r)), *gaps]
