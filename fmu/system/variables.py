"""The variables of an FMU, the one source of its description, its code and its value references."""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace

import numpy as np

from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.modulation import lags_of
from jointlib.parameter import Parameter, parameters_of

from ..code.python_kernel import Kernel, kernel_of
from .conditions import Condition, conditions_of
from .si_unit import table_unit


@dataclass(frozen=True)
class Variable:
    """One scalar variable; its value reference is its position among the variables of the FMU."""

    name: str
    kind: str
    """``input``, ``output``, ``parameter``, ``state``, ``rate``, ``indicator`` or ``time``."""
    unit: str
    """In SI; empty where the value has none, as an event indicator that is now a length and now a velocity."""
    description: str
    start: float | None = None
    """None where the value is calculated."""
    declared: Parameter | None = None
    """Bounds of a parameter."""
    nominal: float | None = None
    """The usual size of a continuous state, an input or an output."""
    derivative_of: str | None = None
    """The state whose rate this is."""

    def renamed(self, name: str, *, sized: bool = True) -> Variable:
        """The same variable by another name; one that no solver integrates needs no usual size."""
        return replace(self, name=name, nominal=self.nominal if sized else None)

    @property
    def causality(self) -> str:
        """FMI's ``causality``."""
        return {"state": "local", "rate": "local", "indicator": "local", "time": "independent"}.get(
            self.kind, self.kind
        )

    @property
    def variability(self) -> str:
        """``tunable`` for parameters, else ``continuous``."""
        return "tunable" if self.kind == "parameter" else "continuous"

    @property
    def initial(self) -> str | None:
        """FMI's ``initial``; inputs and time have none, and a state that starts where it is told is exact."""
        if self.kind in {"input", "time"}:
            return None
        return "calculated" if self.start is None else "exact"

    @property
    def minimum(self) -> float | None:
        """The least value that is allowed, None if there is none."""
        if self.declared is None:
            return None
        bound = self.declared.lower
        if self.declared.above >= bound:
            # Not the smallest of all numbers above 0, which readers may take for 0.
            bound = float(np.nextafter(self.declared.above, np.inf)) if self.declared.above else sys.float_info.min
        return bound if np.isfinite(bound) else None

    @property
    def maximum(self) -> float | None:
        """Upper bound, None if there is none."""
        return self.declared.upper if self.declared and np.isfinite(self.declared.upper) else None


@dataclass(frozen=True)
class Part:
    """One law of the joint as it stands in the FMU."""

    name: str
    kernel: Kernel
    fields: dict[str, int | list[int] | list[list[int]]]
    """For each field of the law the positions of its values among the parameters."""
    states: tuple[int, int]
    """Positions of its first state and behind its last one among the states."""
    lengths: tuple[int, ...] = ()
    """Lengths of its lists, rows and columns of its tables, in the order of the fields."""


def parts_of(joint: Joint) -> tuple[Part, ...]:
    """The laws in order, each with its kernel and the places of its parameters and states."""
    if not joint.laws:
        raise InputError(f"joint {joint.name!r}: no laws, expected at least one for an FMU")
    parts: list[Part] = []
    position = state = 0
    for name, law in zip(joint.part_names, joint.laws, strict=True):
        fields: dict[str, int | list[int] | list[list[int]]] = {}
        lengths: list[int] = []
        for p in parameters_of(law):
            shape = np.shape(getattr(law, p.name))
            if shape and not (p.table or p.listed):
                raise InputError(f"joint {joint.name!r}: {name}.{p.name} is an array, expected one number for an FMU")
            if p.table:
                rows, columns = shape
                fields[p.name] = [[position + i * columns + j for j in range(columns)] for i in range(rows)]
            elif p.listed:
                fields[p.name] = list(range(position, position + len(getattr(law, p.name))))
            else:
                fields[p.name] = position
            position += int(np.prod(shape))
            lengths += shape
        parts.append(Part(name, kernel_of(law), fields, (state, state + len(law.states)), tuple(lengths)))
        state += len(law.states)
    return tuple(parts)


def variables_of(joint: Joint) -> tuple[Variable, ...]:
    """Inputs, output, parameters and internal states, in the order of their value references."""
    parts, conditions = parts_of(joint), conditions_of(f"joint {joint.name!r}", (joint,))
    out = [
        Variable("displacement", "input", "m", "relative displacement across the joint", 0.0),
        Variable("velocity", "input", "m/s", "relative velocity across the joint", 0.0),
        *(Variable(c.name, "input", c.unit, c.description, c.start) for c in conditions),
        Variable("force", "output", "N", "restoring force of the joint"),
    ]
    for part, law in zip(parts, joint.laws, strict=True):
        for p in parameters_of(law):
            told = f"{p.name.replace('_', ' ')} of the law {law.kind}"
            value = getattr(law, p.name)
            if p.listed:
                name = f"{part.name}.{p.name}"
                out += [Variable(f"{name}[{i}]", "parameter", p.unit, told, float(v), p) for i, v in enumerate(value)]
                continue
            if not p.table:
                out.append(Variable(f"{part.name}.{p.name}", "parameter", p.unit, told, float(value), p))
                continue
            for i, row in enumerate(value):
                for j, entry in enumerate(row):
                    unit, name = table_unit(p.unit, i, j), f"{part.name}.{p.name}[{i}][{j}]"
                    out.append(Variable(name, "parameter", unit, told, float(entry), p))
    for part, law in zip(parts, joint.laws, strict=True):
        for s in law.states:
            unit = part.kernel.state_units[s.split("[")[0]]
            out.append(Variable(f"{part.name}.{s}", "state", unit, f"internal state of the law {law.kind}"))
    lags = lags_of(joint.modulations)
    return (*out, *(lagging(c) for c in conditions if c.kind in lags))


def lagging(condition: Condition, nominal: float | None = None) -> Variable:
    """The state that is behind a condition by a lag."""
    told = f"what parameters follow of the {condition.kind.replace('-', ' ')}, behind it by a lag"
    return Variable(f"followed.{condition.name}", "state", condition.unit, told, nominal=nominal)


def direct_inputs(joint: Joint) -> tuple[str, ...]:
    """The inputs that the force depends on at the same instant."""
    used = frozenset[str]().union(*(part.kernel.inputs for part in parts_of(joint)))
    named = tuple(name for letter, name in (("z", "displacement"), ("v", "velocity")) if letter in used)
    lags = lags_of(joint.modulations)
    return (*named, *(c.name for c in conditions_of(joint.name, (joint,)) if c.kind not in lags))
