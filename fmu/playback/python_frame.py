"""The Python slave's frame, written once: FMI calls on one side, the joint's kernels on the other.

:mod:`fmu.playback.python_slave` copies the class behind the tables and kernels that it generates; the empty ones here
only show their form.
"""

from __future__ import annotations

import json
import math
from typing import Any

from pythonfmu import Fmi2Causality, Fmi2Initial, Fmi2Slave, Fmi2Variability, Real
from pythonfmu.enums import Fmi2Status

VARIABLES: tuple[tuple[str, str, float], ...] = ()
BOUNDS: tuple[tuple[float, float, float], ...] = ()


def joint_check(p: list[float]) -> None:
    pass


def joint_initial(p: list[float], z: float) -> list[float]:
    return []


def joint_step(p: list[float], s: list[float], z: float, v: float, h: float) -> tuple[float, list[float]]:
    return 0.0, s


class JointSlave(Fmi2Slave):  # type: ignore[misc]
    # pythonfmu finds the class by the line above and names the model after it. No method raises: an exception that
    # reaches pythonfmu 0.7 corrupts the memory of the process. A bad value gives the force nan and fails the step.

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.inputs = [start for _, causality, start in VARIABLES if causality == "input"]
        self.parameters = [start for _, causality, start in VARIABLES if causality == "parameter"]
        # None until initialization ends: virgin, at the displacement that is set.
        self.states: list[float] | None = None
        # None where an input, a parameter or a state was set since the force was computed.
        self.last_force: float | None = None
        self.sound = False  # the parameters were checked since they were set
        self.foreign = False  # a state was restored that is not one of this FMU
        counts = {"input": 0, "parameter": 0, "local": 0, "output": 0}
        for name, causality, _ in VARIABLES:
            self.declare(name, causality, counts[causality])
            counts[causality] += 1
        self.size = counts["local"]

    def declare(self, name: str, causality: str, i: int) -> None:
        getter, setter = {
            "input": (lambda: self.inputs[i], lambda value: self.put(self.inputs, i, value)),
            "parameter": (lambda: self.parameters[i], lambda value: self.put(self.parameters, i, value)),
            "local": (lambda: self.states_now()[i], lambda value: self.place(i, value)),
            "output": (self.force_now, lambda value: self.complain(f"{name} is an output and cannot be set")),
        }[causality]
        variability = Fmi2Variability.tunable if causality == "parameter" else Fmi2Variability.continuous
        initial = {"input": None, "parameter": Fmi2Initial.exact}.get(causality, Fmi2Initial.calculated)
        causes = Fmi2Causality[causality]
        variable = Real(name, causality=causes, variability=variability, initial=initial, getter=getter, setter=setter)
        self.register_variable(variable, nested=False)

    def complain(self, sentence: str) -> None:
        self.log(sentence, Fmi2Status.error)

    def put(self, values: list[float], i: int, value: float) -> None:
        values[i] = value
        self.last_force = None
        self.sound = self.sound and values is self.inputs

    def place(self, i: int, value: float) -> None:
        states = self.states_now()
        states[i] = value
        self.states, self.last_force = states, None

    def problem(self) -> str:
        """What stands in the way of a force, in one sentence; empty if nothing does."""
        if self.foreign:
            return "the restored state is damaged or belongs to another FMU"
        if not self.sound:
            names = [name for name, causality, _ in VARIABLES if causality == "parameter"]
            for i, (lower, upper, above) in enumerate(BOUNDS):
                value = self.parameters[i]
                if not math.isfinite(value):
                    return f"{names[i]} is {value}, expected a finite number"
                if value <= above:
                    return f"{names[i]} is {value}, expected a value above {above}"
                if not lower <= value <= upper:
                    return f"{names[i]} is {value}, expected a value between {lower} and {upper}"
            try:
                joint_check(self.parameters)
            except ValueError as error:
                return str(error)
            self.sound = True
        if not (math.isfinite(self.inputs[0]) and math.isfinite(self.inputs[1])):
            return f"displacement and velocity are {self.inputs}, expected finite numbers"
        return ""

    def states_now(self) -> list[float]:
        if self.states is not None:
            return list(self.states)
        return [math.nan] * self.size if self.problem() else joint_initial(self.parameters, self.inputs[0])

    def advanced(self, h: float) -> tuple[float, list[float] | None, str]:
        """Force and states after h seconds, and the problem that kept them away."""
        problem = self.problem()
        if not problem:
            try:
                return *joint_step(self.parameters, self.states_now(), self.inputs[0], self.inputs[1], h), ""
            except (ArithmeticError, ValueError) as error:
                problem = f"the force cannot be computed ({error})"
        return math.nan, self.states, problem

    def force_now(self) -> float:
        if self.last_force is None:
            self.last_force = self.advanced(0.0)[0]
        return self.last_force

    def exit_initialization_mode(self) -> None:
        problem = self.problem()
        if problem:
            self.complain(problem)
        else:
            self.states = self.states_now()

    def do_step(self, current_time: float, step_size: float) -> bool:
        self.last_force, self.states, problem = self.advanced(step_size)
        if problem:
            self.complain(problem)
        return not problem

    # The force of the last step goes with the values and states, so that a restored slave repeats bit for bit.
    def _get_fmu_state(self) -> dict[str, Any]:
        states = None if self.states is None else list(self.states)
        held = {"inputs": list(self.inputs), "parameters": list(self.parameters), "states": states}
        return {"model": type(self).__name__, **held, "last_force": self.last_force}

    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        self.foreign = state.get("model") != type(self).__name__
        self.last_force, self.sound = None, False
        if self.foreign:
            self.complain(self.problem())
            return
        self.inputs, self.parameters = list(state["inputs"]), list(state["parameters"])
        self.states = None if state["states"] is None else list(state["states"])
        self.last_force = state["last_force"]

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> dict[str, Any]:
        try:
            held = json.loads(state.decode("utf-8"))
        except ValueError:
            return {}
        return held if isinstance(held, dict) else {}
