"""Export of a joint or a machine as an FMU that has proved itself before it is handed over."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

from jointlib.errors import InputError
from jointlib.io import atomic
from jointlib.joint import Joint
from jointlib.shown.progress import Progress, Silent, remark

from .members.archive import archive_bytes
from .members.build import can_compile, compilers_for
from .members.description import NAMELESS, Card, description_text, fingerprint
from .members.documentation import (
    condition_notes,
    cost_notes,
    licence_of,
    machine_notes,
    native_notes,
    python_notes,
    step_notes,
)
from .members.figures import native_figures
from .members.native import joints_of, native_variables, without_kernel
from .members.native_members import native_members, native_sources
from .members.page import documentation_text
from .members.source import TRANSLATION_UNIT
from .members.terminals import ICON, TERMINALS, icon, terminals_text
from .playback.python_slave import NAMELESS as NAMELESS_SLAVE
from .playback.python_slave import built_members, slave_source
from .playback.reference import CSV, FOLDER, INTEGRATED, MANIFEST, MANIFEST_TEXT, STIFF, csv_text, reference_run
from .system.closed import stiff_closed
from .system.step_limit import StepLimit, operating_range, step_limit
from .system.system import System, system_of_joint
from .system.under_conditions import extremes
from .system.variables import parts_of
from .verify import validate_fmu, verify_fmu

if TYPE_CHECKING:
    from .members.machine_system import Machine


@dataclass(frozen=True)
class Export:
    """An FMU that was written, and what its user must know."""

    file: Path
    platforms: tuple[str, ...]
    max_step: float | None
    """Largest admissible co-simulation step in s, None where there is none.

    For a joint that is where the coupling becomes unstable. What is integrated inside is stable with any step: there
    it is the one that resolves the inputs, which are held.
    """
    verified_with: tuple[str, ...]
    runtime: str
    messages: tuple[str, ...]
    """Sentences for the user."""
    cost: tuple[str, ...] = ()
    """What a step took on this computer: measured, so never in what is written twice alike."""


def export_fmu(
    joint: Joint | Machine | System | Path | str,
    path: Path | str,
    *,
    fmi: int = 2,
    runtime: str | None = None,
    platforms: Sequence[str] = (),
    names: str = "structured",
    tool: str | None = None,
    progress: Progress | None = None,
) -> Export:
    """Write a joint as an FMU (displacement, velocity in, force out), a machine (forces in, motions out) or a system.

    The runtime ``"c"`` is a native library, for co-simulation and, where every law can, model exchange, in FMI 2.0 or
    3.0; ``"python"`` needs a host that brings Python, and does joints only, co-simulation in FMI 2.0. None takes the
    native one where a C compiler is found. Co-simulation holds the inputs over a step; a machine is integrated inside.
    Each condition that parameters of joints follow is one more input, which starts at their reference.
    Before the file appears FMPy has validated it and repeated a run of the Python laws, within 1e-12 of the largest
    force of a joint, or within 1e-6 of the largest values of a machine. Where ``"c"`` is asked for and no compiler is
    found, the FMU holds its sources, is validated, and says that it was not run. ``platforms`` (``"win64"`` as in FMI
    2.0, or ``"x86_64-windows"`` as in 3.0) are compiled for beside this computer's own; without them all that can be.
    With ``names`` "flat" variables are called by letters, digits and _ alone, as identifiers of Modelica are.
    ``progress`` is told of every part.
    A joint or a machine may be a file, of a machine with its ``tool`` of several by name; what a machine's file leaves
    to be identified is. ``jointlib fmu`` does this.
    """
    from .members.machine_files import model_of

    path = Path(path)
    _check_path(path, fmi, runtime)
    if names not in {"structured", "flat"}:
        raise InputError(f"names is {names!r}, expected 'structured' or 'flat'")
    told_of = progress or Silent()
    with told_of.step("reading, and identifying what is open"):
        model, remarks = model_of(joint, tool)
        system = replace(_system_of(model), flat=names == "flat")
    _check_system(system)
    obstacle = _obstacle(system)
    chosen = runtime or ("python" if obstacle and system.lone else "c")
    _check_runtime(system, fmi, chosen, runtime is None)
    if platforms and chosen == "python":
        raise InputError(f"platform {platforms[0]!r}: the Python runtime brings its own, expected runtime 'c'")
    if system.flat:
        _check_flat(system, chosen)
    runs_here = chosen == "python" or can_compile()
    coupled = None if system.states else system.joints[0][1]
    over = operating_range(coupled) if coupled else None
    limit = step_limit(coupled, over) if coupled and over else None
    with told_of.step("making the reference run from the Python laws"):
        run = reference_run(system, over)
    max_step = limit.max_step if limit else system.step
    card = Card("", "", chosen, fmi, max_step, float(run.rows[-1, 0]), step=_proposed(limit, system.step))
    if system.states:
        card = replace(card, tolerance=max(INTEGRATED, run.error), replayed=STIFF if stiff_closed(system) else None)
    if chosen == "c":
        card = replace(card, sources=(TRANSLATION_UNIT,))
    reference = csv_text(replace(run, names=tuple(map(system.shown, run.names))))
    card = _named(system, card, reference)
    with told_of.step("writing and compiling the sources" if chosen == "c" else "building"):
        members, left = _native(system, card, platforms) if chosen == "c" else (_python(system, card), {})
    present = {name.split("/")[1] for name in members if name.startswith("binaries/")}
    told = native_notes(system, fmi, present, left) if chosen == "c" else python_notes("" if runtime else obstacle)
    if not runs_here:
        told = [f"The FMU was not run, as there is {obstacle}; fmpy compile builds it where there is one.", *told]
    steps = step_notes(system, chosen, over, limit) if over and limit else machine_notes(system)
    steps += condition_notes(system, chosen)
    messages = (*told, *steps, *remarks)
    # Who reads the page has the FMU: what it does comes before what it was not compiled for.
    page = documentation_text(system, (*steps, *remarks, *told), _figures(system, card))
    members |= {
        "modelDescription.xml": description_text(system, card).encode("utf-8"),
        f"{FOLDER}/{CSV}": reference.encode("utf-8"),
        MANIFEST: MANIFEST_TEXT.encode("utf-8"),
        "documentation/index.html": page.encode("utf-8"),
        TERMINALS: terminals_text(system).encode("utf-8"),
        ICON[fmi]: icon(system),
    }
    data = archive_bytes(members)
    cost: tuple[str, ...] = ()
    if runs_here:
        with told_of.step("validating and repeating the reference run"):
            verified = verify_fmu(path, data)
            cost = cost_notes(system, card.step, verified.step_times)
            if cost and card.step is not None and max(verified.step_times) > card.step:
                remark(cost[0])
        made, clients = verified.platforms, verified.verified_with
    else:
        made, clients = validate_fmu(path, data), ()
    atomic.write(path, lambda file: file.write(data))
    return Export(path, made, max_step, clients, chosen, messages, cost)


def _system_of(model: Joint | Machine | System) -> System:
    if isinstance(model, Joint):
        if not model.name or not model.name.isprintable():
            raise InputError(f"joint name is {model.name!r}, expected printable characters for an FMU")
        return system_of_joint(model)
    if isinstance(model, System):
        return model
    from .members.machine_system import system_of_machine

    return system_of_machine(model)


def _proposed(limit: StepLimit | None, step: float | None) -> float | None:
    """Default step in s: where a joint is coupled, a twentieth of the limit keeps its damping within 5 %."""
    if limit is None:
        return step
    return None if limit.max_step is None else limit.max_step / 20


def _figures(system: System, card: Card) -> list[tuple[str, str]]:
    """Step, cost and accuracy for the page inside."""
    rows = [("made with", f"jointlib {version('jointlib')}"), ("runtime", card.runtime)]
    if card.max_step is None or card.max_step != card.step:  # else no step makes it unstable
        largest = "none is safe" if card.max_step is None else f"{card.max_step:.3g} s"
        rows.append(("largest co-simulation step", largest))
    if card.step is not None:
        rows.append(("step it proposes", f"{card.step:.3g} s"))
    repeats = "to rounding" if card.tolerance is None else f"within {card.tolerance:g} of the largest value"
    rows.append(("repeats its reference run, made by the Python laws,", repeats))
    return rows + (native_figures(system) if card.runtime == "c" else [])


def _check_path(path: Path, fmi: int, runtime: str | None) -> None:
    if path.suffix != ".fmu":
        raise InputError(f"{path}: the file name of an FMU, expected one that ends in .fmu")
    if path.is_dir():
        raise InputError(f"{path}: a folder, expected the name of a file to write")
    if fmi not in {2, 3}:
        raise InputError(f"fmi is {fmi!r}, expected 2 or 3")
    if runtime not in {None, "c", "python"}:
        raise InputError(f"runtime is {runtime!r}, expected 'c' or 'python'")


def _check_system(system: System) -> None:
    if not system.name or not system.name.isprintable():
        raise InputError(f"name is {system.name!r}, expected printable characters for an FMU")
    for joint in joints_of(system):
        parts_of(joint)
        extremes(joint)


def _check_flat(system: System, runtime: str) -> None:
    """Names stay different without their dots, brackets and quotes; the Python runtime has its own."""
    if runtime == "python":
        raise InputError("names is 'flat', which needs the native runtime; use runtime 'c'")
    found: dict[str, str] = {}
    for name in (v.name for v in native_variables(system)):
        other = found.setdefault(system.shown(name), name)
        if other != name:
            raise InputError(f"{system.name!r}: {name} and {other} are both {system.shown(name)} in flat names")


def _obstacle(system: System) -> str:
    """What keeps the native FMU away, in half a sentence; empty if nothing does."""
    missing = without_kernel(joints_of(system))
    if missing:
        files = ", ".join(f"{kind.replace('-', '_')}.h" for kind in missing)
        return f"no C kernel for {', '.join(missing)} ({files} beside the module of the law)"
    if not can_compile():
        return "no C compiler here (cc, gcc, clang, or pip install 'jointlib[native]')"
    return ""


def _check_runtime(system: System, fmi: int, runtime: str, by_default: bool) -> None:
    obstacle, missing = _obstacle(system), without_kernel(joints_of(system))
    if not system.lone and (runtime == "python" or missing or (by_default and obstacle)):
        raise InputError(
            f"{system.name!r}: the Python runtime does lone joints only"
            + (f", and there is {obstacle}" if obstacle else "; leave the runtime out or use 'c'")
        )
    if runtime == "c" and missing:
        raise InputError(f"runtime is 'c', but there is {obstacle}; use runtime 'python'")
    if runtime == "python" and fmi == 3:
        sources = "" if missing else "; runtime 'c' writes the sources alone"
        reason = f", and there is {obstacle}{sources}" if by_default else "; leave the runtime out or use 'c'"
        raise InputError(f"fmi is 3, which needs the native runtime{reason}")


def _named(system: System, card: Card, reference: str) -> Card:
    """The card with the token, which is the hash of the content, and a name of its own that carries it."""
    nameless = replace(card, identifier=NAMELESS if card.runtime == "c" else NAMELESS_SLAVE)
    source = _source(system, nameless)
    token = fingerprint(nameless.identifier, "", description_text(system, nameless), source, reference)
    # Two FMUs in one process need libraries or modules of different names.
    word = re.sub(r"[^A-Za-z0-9]+", "_", system.name).strip("_") or "joint"
    identifier = f"{word}_{token[:12]}"
    return replace(card, identifier=identifier if word[0].isalpha() else f"joint_{identifier}", token=token)


def _source(system: System, card: Card) -> dict[str, str]:
    """The members with the FMU's own code, by their names."""
    if card.runtime == "c":
        return native_sources(system, card.fmi, card.identifier, card.token)
    return {f"resources/{card.identifier}.py": slave_source(_lone(system), card.identifier)}


def _native(system: System, card: Card, platforms: Sequence[str]) -> tuple[dict[str, bytes], dict[str, str]]:
    known, source = compilers_for(platforms), _source(system, card)
    members, left = native_members(source, card.fmi, card.identifier, known, all_needed=bool(platforms))
    return members | {"documentation/licenses/jointlib.txt": licence_of("jointlib").encode("utf-8")}, left


def _python(system: System, card: Card) -> dict[str, bytes]:
    members = built_members(slave_source(_lone(system), card.identifier), card.identifier)
    return members | {"documentation/licenses/pythonfmu.txt": licence_of("pythonfmu").encode("utf-8")}


def _lone(system: System) -> Joint:
    assert system.lone is not None
    return system.lone
