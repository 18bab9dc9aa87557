"""A joint fitted to the training records, and the columns it can move by."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.effect import JointEffect, Path
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.loop.contest import Model
from jointlib.loop.equations import Observed, forces_of_law, periodic_forces
from jointlib.loop.refit import refit
from jointlib.parameter import Role, parameters_of

_STEP = 1e-4
_LINEAR_ROLES = (Role.STIFFNESS, Role.DAMPING, Role.SLIP_FORCE)


@dataclass(frozen=True)
class Fitted:
    """A joint at its least squares over some records, and the names of the parameters that were free."""

    joint: Joint
    free: tuple[str, ...]
    held: tuple[str, ...]
    """Parameters that these records cannot tell from the others, held at their value."""


def real(columns: Sequence[ComplexArray]) -> Array:
    """Whitened complex columns of all records, shape (..., lines, 3) each, as one row of reals (..., n).

    Only valid entries are kept by the caller's masks; a complex entry gives two reals, E Σ = 1 for the two together.
    """
    flat = np.concatenate([c.reshape(*c.shape[:-2], -1) for c in columns], axis=-1)
    return np.ascontiguousarray(flat).view(float)


def residual(records: Sequence[Observed], joint: Joint) -> Array:
    """Whitened residuals of all records, real, E Σ of a pair = 1."""
    return real([o.whitened(joint) for o in records])


def joint_residual(records: Sequence[Observed], joint: Joint) -> Array:
    """The part of :func:`residual` that a joint parameter can move, weighted to unit variance for a refit."""
    parts = []
    for law in joint.laws:
        forces_of_law(records, law)
    for o in records:
        use = o.valid[:, 2]
        parts.append(o.whitened(joint)[use, 2])
    return np.asarray(np.sqrt(2) * np.concatenate(parts).view(float))


def columns_of(records: Sequence[Observed], forces: Sequence[ComplexArray]) -> Array:
    """Joint forces on the lines of each record, (q, lines) each, as whitened real columns (q, n)."""
    return real([o.whitened_force(F) for o, F in zip(records, forces, strict=True)])


def model_of(records: Sequence[Observed], fitted: Fitted) -> Model:
    """The whitened residual of a fitted joint with the columns of its free parameters."""
    sizes = [2 * 3 * len(o.frequency) for o in records]
    ends = np.cumsum(sizes)
    slices = tuple(slice(int(e - s), int(e)) for e, s in zip(ends, sizes, strict=True))
    y = residual(records, fitted.joint)
    columns = [columns_of(records, [d[None] for d in derivative(records, fitted.joint, n)]) for n in fitted.free]
    stacked = np.concatenate(columns) if columns else np.zeros((0, len(y)))
    return Model(y, stacked, slices, sum(int(o.valid.sum()) for o in records))


def derivative(records: Sequence[Observed], joint: Joint, name: str) -> list[ComplexArray]:
    """∂f/∂θ on the lines of each record, by central differences (one-sided at a bound)."""
    value = joint.parameters[name]
    h = max(_STEP * abs(value), _step_from_zero(records[0], joint, name) if abs(value) < 1e-20 else 0.0)
    ends = []
    for sign in (1.0, -1.0):
        try:
            ends.append((joint.with_parameters({name: value + sign * h}), value + sign * h))
        except InputError:
            ends.append((joint, value))
    (above, high), (below, low) = ends
    for law in (*above.laws, *below.laws):
        forces_of_law(records, law)
    if high == low:
        return [np.zeros(len(o.frequency), dtype=complex) for o in records]
    return [(o.model_force(above) - o.model_force(below)) / (high - low) for o in records]


def _step_from_zero(record: Observed, joint: Joint, name: str) -> float:
    """A step of a parameter that is zero, large enough to change the force by about 1e-4 of the measured force."""
    size, h = float(np.linalg.norm(record.joint_force)), 1.0
    here = record.model_force(joint)
    for _ in range(4):
        change = float(np.linalg.norm(record.model_force(joint.with_parameters({name: h})) - here))
        if change == 0 or not np.isfinite(change):
            return h
        h *= 1e-4 * size / change
    return h


def free_parameters(joint: Joint) -> tuple[str, ...]:
    """What a refit of a joint may move: not what is declared fixed, nor a threshold or clearance that is off (0)."""
    names = []
    values = joint.parameters
    for part, law in zip(joint.part_names, joint.laws, strict=True):
        for p in parameters_of(law):
            for name in values:
                if name.split("[", 1)[0] != f"{part}.{p.name}" or joint.fixed & {name, f"{part}.{p.name}"}:
                    continue
                if values[name] != 0 or p.table or p.role in _LINEAR_ROLES:
                    names.append(name)
    return tuple(names)


def moved_by(effect: JointEffect, coefficients: Array, shape: Mapping[str, float], joint: Joint) -> tuple[str, ...]:
    """Parameters of the mended joint that the coefficients and shape of an effect set."""
    mended = effect.apply(coefficients, shape, joint)
    if mended is None:
        return ()
    here, moved = mended.parameters, set()
    variants: list[tuple[Array, Mapping[str, float]]] = []
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


def fit(records: Sequence[Observed], joint: Joint, wanted: Sequence[str]) -> Fitted:
    """Refit the wanted parameters as far as these records can tell them apart; the rest is held and named."""
    held: list[str] = []
    blocks: list[Array] = []
    free: list[str] = []
    for name in wanted:
        block = columns_of(records, [d[None] for d in derivative(records, joint, name)])
        empty = np.zeros((0, block.shape[1]))
        known = Model(block[0], np.concatenate(blocks) if blocks else empty, (), 0)
        if known.without(block) is None:
            held.append(name)
        else:
            blocks.append(block)
            free.append(name)
    fitted, _ = refit(joint, lambda j: joint_residual(records, j), free)
    return Fitted(replace(fitted, provenance=joint.provenance), tuple(free), tuple(held))


def features(
    records: Sequence[Observed], effect: JointEffect, shapes: Sequence[Mapping[str, float]], joint: Joint
) -> list[list[ComplexArray]]:
    """For each shape the force of an effect with each coefficient 1 on the lines of each record, (q, lines).

    An effect without memory is a function of the averaged path. One with memory is stepped to its periodic steady
    state, all shapes at once where the law takes columns of parameters.
    """
    z, v, step = records[0].path
    count = len(effect.columns(Path(z[:8], v[:8], step), shapes[0], joint))
    first = [_added(effect, e, shapes[0], joint) for e in np.eye(count)]
    if any(u is None for u in first) or not any(u.states for u in first if u is not None):
        return [[o.lines_of(effect.columns(Path(*o.path), s, joint)) for o in records] for s in shapes]
    together = {n: np.array([[s[n]] for s in shapes]) for n in shapes[0]}
    rows = []
    for e in np.eye(count):
        unit = _added(effect, e, together, joint)  # type: ignore[arg-type]
        laws = unit.laws if unit is not None else ()
        rows.append([periodic_forces(records, law, len(shapes)) for law in laws])
    return [
        [np.array([sum(law[i][k] for law in row) for row in rows]) for i in range(len(records))]
        for k in range(len(shapes))
    ]


def _added(effect: JointEffect, unit: Array, shape: Mapping[str, float], joint: Joint) -> Joint | None:
    """The laws that a unit coefficient adds, where the effect only adds."""
    mended = effect.apply(unit, shape, joint)
    if mended is None or mended.laws[: len(joint.laws)] != joint.laws:
        return None
    return Joint(mended.laws[len(joint.laws) :])
