"""One family at one shape, fitted beside the current model on everything and without each fold."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array
from jointlib.effect import JointEffect
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.loop.path.columns import ColumnStore
from jointlib.loop.path.composed.along_input import AlongInput
from jointlib.loop.path.composed.follower import Follower
from jointlib.loop.path.evidence import Known, Model
from jointlib.loop.path.fitted import Fitted, named_by_role
from jointlib.loop.path.regression import Mask, hold_out, loss, solve, solve_signed, with_columns
from jointlib.parameter import Role
from jointlib.path_fault import PathFault

Shape = Mapping[str, float]
Effect = JointEffect | PathFault


@dataclass(frozen=True)
class Trial:
    """One family and shape fitted beside the current model, once on everything and once without each fold."""

    shape: Shape
    coefficients: Array
    """Of the effect, on all blocks."""
    training: float
    """Mean squared residual on all blocks, weighted, N²."""
    model: Model | None
    """The model with the effect, None where its coefficients are not physical."""
    folds: Folds
    """What was left out that decides: conditions, or the blocks where there is one trajectory."""


@dataclass(frozen=True)
class Folds:
    """What hold-out found at one shape."""

    training: Array
    losses: Array
    """Relative held-out loss of every block."""
    physical: Mask
    """Whether the coefficients that each fold finds are physical."""


def member_of(effect: Effect) -> str:
    """The kind of law an effect adds; a fault adds none and goes by its family."""
    return effect.member if isinstance(effect, JointEffect) else effect.family


def shapes_of(effect: Effect, current: Fitted) -> tuple[Shape, ...]:
    """Shapes to try; none for a fault that is undone, nor for a law that the joint has but for its smoothing."""
    evidence = current.evidence
    if isinstance(effect, JointEffect):
        shapes = effect.shapes(evidence.scale, current.joint)
        again = effect.member in {law.kind for law in current.joint.laws}
        return () if again and shapes and all(k.startswith("smoothing") for k in shapes[0]) else shapes
    if any(known.fault.family == effect.family for known in current.model.faults):
        return ()
    shapes = effect.shapes(evidence.scale, [run.recorded for run in evidence.runs])
    position = np.concatenate([run.recorded.position[run.keep] for run in evidence.runs])
    return tuple(effect.likely(shapes, position, current.residual))


def columns_of(effect: Effect, shapes: Sequence[Shape], current: Fitted, store: ColumnStore) -> Iterator[Array]:
    """Columns of an effect at each shape, (coefficient, sample)."""
    if isinstance(effect, AlongInput):
        yield from (effect.along(current.evidence, shape, current.joint) for shape in shapes)
        return
    if isinstance(effect, JointEffect):
        yield from map(current.evidence.centred, store.columns(effect, shapes, current.joint))
        return
    for shape in shapes:
        yield current.evidence.fault_columns(effect, shape)


def trials_of(effect: Effect, shapes: Sequence[Shape], current: Fitted, store: ColumnStore) -> list[Trial]:
    """The effect at each shape at which it acts on these paths."""
    found = zip(shapes, columns_of(effect, shapes, current, store), strict=True)
    tried = (_trial(effect, shape, added, current) for shape, added in found)
    return [t for t in tried if t is not None]


def _trial(effect: Effect, shape: Shape, added: Array, current: Fitted) -> Trial | None:
    if not np.all(np.isfinite(added)) or not np.all(np.any(added, axis=1)):
        return None
    evidence, count = current.evidence, len(added)
    weights, sizes = evidence.block_weight, evidence.sizes
    grams = with_columns(current.grams, current.stacked, added, evidence.rows)
    total = (grams * weights[:, None, None]).sum(axis=0)
    beta, signed = solve(total[:-1, :-1], total[:-1, -1]), 0
    least = _least_damping(current, total[:-1, :-1]) if isinstance(effect, PathFault) else {}
    model = applied(effect, shape, current, beta, least)
    if model is None and count > 1 and isinstance(effect, JointEffect):
        # Several elements in parallel: those that would pull the wrong way are left out.
        constrained = solve_signed(total[:-1, :-1], total[:-1, -1], count)
        model = applied(effect, shape, current, constrained)
        if model is not None:
            beta, signed = constrained, count

    # Of several conditions each fold is asked for the sign rule, of one trajectory the whole.
    several = len(evidence.division.conditions) > 1
    held = hold_out(grams, sizes, evidence.deciding_folds, weights, signed)
    found = [applied(effect, shape, current, b, least) if several else model for b in held.coefficients]
    physical = np.array([f is not None for f in found])
    return Trial(
        shape=shape,
        coefficients=beta[len(current.names) :],
        training=float(loss(total, beta) / (weights @ sizes)),
        model=model,
        folds=Folds(held.training, held.blocks / evidence.block_power, physical),
    )


def _least_damping(current: Fitted, gram: Array) -> Mapping[int, float]:
    """Where each damping of the joint would be negative by more than its 95 % interval beside the effect.

    Its standard error grows by the root of what the effect's columns do to its variance.
    """
    n, out = len(current.names), {}
    damping = named_by_role(current.joint, Role.DAMPING)
    for i, name in enumerate(current.names):
        if name in damping:
            unit = np.eye(len(gram))[i]
            wider = solve(gram, unit)[i] / max(float(solve(gram[:n, :n], unit[:n])[i]), 1e-300)
            out[i] = -1.96 * current.standard_error(name) * float(np.sqrt(max(wider, 1.0)))
    return out


def applied(
    effect: Effect,
    shape: Shape,
    current: Fitted,
    beta: Array,
    least: Mapping[int, float] | None = None,
    onto: Model | None = None,
) -> Model | None:
    """The current model moved along its tangents, or ``onto`` another one, with the effect; None where that is not
    physical.

    ``least`` bounds damping that a fault of the force needs beside it, by number of the coefficient: a late force that
    takes a damper that drives has imitated something else.
    """
    at = current.joint.parameters
    if any(at[current.names[i]] + beta[i] < bound for i, bound in (least or {}).items()):
        return None
    joint = _moved(current, beta) if onto is None else onto.joint
    faults, own = (current.model if onto is None else onto).faults, beta[len(current.names) :]
    if isinstance(effect, Follower):
        own = own * effect.size_of(current.joint) / (effect.size_of(joint) or effect.size_of(current.joint))
    if isinstance(effect, PathFault):
        parameters = effect.correction(own, shape)
        return None if parameters is None else Model(joint, (*faults, Known(effect, parameters)))
    try:
        mended = effect.apply(own, shape, joint)
    except InputError:
        return None
    return None if mended is None else Model(mended, faults)


def _moved(current: Fitted, beta: Array) -> Joint:
    names, lower, upper = current.bounds
    if not names:
        return current.joint
    at, step = current.joint.parameters, dict(zip(current.names, beta, strict=False))
    values = np.clip([at[n] + step[n] for n in names], lower, upper).tolist()
    # Parameters may leave their range together though none does alone; the refit finds admissible ones.
    with contextlib.suppress(InputError):
        return current.joint.with_parameters(dict(zip(names, values, strict=True)))
    return current.joint
