"""Verification of an FMU: a valid description, and the reference run it carries repeated in FMPy."""

from __future__ import annotations

import csv
import re
import tempfile
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import CheckFailed, InputError

from .members.archive import read_archive, unpack
from .members.description import ANNOTATION, TOKEN, TOOL, fingerprint
from .members.native_members import BUILD, SOURCES
from .playback.fresh_process import answer_of
from .playback.model_exchange import exchanged
from .playback.reference import CSV, FOLDER, LOOSEST, MANIFEST, SMALL, STILL, ReferenceRun, read_csv, sizes, told_of
from .system.conditions import NAMES

TOLERANCE = 1e-12
"""Largest difference allowed, relative to the largest value of the run, where the FMU states none."""
_MANY = 400
"""Variables."""
_PIECE = r"(?:[A-Za-z_][A-Za-z0-9_]*|'(?:[^'\\]|\\.)+')(?:\[\d+(?:,\d+)*\])?"
_NAME = re.compile(rf"{_PIECE}(?:\.{_PIECE})*|der\({_PIECE}(?:\.{_PIECE})*(?:,\d+)?\)")
"""FMI's structured names."""
_TIME_LIMIT = 120.0


@dataclass(frozen=True)
class Verification:
    """What was checked, and how well the FMU repeats its reference run."""

    file: Path
    platforms: tuple[str, ...]
    max_step: float | None
    """Admissible co-simulation step in s as the FMU states it; None if it states none."""
    verified_with: tuple[str, ...]
    samples: int
    difference: float
    """Largest difference of an output from the reference, relative to its largest absolute value."""
    step_times: tuple[float, ...] = ()
    """What a step of the default experiment takes here in s, through FMPy; None where there is no such step."""
    exchange: float | None = None
    """How far FMPy's model exchange is from its co-simulation under smooth inputs, relative to the largest value of an
    output; None where it was not run or did not end."""
    exchange_said: str = ""
    """Why there is no such difference."""


@dataclass(frozen=True)
class _Content:
    """What an FMU says of itself."""

    description: ElementTree.Element
    fmi: int
    identifier: str
    token: str
    platforms: tuple[str, ...]
    run: ReferenceRun


def verify_fmu(path: Path | str, data: bytes | None = None, *, exchange: bool = False) -> Verification:
    """Validate an FMU for co-simulation (FMI 2.0 or 3.0) and replay its reference run in FMPy.

    With ``data`` those bytes are verified, before they become the file ``path``. With ``exchange`` an FMU that offers
    model exchange as well is run by both, which tells how well that client's solver takes it; that is no fault of the
    FMU and fails nothing. Raises InputError for a file that
    cannot be used, CheckFailed for an FMU that contradicts itself.
    """
    path = Path(path)
    members = read_archive(path, data)
    found = _content(path, members)
    _check_binary(path, found.platforms, found.fmi)
    with tempfile.TemporaryDirectory(prefix="jointlib-") as folder:
        unpack(path, members, Path(folder))
        _check_description(path, Path(folder))
        request: dict[str, object] = {
            "fmi": found.fmi,
            "guid": found.token,
            "identifier": found.identifier,
            "folder": folder,
        }
        if replayed := _stated(path, found, "replayTolerance"):
            request["tolerance"] = replayed
        allowed = _stated(path, found, "referenceTolerance") or TOLERANCE
        if allowed > LOOSEST:
            raise InputError(f"{path}: referenceTolerance is {allowed:g}, expected at most {LOOSEST:g}")
        difference, step_times = _replay(path, request, found.description, found.run, allowed)
        apart, said = exchanged(path, folder, found.description, found.run) if exchange else (None, "")
    limit = _stated(path, found, "maxStep")
    return Verification(
        path,
        found.platforms,
        limit,
        (f"FMPy {version('fmpy')}",),
        len(found.run.rows),
        difference,
        step_times,
        apart,
        said,
    )


def validate_fmu(path: Path | str, data: bytes | None = None) -> tuple[str, ...]:
    """All checks of :func:`verify_fmu` but the run, which needs a library for this computer; the FMU's platforms."""
    path = Path(path)
    members = read_archive(path, data)
    found = _content(path, members)
    with tempfile.TemporaryDirectory(prefix="jointlib-") as folder:
        unpack(path, members, Path(folder))
        _check_description(path, Path(folder))
    return found.platforms


