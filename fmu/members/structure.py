"""What depends on what in an FMU: the lists from which a master finds algebraic loops."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from jointlib.joint import Joint

from ..system.system import System
from ..system.variables import direct_inputs, variables_of
from .native import NativePart, continuous_states, native_parts, native_variables


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
    parameters = (v.name for v in variables_of(joint) if v.kind == "parameter")
    return Structure((Unknown("force", inputs),), initial=(Unknown("force", (*inputs, *parameters)),))


def native_structure(system: System) -> Structure:
    """Structure of a native FMU: outputs, rates of the continuous states and event indicators.

    Before the first step the state of a law stands where the displacement puts it, so what depends on it then depends
    on what displaces the joint and on the parameters of the law.
    """
    variables = native_variables(system)
    order = {v.name: i for i, v in enumerate(variables)}
    parameters = [v.name for v in variables if v.kind == "parameter"]
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
        tuned = set(parameters[slice(*part.parameters)])
        direct = set().union(*(moved[letter] for letter in part.kernel.inputs))
        force[part.joint] |= direct | (own if "s" in part.kernel.uses("force") else set())
        first[part.joint] |= direct | placed | tuned
        changing = _known(part, "rates", own, moved)
        for (name, _), start in zip(part.states, starts, strict=True):
            if name not in held:
                continue
            rates.append(unknown(f"der({name})", changing))
            initial.append(unknown(name, start))
            initial.append(unknown(f"der({name})", (changing - own) | placed | tuned))
        seen = _known(part, "indicators", own, moved)
        count = part.indicators[1] - part.indicators[0]
        indicators += [unknown(f"{part.name}.indicator[{i}]", seen) for i in range(count)]

    def both(name: str, i: int) -> tuple[Unknown, Unknown]:
        """What a row depends on, and what at the start."""
        now, then = row(i), row(i)
        for j in forces(i):
            now, then = now | force[j], then | first[j]
        return unknown(name, now), unknown(name, then)

    slopes = [both(f"der({s.name})", i) for i, s in enumerate(system.states)]
    outputs = [both(s.name, n + 2 * nj + i) for i, s in enumerate(system.outputs)]
    initial = sorted([then for _, then in (*outputs, *slopes)] + initial, key=lambda u: order[u.name])
    return Structure(
        tuple(now for now, _ in outputs), (*(now for now, _ in slopes), *rates), tuple(initial), tuple(indicators)
    )


def _known(part: NativePart, purpose: str, states: set[str], moved: Mapping[str, set[str]]) -> set[str]:
    """Inputs and continuous states that a function of the kernel reads."""
    used = part.kernel.uses(purpose)
    return set().union(*(moved[letter] for letter in used & {"z", "v"})) | (states if "s" in used else set())
