"""Export of a joint as an FMU that has proved itself before it is handed over."""

from __future__ import annotations

import html
import re
from dataclasses import dataclass
from importlib.metadata import distribution
from pathlib import Path

from jointlib.errors import InputError
from jointlib.io import atomic
from jointlib.joint import Joint

from .archive import archive_bytes
from .description import description_text, fingerprint
from .python_slave import NAMELESS, built_members, slave_source
from .reference import CSV, FOLDER, MANIFEST, MANIFEST_TEXT, csv_text, reference_run
from .step_limit import Range, StepLimit, operating_range, step_limit
from .variables import parts_of
from .verify import verify_fmu


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


def export_fmu(joint: Joint, path: Path | str, *, fmi: int = 2, runtime: str = "python") -> Export:
    """Write a joint as an FMU for co-simulation: inputs displacement and velocity, output force.

    The inputs are held over a step. Before the file appears FMPy has validated it and repeated a run of the
    Python law within 1e-12 of the largest force.
    """
    path = Path(path)
    _check_request(joint, path, fmi, runtime)
    over = operating_range(joint)
    limit = step_limit(joint, over)
    messages = _messages(over, limit)
    run = reference_run(joint, over)
    reference, stop = csv_text(run), float(run.rows[-1, 0])

    def described(identifier: str, token: str) -> str:
        return description_text(
            joint, identifier=identifier, token=token, runtime=runtime, max_step=limit.max_step, stop_time=stop
        )

    token = fingerprint(described(NAMELESS, ""), slave_source(joint), reference)
    # Two FMUs in one process need modules of different names.
    identifier = f"{re.sub(r'[^A-Za-z0-9]+', '_', joint.name).strip('_') or 'joint'}_{token[:12]}"
    identifier = identifier if identifier[0].isalpha() else f"joint_{identifier}"
    members = built_members(slave_source(joint, identifier), identifier)
    members |= {
        "modelDescription.xml": described(identifier, token).encode("utf-8"),
        f"{FOLDER}/{CSV}": reference.encode("utf-8"),
        MANIFEST: MANIFEST_TEXT.encode("utf-8"),
        "documentation/index.html": _documentation(joint, messages).encode("utf-8"),
        "documentation/licenses/pythonfmu.txt": _pythonfmu_licence().encode("utf-8"),
    }
    data = archive_bytes(members)
    verified = verify_fmu(path, data)
    atomic.write(path, lambda file: file.write(data))
    return Export(path, verified.platforms, limit.max_step, verified.verified_with, runtime, messages)


def _check_request(joint: Joint, path: Path, fmi: int, runtime: str) -> None:
    if path.suffix != ".fmu":
        raise InputError(f"{path}: the file name of an FMU, expected one that ends in .fmu")
    if path.is_dir():
        raise InputError(f"{path}: a folder, expected the name of a file to write")
    if fmi == 3:
        raise InputError("fmi is 3, which is not in this version; use fmi 2")
    if fmi != 2:
        raise InputError(f"fmi is {fmi!r}, expected 2")
    if runtime == "c":
        raise InputError("runtime is 'c', and native C FMUs are not in this version; use runtime 'python'")
    if runtime != "python":
        raise InputError(f"runtime is {runtime!r}, expected 'python'")
    if not joint.name or not joint.name.isprintable():
        raise InputError(f"joint name is {joint.name!r}, expected printable characters for an FMU")
    parts_of(joint)


def _messages(over: Range, limit: StepLimit) -> tuple[str, ...]:
    spent = f"abs(z) up to {over.amplitude:g} m and abs(ż) up to {over.velocity:g} m/s"
    where = f"over the joint's validity, {spent}" if over.stated else f"for {spent}, as the joint states no full range"
    said = [
        "The FMU runs only in hosts that bring Python, such as FMPy; a host without Python cannot load it.",
        "Inputs are held over a step, and the force follows them at once.",
    ]
    if limit.max_step is not None:
        said += [
            f"Steps of {limit.max_step:.3g} s and more make an explicit co-simulation unstable: 2c/(3k) with "
            f"k = {limit.stiffness:.4g} N/m and c = {limit.damping:.4g} N s/m, {where}.",
            f"To keep the damping within 5 %, take at most {limit.max_step / 20:.3g} s, the default step in the FMU.",
        ]
    elif limit.stiffness > 0:
        said += [
            f"The joint's damping falls to {limit.damping:.4g} N s/m {where}: no explicit co-simulation step is safe; "
            "put mass and joint into one FMU container with a small inner step, or use model exchange, "
            "which comes with a later version."
        ]
    else:
        said += [f"The joint has no stiffness {where}, so it sets no limit to the co-simulation step by itself."]
    return tuple(said)


def _documentation(joint: Joint, messages: tuple[str, ...]) -> str:
    lines = [f"<p>{html.escape(text)}</p>" for text in messages]
    laws = ", ".join(law.kind for law in joint.laws)
    title = html.escape(f"Joint {joint.name}: {laws}")
    head = f'<!DOCTYPE html>\n<html lang="en">\n<head><meta charset="utf-8"><title>{title}</title></head>\n<body>\n'
    return head + "\n".join([f"<h1>{title}</h1>", *lines]) + "\n</body>\n</html>\n"


def _pythonfmu_licence() -> str:
    """The licence under which pythonfmu's files travel inside the FMU."""
    files = [file for file in distribution("pythonfmu").files or [] if file.name.upper().startswith("LICEN")]
    return files[0].read_text() if files else "pythonfmu: MIT licence, https://github.com/NTNU-IHB/PythonFMU\n"
