"""What depends on what in an FMU: the lists from which a master finds algebraic loops."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from jointlib.joint import Joint
from jointlib.parameter import Role

from ..system.conditions import conditions_of
from ..system.system import System, prefixed
from ..system.variables import direct_inputs, lagging, variables_of
from .native import NativePart, continuous_states, exchangeable, lags, native_parts, native_variables


@dataclass(frozen=True)
class Unknown:
    """A calculated variable and the variables that it depends on, in their order."""

    name: str
    depends_on: tuple[str, ...]


@dataclass(frozen=True)
class Structure:
    """FMI's ModelStructure by names."""

    outputs: tuple[Unknown, ...]
    rates: tuple[Unknown, ...] = ()
    initial: tuple[Unknown, ...] = ()
    indicators: tuple[Unknown, ...] = ()


def python_structure(joint: Joint) -> Structure:
    """Structure of a Python FMU: the force alone is unknown."""
    inputs = direct_inputs(joint)
    conditions = {c.name for c in conditions_of(joint.name, (joint,))}
    at_start = (v.name for v in variables_of(joint) if v.kind == "parameter" or v.name in {*inputs, *conditions})
    return Structure((Unknown("force", inputs),), initial=(Unknown("force", tuple(at_start)),))


def native_structure(system: System) -> Structure:
    """Structure of a native FMU: outputs, rates of the continuous states and event indicators.

    Before the first step the state of a law stands where the displacement puts it, so what depends on it then depends
    on what displaces the joint and on the parameters of the law.
    """
    variables = native_variables(system)
    order = {v.name: i for i, v in enumerate(variables)}
    tunable = [v for v in variables if v.kind == "parameter"]
    names = [v.name for v in variables if v.kind == "state"]
    held = {names[i] for i in continuous_states(system)}
    known = [s.name for s in (*system.states, *system.inputs)]
    linear = system.matrix()

    def unknown(name: str, depends_on: set[str]) -> Unknown:
        return Unknown(name, tuple(sorted(depends_on, key=order.__getitem__)))

    def row(i: int) -> set[str]:
        """States of the structure and inputs that a row of the matrices takes."""
        return {known[j] for j in np.flatnonzero(linear[i, : len(known)])}

    def forces(i: int) -> list[int]:
        return [int(j) for j in np.flatnonzero(linear[i, len(known) :])]

    n, nj = len(system.states), len(system.joints)
    motion = [{letter: row(n + 2 * i + k) for k, letter in enumerate("zv")} for i in range(nj)]
    force: list[set[str]] = [set() for _ in range(nj)]
    first: list[set[str]] = [set() for _ in range(nj)]
    rates, indicators, initial = [], [], []
    for part in native_parts(system):
        moved = motion[part.joint]
        own = {name for name, _ in part.states if name in held}
        loaded = system.load is not None
        starts = [
            moved["z"] if loaded or part.kernel.starts_at_displacement(i) else set() for i in range(len(part.states))
        ]
        placed: set[str] = set().union(*starts)
        own_parameters = tunable[slice(*part.parameters)]
        tuned = {v.name for v in own_parameters}
        roles = {v.declared.role for v in own_parameters if v.declared is not None}
        followed, at_start = _followed(system, part.joint, roles)
        if loaded:
            starts = [start | at_start for start in starts]
        direct = set().union(*(moved[letter] for letter in part.kernel.inputs))
        force[part.joint] |= direct | followed | (own if "s" in part.kernel.uses("force") else set())
        first[part.joint] |= direct | placed | tuned | at_start
        changing = _known(part, "rates", own, moved) | followed
        for (name, _), start in zip(part.states, starts, strict=True):
            if name not in held:
                continue
            rates.append(unknown(f"der({name})", changing))
            initial.append(unknown(name, start))
            initial.append(unknown(f"der({name})", (changing - own - followed) | placed | tuned | at_start))
        seen = _known(part, "indicators", own, moved) | followed
        count = part.indicators[1] - part.indicators[0]
        indicators += [unknown(f"{part.name}.indicator[{i}]", seen) for i in range(count)]

    for lag in lags(system) if exchangeable(system) else ():
        name = prefixed(lag.prefix, lagging(lag.condition).name)
        rates.append(unknown(f"der({name})", {name, lag.condition.name}))
        initial += [unknown(each, {lag.condition.name}) for each in (name, f"der({name})")]

    def both(name: str, i: int) -> tuple[Unknown, Unknown]:
        """What a row depends on, and what at the start."""
        now, then = row(i), row(i)
        for j in forces(i):
            now, then = now | force[j], then | first[j]
        return unknown(name, now), unknown(name, then)

    slopes = [both(f"der({s.name})", i) for i, s in enumerate(system.states)]
    before = n + 2 * nj + len(system.conditions)
    outputs = [both(s.name, before + i) for i, s in enumerate(system.outputs)]
    initial = sorted([then for _, then in (*outputs, *slopes)] + initial, key=lambda u: order[u.name])
    return Structure(
        tuple(now for now, _ in outputs), (*(now for now, _ in slopes), *rates), tuple(initial), tuple(indicators)
    )


def _followed(system: System, joint: int, roles: Collection[Role]) -> tuple[set[str], set[str]]:
    """What the parameters of some roles follow now, conditions or the states behind them, and what at the start."""
    prefix, of = system.joints[joint]
    kinds = {m.condition for m in of.modulations if m.role in roles}
    at_start = {c for c in system.conditions if c.kind in kinds}
    behind = {lag.condition for lag in lags(system) if lag.joint == joint} & at_start
    states = {prefixed(prefix, lagging(c).name) for c in behind} if exchangeable(system) else set()
    return {c.name for c in at_start - behind} | states, {c.name for c in at_start}


def _known(part: NativePart, purpose: str, states: set[str], moved: Mapping[str, set[str]]) -> set[str]:
    """Inputs and continuous states that a function of the kernel reads."""
    used = part.kernel.uses(purpose)
    return set().union(*(moved[letter] for letter in used & {"z", "v"})) | (states if "s" in used else set())