def _content(path: Path, members: dict[str, bytes]) -> _Content:
    description = _xml(path, members, "modelDescription.xml")
    fmi = _version(path, description)
    identifier = _identifier(path, description)
    token = description.get(TOKEN[fmi], "")
    run = _reference(path, members)
    if description.get("generationTool", "").split(" ")[0] == TOOL:
        _check_fingerprint(path, members, identifier, fmi, token)
    if BUILD in members:  # FMPy reads it too
        _xml(path, members, BUILD)
    return _Content(description, fmi, identifier, token, _platforms(members, identifier), run)


def _stated(path: Path, found: _Content, key: str) -> float | None:
    """A positive number in our own annotation; None where there is none."""
    annotation = found.description.find(ANNOTATION[found.fmi])
    text = annotation.get(key) if annotation is not None else None
    if not text:
        return None
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value < float("inf"):
        raise InputError(f"{path}: {key} is {text!r}, expected a positive number")
    return value


def _xml(path: Path, members: dict[str, bytes], name: str) -> ElementTree.Element:
    """A document without a DOCTYPE: entities can neither expand without bound nor read other files."""
    if name not in members:
        raise InputError(f"{path}: no {name} in it, expected an FMU with a reference run")

    def refuse(*_: object) -> None:
        raise InputError(f"{path}: {name} declares a document type, expected plain XML without entities")

    try:
        scanner = expat.ParserCreate()
        scanner.StartDoctypeDeclHandler = refuse
        scanner.Parse(members[name], True)
        return ElementTree.fromstring(members[name])
    except (expat.ExpatError, ElementTree.ParseError, LookupError) as error:
        raise InputError(f"{path}: {name} is not well-formed XML ({error})") from None


def _version(path: Path, description: ElementTree.Element) -> int:
    found = description.get("fmiVersion", "none")
    if found != "2.0" and not re.match(r"3\.\d", found):
        raise InputError(f"{path}: FMI version {found}, expected 2.0 or 3.0")
    return int(found[0])


def _identifier(path: Path, description: ElementTree.Element) -> str:
    simulation = description.find("CoSimulation")
    if simulation is None:
        raise InputError(f"{path}: no co-simulation in it, expected an FMU for co-simulation")
    identifier = simulation.get("modelIdentifier", "")
    if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", identifier):
        raise InputError(f"{path}: modelIdentifier is {identifier!r}, expected a C identifier")
    return identifier


def _platforms(members: dict[str, bytes], identifier: str) -> tuple[str, ...]:
    found = (re.fullmatch(rf"binaries/([^/]+)/{identifier}\.(?:so|dll|dylib)", name) for name in members)
    return tuple(sorted({match[1] for match in found if match}))


def _check_binary(path: Path, platforms: tuple[str, ...], fmi: int) -> None:
    from fmpy import platform, platform_tuple

    here = platform if fmi == 2 else platform_tuple
    if here not in platforms:
        raise InputError(f"{path}: no binary for {here}, expected one ({', '.join(platforms) or 'none'} in it)")


def _reference(path: Path, members: dict[str, bytes]) -> ReferenceRun:
    manifest = _xml(path, members, MANIFEST)
    for related in manifest.iter("Related"):
        if related.get("type") == "text/csv" and related.get("role") == "result":
            name = f"{FOLDER}/{related.get('source', '')}"
            if name not in members:
                raise InputError(f"{path}: the manifest names {name}, which is not in the FMU")
            try:
                return read_csv(members[name].decode("utf-8", "replace"), f"{path}: {name}")
            except csv.Error as error:
                raise InputError(f"{path}: {name}: {error}, expected comma-separated values") from None
    raise InputError(f"{path}: the manifest names no CSV with role 'result', expected a reference run")


def _check_fingerprint(path: Path, members: dict[str, bytes], identifier: str, fmi: int, token: str) -> None:
    """The token of our own FMUs is the hash of description, source and reference run."""
    texts = {name: data.decode("utf-8", "replace") for name, data in members.items()}
    source = {
        name: text for name, text in texts.items() if name.startswith(SOURCES) or name == f"resources/{identifier}.py"
    }
    if fingerprint(identifier, token, texts["modelDescription.xml"], source, texts.get(f"{FOLDER}/{CSV}", "")) != token:
        raise CheckFailed(
            f"{path}: the {TOKEN[fmi]} does not belong to this content, the FMU was changed after its export"
        )


