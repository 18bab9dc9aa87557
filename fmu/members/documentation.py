"""What the user of an FMU must know, as sentences, and the licences that travel with it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from importlib.metadata import PackageNotFoundError, distribution

from ..system.step_limit import Range, StepLimit
from ..system.system import System
from .build import absent
from .native import joints_of, only_in_steps

_CONTAINER = "put mass and joint into one FMU container with a small inner step"


def python_notes(obstacle: str) -> list[str]:
    """About the Python runtime; ``obstacle`` is what kept the native one away, if it was wanted."""
    why = [f"The FMU has the Python runtime, as there is {obstacle}."] if obstacle else []
    return ["The FMU runs only in hosts that bring Python, such as FMPy; a host without Python cannot load it.", *why]


def native_notes(system: System, fmi: int, present: Iterable[str], left: Mapping[str, str]) -> list[str]:
    """About the native runtime with libraries for the platforms ``present``; compilers of those ``left`` failed."""
    said = []
    if steps := only_in_steps(joints_of(system)):
        said.append(f"The FMU does co-simulation only, as the importer cannot integrate {', '.join(steps)}.")
    for platform, why in left.items():
        said.append(f"It has no library for {platform}, as its compiler failed: {why}.")
    if missing := [name for name in absent(fmi, present) if name not in left]:
        said.append(
            f"It has no library for {', '.join(missing)}: pip install 'jointlib[native]' brings a compiler for every "
            "platform, and fmpy compile builds the FMU from its own sources on any."
        )
    return said


def step_notes(system: System, runtime: str, over: Range, limit: StepLimit) -> list[str]:
    """About the co-simulation step of a joint."""
    ((prefix, joint),) = system.joints
    length, speed, k, c = (system.unit(prefix, unit) for unit in ("m", "m/s", "N/m", "N s/m"))
    spent = f"abs(z) up to {over.amplitude:g} {length} and abs(ż) up to {over.velocity:g} {speed}"
    where = f"over the joint's validity, {spent}" if over.stated else f"for {spent}, as the joint states no full range"
    said = ["In co-simulation inputs are held over a step, and the force follows them at once."]
    if limit.max_step is not None:
        return [
            *said,
            f"Steps of {limit.max_step:.3g} s and more make an explicit co-simulation unstable: 2c/(3k) with "
            f"k = {limit.stiffness:.4g} {k} and c = {limit.damping:.4g} {c}, {where}.",
            f"To keep the damping within 5 %, take at most {limit.max_step / 20:.3g} s, the default step in the FMU.",
        ]
    if limit.stiffness <= 0:
        return [*said, f"The joint has no stiffness {where}, so it sets no limit to the co-simulation step by itself."]
    if only_in_steps((joint,)):
        advice = _CONTAINER
    elif runtime == "c":
        advice = f"use model exchange, or {_CONTAINER}"
    else:
        advice = f"{_CONTAINER}, or use model exchange, which the native runtime offers"
    fall = f"The joint's damping falls to {limit.damping:.4g} {c} {where}"
    return [*said, f"{fall}: no explicit co-simulation step is safe; {advice}."]


def machine_notes(system: System) -> list[str]:
    """About the communication step of what is integrated inside."""
    said = [
        "The equations of motion are integrated inside with steps of their own. Forces are held over a step, unless "
        "the importer says how they go on within it: by derivatives of the inputs in FMI 2.0, at intermediate updates "
        "in 3.0."
    ]
    if system.load is not None:
        said.append(
            "It begins at rest at the working point of its static load, which acts on it as constant forces; its "
            "displacements count from the machine without load."
        )
    if system.step is None:
        return [*said, "Nothing in it swings by itself, so it sets no limit to the co-simulation step."]
    return [
        *said,
        "No co-simulation step makes it unstable. Held inputs come half a step late on average: a step of "
        f"{system.step:.3g} s, the default in the FMU, resolves forces up to {0.05 / system.step:.4g} Hz by 20 steps a "
        "period.",
    ]


def condition_notes(system: System, runtime: str) -> list[str]:
    """About the inputs that parameters of joints follow."""
    said = []
    for c in system.conditions:
        known = "over its period" if c.high == float("inf") else f"from {c.low:g} to {c.high:g} {c.unit}"
        beyond = "" if c.high == float("inf") else "; beyond, they stay what they are at the end"
        logged = ", and the log says so once" if beyond and runtime == "c" else ""
        said.append(
            f"Parameters follow the input {c.name}, which is {c.start:g} {c.unit} unless it is connected, and are "
            f"known {known}{beyond}{logged}."
        )
    return said


def cost_notes(system: System, step: float | None, taken: Sequence[float]) -> tuple[str, ...]:
    """What a step takes on this computer at the tolerance of the default experiment and without one, where something
    is integrated inside."""
    if not system.states or step is None or not all(taken) or not taken:
        return ()
    told, untold = (f"{x * 1e6:.2g} µs, {_pace(step / x)}" for x in taken)
    return (
        f"A step of {step:.3g} s takes {told}, here at the tolerance that the FMU proposes; {untold}, if the importer "
        "tells none.",
    )


def _pace(rate: float) -> str:
    return f"{rate:.2g} times real time" if rate >= 1 else f"{1 / rate:.2g} times slower than real time"


def licence_of(package: str) -> str:
    """The licence under which an installed distribution's files travel inside the FMU."""
    try:
        files = [file for file in distribution(package).files or [] if file.name.upper().startswith("LICEN")]
    except PackageNotFoundError:
        files = []
    return files[0].read_text(encoding="utf-8") if files else f"{package}: installed without its licence text.\n"
