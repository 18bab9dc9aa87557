"""How the force of a joint along the records moves with its parameters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointlib.arrays import ComplexArray
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.law import JointLaw
from jointlib.loop.answer.refit import bounds_of
from jointlib.loop.balance.equations import Observed, forces_of_law, periodic_forces, under_inputs
from jointlib.modulation import Modulation, acting, is_fitted, names_of, scaled

_STEP = 1e-4
_OF_RANGE = 0.01
_OF_FACTOR = 1e-3


def tangents(records: Sequence[Observed], joint: Joint, names: Sequence[str]) -> dict[str, list[ComplexArray]]:
    """∂f/∂θ of each named parameter, and of coefficients of modulations, on the lines of each record.

    Central differences for laws without memory; a law with memory is stepped once for all its parameters, each moved
    to one side. What does not repeat counts where z is more than noise: noise in a column would multiply the same noise
    in the residual.
    """
    out: dict[str, list[ComplexArray]] = {}
    for part, law in zip(joint.part_names, joint.laws, strict=True):
        own = [n for n in names if n.split(".", 1)[0] == part]
        slopes = _together(records, joint, part, own) if law.states and own else None
        for i, name in enumerate(own):
            out[name] = [s[i] for s in slopes] if slopes is not None else _central(records, joint, name)
    for m in joint.modulations:
        if is_fitted(m) and any(n in names for n in names_of(m)):
            each = followed_slopes(records, joint, m)
            out |= {n: [slope[i] for slope in each] for i, n in enumerate(names_of(m))}
    return out


def followed_slopes(records: Sequence[Observed], joint: Joint, modulation: Modulation) -> list[ComplexArray]:
    """∂f/∂c of the coefficients of one of the joint's modulations, (coefficient, lines) of each record.

    f(θ φ(u)) moves by ∂f/∂ln θ · (∂φ/∂c)/φ; the first by central differences of the parameters of the role.
    """
    slopes = [np.zeros(len(o.frequency), dtype=complex) for o in records]
    for law in joint.laws:
        if acting(law, (modulation,)):
            more, less = (
                forces_of_law(records, scaled(law, [(modulation.role, np.asarray(f))]), joint.modulations)
                for f in (1 + _OF_FACTOR, 1 - _OF_FACTOR)
            )
            slopes = [s + (F - G) / (2 * _OF_FACTOR) for s, F, G in zip(slopes, more, less, strict=True)]
    return [o.times(s, o.inputs.moves(modulation)) for o, s in zip(records, slopes, strict=True)]


def _together(records: Sequence[Observed], joint: Joint, part: str, names: Sequence[str]) -> list[ComplexArray] | None:
    """One-sided differences of all parameters of one law with memory, (names, lines) of each record."""
    at = {n: v for n, v in joint.parameters.items() if n.split(".", 1)[0] == part}
    index = joint.part_names.index(part)

    def each_stepped(some: Sequence[Observed], law: JointLaw) -> list[ComplexArray]:
        forces = periodic_forces(some, law, len(names))
        return [np.stack([o.with_stray(f) for f in F]) for o, F in zip(some, forces, strict=True)]

    for sign in (1.0, -1.0):
        steps = {n: sign * _STEP * abs(at[n]) for n in names}
        if not all(steps.values()):
            return None
        moved = {n: np.array([[v + (steps[n] if n == m else 0.0)] for m in names]) for n, v in at.items()}
        try:
            law = joint.with_parameters(moved).laws[index]  # type: ignore[arg-type]
        except InputError:
            continue
        here = forces_of_law(records, joint.laws[index], joint.modulations)
        there = under_inputs(records, law, joint.modulations, each_stepped)
        h = np.array([[steps[n]] for n in names])
        return [(F - F0) / h for F, F0 in zip(there, here, strict=True)]
    return None


def _central(records: Sequence[Observed], joint: Joint, name: str) -> list[ComplexArray]:
    """Central difference of one parameter, one-sided at a bound."""
    value = joint.parameters[name]
    h = max(_STEP * abs(value), _step_from_zero(records[0], joint, name) if abs(value) < 1e-20 else 0.0)
    index = joint.part_names.index(name.split(".", 1)[0])
    ends = []
    for sign in (1.0, -1.0):
        try:
            ends.append((joint.with_parameters({name: value + sign * h}).laws[index], value + sign * h))
        except InputError:
            ends.append((joint.laws[index], value))
    (above, high), (below, low) = ends
    if high == low:
        return [np.zeros(len(o.frequency), dtype=complex) for o in records]
    up, down = (forces_of_law(records, law, joint.modulations) for law in (above, below))
    return [(F - G) / (high - low) for F, G in zip(up, down, strict=True)]


def _step_from_zero(record: Observed, joint: Joint, name: str) -> float:
    """A step of a parameter that is zero, large enough to change the force by about 1e-4 of the measured force.

    It stays within a hundredth of what a bounded parameter may be, however little that changes.
    """
    most = _OF_RANGE * float(bounds_of(joint, [name])[1][0])
    size, h = float(np.linalg.norm(record.joint_force)), min(1.0, most)
    here = record.model_force(joint)
    for _ in range(4):
        try:
            change = float(np.linalg.norm(record.model_force(joint.with_parameters({name: h})) - here))
        except InputError:
            return h
        if change == 0 or not np.isfinite(change):
            return h
        h = min(h * 1e-4 * size / change, most)
    return h
