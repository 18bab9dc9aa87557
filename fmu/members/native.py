"""A system as its native FMU sees it: each law with its C kernel, and the variables in their order."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.law import JointLaw
from jointlib.modulation import lags_of
from jointlib.parameter import Role, parameters_of

from ..code.c_kernel import CKernel, State, c_kernel_of, count
from ..system.conditions import Condition
from ..system.step_limit import operating_range
from ..system.system import System, prefixed
from ..system.variables import Part, Variable, lagging, parts_of, variables_of

Places = tuple[int, int]
"""The first place and the one behind the last."""


@dataclass(frozen=True)
class NativePart:
    """One law of a joint with its C kernel; places count over all joints of the system."""

    joint: int
    """Which of the system's joints it belongs to."""
    prefix: str
    """What stands before the joint's names."""
    name: str
    """``hertz_guide``, in a machine ``guide.hertz_guide``."""
    lengths: tuple[int, ...]
    """Lengths of its lists, rows and columns of its tables."""
    kernel: CKernel
    parameters: Places
    states: tuple[tuple[str, State], ...]
    """Each state by its full name, ``jenkins.slider``."""
    remembered: Places
    """Places of its states among those of the joints, which stand behind those of the structure."""
    modes: Places
    indicators: Places
    size: float
    """Usual size in m of a state in m."""

    def nominal(self, state: State) -> float:
        """Usual size of a state, which tells a solver what error is small."""
        return self.size if state.unit == "m" else 1.0


@dataclass(frozen=True)
class Lag:
    """A state of a joint that is behind a condition."""

    joint: int
    prefix: str
    condition: Condition
    seconds: float


def lags(system: System) -> tuple[Lag, ...]:
    """What lags behind conditions, joint by joint: the last of the states."""
    return tuple(
        Lag(i, prefix, c, behind[c.kind])
        for i, (prefix, joint) in enumerate(system.joints)
        for behind in (lags_of(joint.modulations),)
        for c in system.conditions
        if c.kind in behind
    )


def joints_of(system: System) -> tuple[Joint, ...]:
    """The joints in order."""
    return tuple(joint for _, joint in system.joints)


def without_kernel(joints: Iterable[Joint]) -> tuple[str, ...]:
    """The kinds of the joints' laws that have no C kernel."""
    return tuple(dict.fromkeys(law.kind for joint in joints for law in joint.laws if c_kernel_of(law) is None))


def only_in_steps(joints: Iterable[Joint]) -> tuple[str, ...]:
    """The kinds of the joints' laws that exist in co-simulation only."""
    kernels = ((law.kind, c_kernel_of(law)) for joint in joints for law in joint.laws)
    return tuple(dict.fromkeys(kind for kind, kernel in kernels if kernel is not None and not kernel.exchange))


def exchangeable(system: System) -> bool:
    """True if an importer can integrate every law."""
    return not only_in_steps(joints_of(system))


def native_parts(system: System) -> tuple[NativePart, ...]:
    """The laws of all joints in order, each with the places of its parameters, states, modes and event indicators.

    A joint that exists in co-simulation only has no indicators; its modes are set and then not used.
    """
    if missing := without_kernel(joints_of(system)):
        raise InputError(f"{system.name!r}: no C kernel for {', '.join(missing)}; use runtime 'python'")
    exchange = exchangeable(system)
    out: list[NativePart] = []
    parameter = state = mode = indicator = 0
    for i, (prefix, joint) in enumerate(system.joints):
        travel = operating_range(joint).amplitude
        for part, law in zip(parts_of(joint), joint.laws, strict=True):
            kernel = c_kernel_of(law)
            assert kernel is not None
            name = prefixed(prefix, part.name)
            states = tuple((f"{name}.{own}", s) for own, s in kernel.state_names(part.lengths))
            found = NativePart(
                i,
                prefix,
                name,
                part.lengths,
                kernel,
                (parameter, parameter + _parameter_count(part, law)),
                states,
                (state, state + len(states)),
                (mode, mode + count(kernel.modes, part.lengths)),
                (indicator, indicator + (count(kernel.indicators, part.lengths) if exchange else 0)),
                _stretch(law) or travel,
            )
            out.append(found)
            parameter, state, mode, indicator = (
                places[1] for places in (found.parameters, found.remembered, found.modes, found.indicators)
            )
    return tuple(out)


def _parameter_count(part: Part, law: JointLaw) -> int:
    return sum(int(np.size(getattr(law, name))) for name in part.fields)


def _stretch(law: JointLaw) -> float:
    """What the slip force stretches the law's spring, in m; 0 where it has none."""
    sums = dict.fromkeys((Role.STIFFNESS, Role.SLIP_FORCE), 0.0)
    for p in parameters_of(law):
        if p.role in sums:
            sums[p.role] += float(np.sum(getattr(law, p.name)))
    stiffness, slip = sums.values()
    return slip / stiffness if stiffness > 0 else 0.0


def continuous_states(system: System) -> tuple[int, ...]:
    """Place among the states, structure first, of every state that the importer integrates in model exchange."""
    first = len(system.states)
    if not exchangeable(system):
        return tuple(range(first))
    states = [state.continuous for part in native_parts(system) for _, state in part.states]
    states += [True for _ in lags(system)]
    return (*range(first), *(first + i for i, continuous in enumerate(states) if continuous))


def native_variables(system: System) -> tuple[Variable, ...]:
    """All variables in the order of their value references, which are the same in FMI 2.0 and 3.0.

    Inputs, outputs, parameters, states of the structure and of the laws, the rate of each continuous state, and what
    FMI 3.0 alone knows as variables: event indicators and time.
    """
    parts = native_parts(system)
    out = [Variable(s.name, "input", s.unit, s.description, s.start, nominal=s.size) for s in system.inputs]
    out += [Variable(s.name, "output", s.unit, s.description, nominal=s.size) for s in system.outputs]
    for prefix, joint in system.joints:
        own = [v for v in variables_of(joint) if v.kind == "parameter"]
        out += [replace(v.renamed(prefixed(prefix, v.name)), unit=system.unit(prefix, v.unit)) for v in own]
    states = [
        Variable(s.name, "state", s.unit, s.description, float(x), nominal=s.size)
        for s, x in zip(system.states, system.start, strict=True)
    ]
    for part in parts:
        told = f"internal state of the law {part.kernel.word.replace('_', '-')}"
        states += [
            Variable(name, "state", system.unit(part.prefix, s.unit), told, nominal=part.nominal(s))
            for name, s in part.states
        ]
    for lag in lags(system):
        v = lagging(lag.condition, lag.condition.size)
        states.append(v.renamed(prefixed(lag.prefix, v.name)))
    held = set(continuous_states(system))
    out += [v if i in held else v.renamed(v.name, sized=False) for i, v in enumerate(states)]
    for i in sorted(held):
        name, unit = states[i].name, states[i].unit
        told = f"rate of the state {name}"
        out.append(Variable(f"der({name})", "rate", _per_second(unit), told, derivative_of=name))
    for part in parts:
        told = "crosses zero where the law changes its form"
        for i in range(part.indicators[1] - part.indicators[0]):
            out.append(Variable(f"{part.name}.indicator[{i}]", "indicator", "", told))
    out.append(Variable("time", "time", "s", "time"))
    return tuple(out)


def _per_second(unit: str) -> str:
    return {"1": "1/s", "m/s": "m/s^2", "rad/s": "rad/s^2"}.get(unit, f"{unit}/s")
