"""A joint as its native FMU sees it: each law with its C kernel, and the variables that model exchange adds."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.law import JointLaw
from jointlib.parameter import Role, parameters_of

from .c_kernel import CKernel, State, c_kernel_of, count
from .step_limit import operating_range
from .variables import Part, Variable, parts_of, variables_of


@dataclass(frozen=True)
class NativePart:
    """One law of the joint with its C kernel; pairs are the first place and the one behind the last."""

    part: Part
    kernel: CKernel
    parameters: tuple[int, int]
    states: tuple[tuple[str, State], ...]
    """Each state by its full name, ``jenkins.slider``."""
    modes: tuple[int, int]
    indicators: tuple[int, int]
    size: float
    """Usual size in m of a state in m."""

    def nominal(self, state: State) -> float:
        """Usual size of a state, which tells a solver what error is small."""
        return self.size if state.unit == "m" else 1.0


def without_kernel(joint: Joint) -> tuple[str, ...]:
    """The kinds of the joint's laws that have no C kernel."""
    return tuple(dict.fromkeys(law.kind for law in joint.laws if c_kernel_of(law) is None))


def only_in_steps(joint: Joint) -> tuple[str, ...]:
    """The kinds of the joint's laws that exist in co-simulation only."""
    kernels = ((law.kind, c_kernel_of(law)) for law in joint.laws)
    return tuple(dict.fromkeys(kind for kind, kernel in kernels if kernel is not None and not kernel.exchange))


def native_parts(joint: Joint) -> tuple[NativePart, ...]:
    """The laws in order, each with the places of its parameters, modes and event indicators.

    A joint that exists in co-simulation only has no indicators; its modes are set and then not used.
    """
    missing = without_kernel(joint)
    if missing:
        raise InputError(f"joint {joint.name!r}: no C kernel for {', '.join(missing)}; use runtime 'python'")
    exchange = not only_in_steps(joint)
    travel = operating_range(joint).amplitude
    out: list[NativePart] = []
    position = mode = indicator = 0
    for part, law in zip(parts_of(joint), joint.laws, strict=True):
        kernel = c_kernel_of(law)
        assert kernel is not None
        parameters = (position, position + sum(int(np.size(getattr(law, name))) for name in part.fields))
        modes = (mode, mode + count(kernel.modes, part.lengths))
        indicators = (indicator, indicator + (count(kernel.indicators, part.lengths) if exchange else 0))
        states = tuple((f"{part.name}.{name}", state) for name, state in kernel.state_names(part.lengths))
        out.append(NativePart(part, kernel, parameters, states, modes, indicators, _stretch(law) or travel))
        position, mode, indicator = parameters[1], modes[1], indicators[1]
    return tuple(out)


def _stretch(law: JointLaw) -> float:
    """What the slip force stretches the law's spring, in m; 0 where it has none."""
    sums = dict.fromkeys((Role.STIFFNESS, Role.SLIP_FORCE), 0.0)
    for p in parameters_of(law):
        if p.role in sums:
            sums[p.role] += float(np.sum(getattr(law, p.name)))
    stiffness, slip = sums.values()
    return slip / stiffness if stiffness > 0 else 0.0


def continuous_states(joint: Joint) -> tuple[int, ...]:
    """Place among the states of every state that the importer integrates in model exchange."""
    if only_in_steps(joint):
        return ()
    states = [state for part in native_parts(joint) for _, state in part.states]
    return tuple(i for i, state in enumerate(states) if state.continuous)


def native_variables(joint: Joint) -> tuple[Variable, ...]:
    """All variables in the order of their value references, which are the same in FMI 2.0 and 3.0.

    Behind those of :func:`~fmu.variables.variables_of`: the rate of each continuous state, and what FMI 3.0 alone
    knows as variables, event indicators and time.
    """
    parts, held = native_parts(joint), set(continuous_states(joint))
    states = [(name, state, part.nominal(state)) for part in parts for name, state in part.states]
    nominal = {name: size for i, (name, _, size) in enumerate(states) if i in held}
    out = [_sized(v, nominal.get(v.name)) for v in variables_of(joint)]
    for i, (name, state, _) in enumerate(states):
        if i in held:
            unit = "1/s" if state.unit == "1" else f"{state.unit}/s"
            told = f"rate of the state {name}"
            out.append(Variable(f"der({name})", "rate", unit, told, derivative_of=name))
    for part in parts:
        for i in range(part.indicators[1] - part.indicators[0]):
            told = "crosses zero where the law changes its form"
            out.append(Variable(f"{part.part.name}.indicator[{i}]", "indicator", "", told))
    out.append(Variable("time", "time", "s", "time"))
    return tuple(out)


def _sized(variable: Variable, nominal: float | None) -> Variable:
    return variable if nominal is None else replace(variable, nominal=nominal)
