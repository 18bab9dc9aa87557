"""Export of a machine as a system of FMUs (SSP): one FMU for each body and one for each flexible connection."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path

import numpy as np

from jointlib.errors import InputError, together
from jointlib.io import atomic

from .export import Export, export_fmu
from .loop_step import Loop, Master, largest_step, natural_frequencies
from .members.archive import archive_bytes
from .members.machine_parts import Machine, Parts, parts_of_machine
from .members.machine_system import system_of_component
from .system.conditions import Condition, conditions_of
from .system.step_limit import StepLimit, operating_range, step_limit
from .system.system import System, system_of_connection
from .systems.ssd import INNER_SSD, SSD, Connector, Element, End, Structure, check_structure, inner, ssd_text
from .systems.ssp_notes import condition_notes, runtime_notes, step_notes
from .systems.ssp_verify import verify_ssp
from .systems.ssv import SSV, check_parameters, ssv_text


@dataclass(frozen=True)
class SspExport:
    """A system of FMUs that was written, and what its user must know."""

    file: Path
    max_step: float | None
    """Largest stable communication step in s of a Jacobi master, None where no step is, or where every step is."""
    recommended_step: float | None
    """Step in s that keeps the damping within 5 %."""
    masters: dict[str, float | None]
    """Largest stable step in s with a master of each kind."""
    platforms: tuple[str, ...]
    verified_with: tuple[str, ...]
    messages: tuple[str, ...]
    """Sentences for the user."""


def export_ssp(
    machine: Machine | Path | str,
    path: Path | str,
    *,
    fmi: int = 2,
    platforms: Sequence[str] = (),
    tool: str | None = None,
) -> SspExport:
    """Write a machine as an SSP whose FMUs exchange forces and motions once per communication step.

    Components that rigid connections tie together are one FMU. The identified parameters are the start values of the
    FMUs. With ``fmi`` 2 it is SSP 1.0 with FMUs of FMI 2.0, with 3 SSP 2.0 with FMUs of FMI 3.0; ``platforms`` as in
    :func:`.export_fmu`. Before the file appears every FMU has been verified, the structure has been compared with the
    FMUs and, in SSP 1.0, with the schema, and a short run in FMPy agreed with the machine's own equations. The machine
    may be a file, with its ``tool`` of several by name; what that leaves to be identified is. ``jointlib ssp`` does
    this.
    """
    from .members.machine_files import whole_machine

    path = Path(path)
    if path.suffix != ".ssp":
        raise InputError(f"{path}: the file name of a system of FMUs, expected one that ends in .ssp")
    if path.is_dir():
        raise InputError(f"{path}: a folder, expected the name of a file to write")
    if fmi not in {2, 3}:
        raise InputError(f"fmi is {fmi!r}, expected 2 or 3")
    machine, remarks = whole_machine(machine, tool)
    parts = _parts(machine)
    loop, tangents = stiffest_loop(parts)
    steps = {master: largest_step(loop, master) for master in Master}
    systems = {name: replace(system, author=machine.author) for name, system in _systems(parts).items()}
    members: dict[str, bytes] = {}
    exports: list[Export] = []
    with tempfile.TemporaryDirectory(prefix="jointlib-") as folder:
        for name, system in systems.items():
            file = Path(folder) / f"{name}.fmu"
            exports.append(export_fmu(system, file, fmi=fmi, platforms=platforms))
            members[f"resources/{file.name}"] = file.read_bytes()
    conditions = conditions_of(machine.where, (joint for _, joint in parts.joints))
    structure = replace(_structure(parts, systems, conditions), author=machine.author)
    coupling = {f"{_word(master)}MaxStep": repr(step) for master, step in steps.items() if _finite(step)}
    jacobi = _finite(steps[Master.JACOBI])
    recommended = jacobi / 20 if jacobi else None
    coupling |= {"recommendedStep": repr(recommended)} if recommended else {}
    slowest = float(min((f for f in natural_frequencies(loop) if f > 0), default=1.0))
    for name, shown in ((SSD, structure), (INNER_SSD, inner(structure))):
        members[name] = ssd_text(shown, coupling, recommended, 10 / slowest, fmi).encode("utf-8")
    members[SSV] = ssv_text(f"joints of {parts.word}", systems, fmi).encode("utf-8")
    check_structure(path, members)
    check_parameters(path, members)
    data = archive_bytes(members)
    verify_ssp(path, data, parts, loop, jacobi, fmi, conditions)
    atomic.write(path, lambda file: file.write(data))
    platforms = sorted(set.intersection(*(set(done.platforms) for done in exports)))
    told = [
        *step_notes(parts, loop, steps, tangents),
        *runtime_notes(platforms, {done.runtime for done in exports}, fmi),
        *condition_notes(conditions),
    ]
    return SspExport(
        path,
        jacobi,
        recommended,
        {master.name.lower(): _finite(step) for master, step in steps.items()},
        tuple(platforms),
        (f"FMPy {version('fmpy')}",),
        (*told, *remarks),
    )


def _parts(machine: Machine) -> Parts:
    """The machine cut at its joints; all that forbids it is refused at once."""

    def begins_at_rest() -> None:
        if machine.static is not None:
            raise InputError(
                f"{machine.where}: static: the parts of a system of FMUs begin without each other's forces, so it "
                "would not begin at rest under its load; export it as one FMU (jointlib fmu), or leave [static] out"
            )

    found: list[Parts] = []
    together(begins_at_rest, lambda: found.append(parts_of_machine(machine)))
    return found[0]


def _finite(step: float | None) -> float | None:
    return step if step is not None and math.isfinite(step) else None


def _word(master: Master) -> str:
    first, *rest = master.name.lower().split("_")
    return first + "".join(word.capitalize() for word in rest)


def stiffest_loop(parts: Parts) -> tuple[Loop, dict[str, StepLimit]]:
    """The assembled machine with every joint at its largest stiffness and smallest damping, and these by name."""
    equations = parts.equations
    limits = {name: step_limit(joint, operating_range(joint)) for name, joint in parts.joints}
    k = np.array([limit.stiffness for limit in limits.values()])
    c = np.array([limit.damping for limit in limits.values()])
    return Loop(equations.mass, equations.damping, equations.stiffness, equations.joints, k, c), limits


def _systems(parts: Parts) -> dict[str, System]:
    """One system for each FMU by the name of its element; bodies first, so that joints answer their new motion."""
    bodies = {body.name: system_of_component(body.component, body.ports, body.turning) for body in parts.bodies}
    links = {link.name: system_of_connection(link.name, link.joint, len(link.ends), link.turns) for link in parts.links}
    return bodies | links


def _structure(parts: Parts, systems: Mapping[str, System], conditions: Sequence[Condition]) -> Structure:
    """Elements and wires; a body's port takes a force from the link, or the outside, that it belongs to.

    A condition comes from outside and goes to all joints that depend on it.
    """
    elements = {name: _element(name, system) for name, system in systems.items()}
    connectors: list[Connector] = []
    wires: list[tuple[End, End]] = []
    for name, (body, port) in parts.outside.items():
        own = {c.name: c for c in elements[body].connectors}
        for quantity in ("force", "displacement", "velocity"):
            inside: End = (body, f"{quantity}_{port}")
            shown: End = (None, f"{quantity}_{name}")
            connectors.append(replace(own[inside[1]], name=shown[1]))
            wires.append((shown, inside) if quantity == "force" else (inside, shown))
    for c in conditions:
        connectors.append(Connector(c.name, "input", c.unit, c.description))
        wires += [((None, c.name), (name, c.name)) for name in elements if c.name in _names(elements[name])]
    for link in parts.links:
        for side, (body, port) in enumerate(link.ends, start=1):
            wires.append(((link.name, f"force_{side}"), (body, f"force_{port}")))
            wires += [((body, f"{q}_{port}"), (link.name, f"{q}_{side}")) for q in ("displacement", "velocity")]
    order = sorted(wires, key=lambda wire: [end[0] or "" for end in wire] + [end[1] for end in wire])
    return Structure(parts.word, tuple(connectors), tuple(elements.values()), tuple(order), SSV)


def _names(element: Element) -> set[str]:
    return {connector.name for connector in element.connectors}


def _element(name: str, system: System) -> Element:
    signals = [*(("input", s) for s in system.inputs), *(("output", s) for s in system.outputs)]
    connectors = tuple(Connector(s.name, kind, s.unit, s.description) for kind, s in signals)
    return Element(name, f"resources/{name}.fmu", connectors, system.title)
