"""Export of a joint as an FMU that has proved itself before it is handed over."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

from jointlib.errors import InputError
from jointlib.io import atomic
from jointlib.joint import Joint

from .archive import archive_bytes
from .build import can_compile, compilers
from .description import NAMELESS, Card, description_text, fingerprint
from .documentation import documentation_text, licence_of, native_notes, python_notes, step_notes
from .native import without_kernel
from .native_members import native_members, native_sources
from .python_slave import NAMELESS as NAMELESS_SLAVE
from .python_slave import built_members, slave_source
from .reference import CSV, FOLDER, MANIFEST, MANIFEST_TEXT, csv_text, reference_run
from .source import TRANSLATION_UNIT
from .step_limit import operating_range, step_limit
from .variables import parts_of
from .verify import validate_fmu, verify_fmu


@dataclass(frozen=True)
class Export:
    """An FMU that was written, and what its user must know."""

    file: Path
    platforms: tuple[str, ...]
    max_step: float | None
    """Largest co-simulation step in s before the coupling is unstable; None where no step is safe."""
    verified_with: tuple[str, ...]
    runtime: str
    messages: tuple[str, ...]
    """Sentences for the user."""


def export_fmu(joint: Joint, path: Path | str, *, fmi: int = 2, runtime: str | None = None) -> Export:
    """Write a joint as an FMU: inputs displacement and velocity, output force.

    The runtime ``"c"`` is a native library, for co-simulation and, where every law can, model exchange, in FMI 2.0 or
    3.0; ``"python"`` needs a host that brings Python, and does co-simulation in FMI 2.0. None takes the native one
    where a C compiler is found. Co-simulation holds the inputs over a step. Before the file appears FMPy has
    validated it and repeated a run of the Python law within 1e-12 of the largest force. Where ``"c"`` is asked for and
    no compiler is found, the FMU holds its sources, is validated, and says that it was not run.
    """
    path = Path(path)
    _check_request(joint, path, fmi, runtime)
    obstacle = _obstacle(joint)
    chosen = runtime or ("python" if obstacle else "c")
    _check_runtime(joint, fmi, chosen, runtime is None)
    runs_here = chosen == "python" or can_compile()
    over = operating_range(joint)
    limit = step_limit(joint, over)
    run = reference_run(joint, over)
    card = Card("", "", chosen, fmi, limit.max_step, float(run.rows[-1, 0]))
    if chosen == "c":
        card = replace(card, sources=(TRANSLATION_UNIT,))
    reference = csv_text(run)
    card = _named(joint, card, reference)
    members = _native(joint, card) if chosen == "c" else _python(joint, card)
    present = {name.split("/")[1] for name in members if name.startswith("binaries/")}
    told = native_notes(joint, fmi, present) if chosen == "c" else python_notes("" if runtime else obstacle)
    if not runs_here:
        told = [f"The FMU was not run, as there is {obstacle}; fmpy compile builds it where there is one.", *told]
    messages = (*told, *step_notes(joint, chosen, over, limit))
    members |= {
        "modelDescription.xml": description_text(joint, card).encode("utf-8"),
        f"{FOLDER}/{CSV}": reference.encode("utf-8"),
        MANIFEST: MANIFEST_TEXT.encode("utf-8"),
        "documentation/index.html": documentation_text(joint, messages).encode("utf-8"),
    }
    data = archive_bytes(members)
    if runs_here:
        verified = verify_fmu(path, data)
        platforms, clients = verified.platforms, verified.verified_with
    else:
        platforms, clients = validate_fmu(path, data), ()
    atomic.write(path, lambda file: file.write(data))
    return Export(path, platforms, limit.max_step, clients, chosen, messages)


def _check_request(joint: Joint, path: Path, fmi: int, runtime: str | None) -> None:
    if path.suffix != ".fmu":
        raise InputError(f"{path}: the file name of an FMU, expected one that ends in .fmu")
    if path.is_dir():
        raise InputError(f"{path}: a folder, expected the name of a file to write")
    if fmi not in {2, 3}:
        raise InputError(f"fmi is {fmi!r}, expected 2 or 3")
    if runtime not in {None, "c", "python"}:
        raise InputError(f"runtime is {runtime!r}, expected 'c' or 'python'")
    if not joint.name or not joint.name.isprintable():
        raise InputError(f"joint name is {joint.name!r}, expected printable characters for an FMU")
    parts_of(joint)


def _obstacle(joint: Joint) -> str:
    """What keeps the native FMU away, in half a sentence; empty if nothing does."""
    missing = without_kernel(joint)
    if missing:
        files = ", ".join(f"{kind.replace('-', '_')}.h" for kind in missing)
        return f"no C kernel for {', '.join(missing)} ({files} beside the module of the law)"
    if not can_compile():
        return "no C compiler here (cc, gcc, clang, or pip install 'jointlib[native]')"
    return ""


def _check_runtime(joint: Joint, fmi: int, runtime: str, by_default: bool) -> None:
    obstacle = _obstacle(joint)
    if runtime == "c" and without_kernel(joint):
        raise InputError(f"runtime is 'c', but there is {obstacle}; use runtime 'python'")
    if runtime == "python" and fmi == 3:
        sources = "" if without_kernel(joint) else "; runtime 'c' writes the sources alone"
        reason = f", and there is {obstacle}{sources}" if by_default else "; leave the runtime out or use 'c'"
        raise InputError(f"fmi is 3, which needs the native runtime{reason}")


def _named(joint: Joint, card: Card, reference: str) -> Card:
    """The card with the token, which is the hash of the content, and a name of its own that carries it."""
    nameless = replace(card, identifier=NAMELESS if card.runtime == "c" else NAMELESS_SLAVE)
    source = _source(joint, nameless)
    token = fingerprint(nameless.identifier, "", description_text(joint, nameless), source, reference)
    # Two FMUs in one process need libraries or modules of different names.
    word = re.sub(r"[^A-Za-z0-9]+", "_", joint.name).strip("_") or "joint"
    identifier = f"{word}_{token[:12]}"
    return replace(card, identifier=identifier if word[0].isalpha() else f"joint_{identifier}", token=token)


def _source(joint: Joint, card: Card) -> dict[str, str]:
    """The members with the FMU's own code, by their names."""
    if card.runtime == "c":
        return native_sources(joint, card.fmi, card.identifier, card.token)
    return {f"resources/{card.identifier}.py": slave_source(joint, card.identifier)}


def _native(joint: Joint, card: Card) -> dict[str, bytes]:
    members = native_members(_source(joint, card), card.fmi, card.identifier, compilers())
    return members | {"documentation/licenses/jointlib.txt": licence_of("jointlib").encode("utf-8")}


def _python(joint: Joint, card: Card) -> dict[str, bytes]:
    members = built_members(slave_source(joint, card.identifier), card.identifier)
    return members | {"documentation/licenses/pythonfmu.txt": licence_of("pythonfmu").encode("utf-8")}
