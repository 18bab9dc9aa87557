"""What depends on what in an FMU: the lists from which a master finds algebraic loops."""

from __future__ import annotations

from dataclasses import dataclass

from jointlib.joint import Joint

from .native import NativePart, continuous_states, native_parts, native_variables
from .variables import direct_inputs, variables_of

_INPUTS = {"z": "displacement", "v": "velocity"}


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


def native_structure(joint: Joint) -> Structure:
    """Structure of a native FMU: force, rates of the continuous states and event indicators.

    Before the first step a state stands where the displacement puts it, so what depends on a state then depends on
    the displacement and on the parameters of its law.
    """
    parts, variables = native_parts(joint), native_variables(joint)
    order = {v.name: i for i, v in enumerate(variables)}
    states = [v.name for v in variables if v.kind == "state"]
    held = {states[i] for i in continuous_states(joint)}
    parameters = [v.name for v in variables if v.kind == "parameter"]

    def unknown(name: str, known: set[str]) -> Unknown:
        return Unknown(name, tuple(sorted(known, key=order.__getitem__)))

    force: set[str] = set()
    first: set[str] = set(parameters)
    rates, indicators, initial = [], [], []
    for part in parts:
        own = {name for name, _ in part.states if name in held}
        starts = [{"displacement"} if part.kernel.starts_at_displacement(i) else set() for i in range(len(part.states))]
        placed: set[str] = set().union(*starts)
        tuned = set(parameters[slice(*part.parameters)])
        force |= {_INPUTS[letter] for letter in part.kernel.inputs} | (
            own if "s" in part.kernel.uses("force") else set()
        )
        first |= {_INPUTS[letter] for letter in part.kernel.inputs} | placed
        moved = _known(part, "rates", own)
        for (name, _), start in zip(part.states, starts, strict=True):
            if name not in held:
                continue
            rates.append(unknown(f"der({name})", moved))
            initial.append(unknown(name, start))
            initial.append(unknown(f"der({name})", (moved - own) | placed | tuned))
        seen = _known(part, "indicators", own)
        count = part.indicators[1] - part.indicators[0]
        indicators += [unknown(f"{part.part.name}.indicator[{i}]", seen) for i in range(count)]
    initial = sorted([unknown("force", first), *initial], key=lambda u: order[u.name])
    return Structure((unknown("force", force),), tuple(rates), tuple(initial), tuple(indicators))


def _known(part: NativePart, purpose: str, states: set[str]) -> set[str]:
    """Inputs and continuous states that a function of the kernel reads."""
    used = part.kernel.uses(purpose)
    return {_INPUTS[letter] for letter in used & set(_INPUTS)} | (states if "s" in used else set())