def _check_description(path: Path, folder: Path) -> None:
    """FMPy's checks; the names of very many variables are read by an expression, as its grammar takes 10 ms a name."""
    from fmpy import validation
    from fmpy.model_description import ValidationError, read_model_description

    listed = (folder / "modelDescription.xml").read_text(encoding="utf-8", errors="replace")
    if listed.count("valueReference=") <= _MANY:
        problems = validation.validate_fmu(str(folder))
    else:
        try:
            read = read_model_description(str(folder), validate=True, validate_model_structure=True)
            names = [str(v.name) for v in read.modelVariables]
            structured = read.variableNamingConvention == "structured"
            problems = [f'the name "{n}" is not structured' for n in names if structured and not _NAME.fullmatch(n)]
        except ValidationError as error:
            problems = error.problems
        except Exception as error:  # FMPy raises plain exceptions
            problems = [str(error)]
    if problems:
        more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
        raise CheckFailed(f"{path}: FMPy finds the description invalid: {' '.join(problems[0].split())}{more}")


def _replay(
    path: Path, model: dict[str, object], description: ElementTree.Element, run: ReferenceRun, tolerance: float
) -> tuple[float, tuple[float, ...]]:
    """Largest relative difference of the outputs, more than the tolerance fails the check; what a step takes in s."""
    scalars = {s.get("name"): s for s in description.iterfind("ModelVariables/*")}
    for name in run.names[1:]:
        if name not in scalars:
            raise InputError(f"{path}: the reference run has a column {name!r}, which is no variable of the FMU")
    column = {name: i for i, name in enumerate(run.names) if i}
    inputs = [name for name in column if scalars[name].get("causality") == "input"]
    outputs = [name for name in column if scalars[name].get("causality") != "input"]
    if not outputs:
        raise InputError(f"{path}: the reference run has no output, expected at least one")
    request = {
        **model,
        "inputs": [int(scalars[name].get("valueReference", "0")) for name in inputs],
        "outputs": [int(scalars[name].get("valueReference", "0")) for name in outputs],
        "time": run.rows[:, 0].tolist(),
        "values": run.rows[:, [column[name] for name in inputs]].tolist(),
    }
    experiment = description.find("DefaultExperiment")
    if experiment is not None and experiment.get("stepSize"):
        swung = [name for name in inputs if name not in NAMES]
        request["pace"] = {
            "step": float(experiment.get("stepSize", "nan")),
            "inputs": [int(scalars[name].get("valueReference", "0")) for name in swung],
            "sizes": [float(told_of(scalars[name], "nominal", "1")) for name in swung],
            "tolerances": [float(experiment.get("tolerance", "1e-6")), None],
        }
    (first, second), step_times = _run(path, request)
    if not np.array_equal(first, second):
        raise CheckFailed(f"{path}: after a reset the FMU does not repeat itself")
    expected = run.rows[:, [column[name] for name in outputs]]
    size = sizes(
        expected, [told_of(scalars[name], "unit") for name in outputs], STILL if "tolerance" in model else SMALL
    )
    difference = np.abs(first - expected) / size
    if not np.all(difference <= tolerance):
        row, place = np.unravel_index(np.argmax(np.nan_to_num(difference, nan=np.inf)), difference.shape)
        raise CheckFailed(
            f"{path}: {outputs[place]} at t = {run.rows[row, 0]:g} s is {float(first[row, place])!r}, the reference "
            f"has {float(expected[row, place])!r}, a difference of {difference[row, place]:.1e} of its largest value"
        )
    return float(np.max(difference)), step_times


def _run(path: Path, request: dict[str, object]) -> tuple[Array, tuple[float, ...]]:
    """Outputs of two runs in a fresh process, shape (2, samples, outputs), and what a step takes in s."""
    with tempfile.TemporaryDirectory(prefix="jointlib-") as scratch:
        where = f"{path}: the FMU"
        answer = answer_of("replay", request, Path(scratch), where, _TIME_LIMIT, "reference run")
        return np.array(answer["runs"]), tuple(answer["paces"])
