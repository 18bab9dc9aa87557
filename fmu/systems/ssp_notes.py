"""What the user of a system of FMUs must know about its communication step, as sentences."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping

import numpy as np

from ..loop_step import Loop, Master, natural_frequencies
from ..members.build import absent
from ..members.machine_parts import Parts
from ..system.conditions import Condition
from ..system.si_unit import turned
from ..system.step_limit import StepLimit

RESOLVED = 20
"""Steps per period that follow a vibration closely."""
_WHOLE = "the whole machine as one FMU (jointlib fmu MACHINE), which couples nothing from outside"


def step_notes(
    parts: Parts, loop: Loop, steps: Mapping[Master, float | None], tangents: Mapping[str, StepLimit]
) -> list[str]:
    """The limit, what it was computed for, what to take, and when to take another road.

    Another road is advised where a step that resolves the highest frequency of interest with 20 steps per period
    is not stable: then the coupling sets the step, not the motion.
    """
    worst = _spelled(tangents, {link.name for link in parts.links if link.turns})
    said = [f"The FMUs exchange values once per step; joints count at their stiffest and least damped, {worst}."]
    said += [f"{name} is touched by nothing and left out." for name in parts.untouched]
    jacobi, seidel = steps[Master.JACOBI], steps[Master.GAUSS_SEIDEL]
    if jacobi is None or seidel is None:
        return [*said, f"So counted a mode has no damping, and no communication step is stable: take {_WHOLE}."]
    if not math.isfinite(jacobi):
        return [*said, "No communication step makes this machine unstable."]
    answered = f"{seidel:.3g} s" if math.isfinite(seidel) else "no limit"
    said.append(
        f"Steps of {jacobi:.3g} s and more are unstable if all FMUs step at once ({answered} where the joints answer "
        f"before the next step), in the assembled machine; {jacobi / 20:.3g} s keep the damping within 5 %."
    )
    highest = parts.highest or float(np.max(natural_frequencies(loop)))
    resolved = 1 / (RESOLVED * highest) if highest else 0.0
    if jacobi < resolved:
        said.append(
            f"To follow {highest:.4g} Hz, {resolved:.2g} s would do: the coupling sets the step. Take {_WHOLE}, or "
            "couple the FMUs by model exchange."
        )
    return said


def runtime_notes(platforms: Iterable[str], runtimes: Collection[str], fmi: int = 2) -> list[str]:
    """Where the FMUs run."""
    said = []
    if missing := absent(fmi, platforms):
        said.append(
            f"The FMUs have no library for {', '.join(missing)}: pip install 'jointlib[native]' brings a compiler for "
            "every platform."
        )
    if "python" in runtimes:
        said.append("An FMU in it has the Python runtime and runs only in hosts that bring Python, such as FMPy.")
    return said


def condition_notes(conditions: Iterable[Condition]) -> list[str]:
    """About the inputs of the system that are no forces."""
    told = ", ".join(f"{c.name} (else {c.start:g} {c.unit})" for c in conditions)
    if not told:
        return []
    return [
        f"Parameters of joints follow inputs of the system: {told}. A master that hands over 0 where it is given "
        "nothing, as FMPy does, needs them."
    ]


def _spelled(tangents: Mapping[str, StepLimit], turning: Collection[str]) -> str:
    said = []
    for name, limit in sorted(tangents.items()):
        k, c = (turned(unit) if name in turning else unit for unit in ("N/m", "N s/m"))
        said.append(f"{name} {limit.stiffness:.4g} {k} and {limit.damping:.4g} {c}")
    return ", ".join(said)
