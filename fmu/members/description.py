"""modelDescription.xml of an FMU in FMI 2.0 and 3.0, and the fingerprint that stands in it."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import metadata
from xml.etree import ElementTree

import numpy as np

from jointlib.errors import InputError
from jointlib.joint import Joint

from ..system.si_unit import base_unit
from ..system.system import System
from ..system.variables import Variable, variables_of
from .native import exchangeable, native_variables
from .structure import Structure, Unknown, native_structure, python_structure

TOOL = "jointlib"
VERSIONS = {2: "2.0", 3: "3.0"}
TOKEN = {2: "guid", 3: "instantiationToken"}
"""The attribute that names the FMU's content."""
ANNOTATION = {2: f"VendorAnnotations/Tool[@name='{TOOL}']/*", 3: f"Annotations/Annotation[@type='{TOOL}']/*"}
"""Where our own annotation stands."""
NAMELESS = "Joint"
"""Name of the model before the fingerprint of the content gives it its own."""
LOG_CATEGORIES = {
    "logStatusWarning": "the joint left the range on which it was identified",
    "logStatusError": "a call out of order, or a value that voids the joint",
}
_TOLERANCE = 1e-6
"""Of the default experiment, relative; what an importer's solver is told where its user says nothing."""
_MOST_STEPS = 5000
DISPLAYED = {"m": ("um", 1e6), "m/s": ("mm/s", 1e3), "N/m": ("N/um", 1e-6), "rad": ("deg", 180 / np.pi)}
"""Unit in which a value is shown, and how many of it one of SI is."""
VALIDITY_UNITS = {"amplitude": "m", "velocity": "m/s", "frequency": "Hz", "preload": "N"}
Element = ElementTree.Element


@dataclass(frozen=True)
class Card:
    """What the description says beside the variables."""

    identifier: str
    token: str
    runtime: str
    fmi: int
    max_step: float | None
    """Largest admissible co-simulation step in s."""
    stop_time: float
    sources: tuple[str, ...] = ()
    """Files to compile."""
    step: float | None = None
    """Step in s that the FMU proposes."""
    tolerance: float | None = None
    """How well the reference run repeats, relative to the largest value; None where that is to rounding."""
    replayed: float | None = None
    """Tolerance with which it is repeated; None where the FMU's own is asked for."""


def description_text(system: System, card: Card) -> str:
    """The model description."""
    native = card.runtime == "c"
    lone = system.lone
    every = variables_of(lone) if lone and not native else native_variables(system)
    # From 1, as some importers take 0 for none; pythonfmu numbers the variables of its FMUs itself, from 0.
    references = {v.name: i for i, v in enumerate(every, start=1 if native else 0)}
    # FMI 2.0 knows neither time nor event indicators as variables.
    variables = [v for v in every if card.fmi == 3 or v.kind not in {"time", "indicator"}]
    structure = python_structure(lone) if lone and not native else native_structure(system)
    # The structured convention knows one pair of brackets only, joints name table entries [i][j]; and ASCII only.
    structured = not system.flat and not any("][" in v.name or not v.name.isascii() for v in variables)
    root = Element(
        "fmiModelDescription",
        {
            "fmiVersion": VERSIONS[card.fmi],
            "modelName": system.name,
            TOKEN[card.fmi]: card.token,
            "description": system.title,
            **_made_by(system),
            "variableNamingConvention": "structured" if structured else "flat",
        },
    )
    exchange = native and exchangeable(system)
    if exchange and card.fmi == 2:
        root.set("numberOfEventIndicators", str(len(structure.indicators)))
    for kind in ("ModelExchange", "CoSimulation") if exchange else ("CoSimulation",):
        _interface(root, kind, card, system)
    _units(root, variables)
    if native:
        categories = ElementTree.SubElement(root, "LogCategories")
        for name, told in LOG_CATEGORIES.items():
            ElementTree.SubElement(categories, "Category", name=name, description=told)
    experiment = {"startTime": "0", "stopTime": repr(_stop(card)), "tolerance": repr(_TOLERANCE)}
    experiment |= {"stepSize": repr(card.step)} if card.step is not None else {}
    ElementTree.SubElement(root, "DefaultExperiment", experiment)
    if card.fmi == 2:
        annotations = ElementTree.SubElement(root, "VendorAnnotations")
        ElementTree.SubElement(annotations, "Tool", name=TOOL).append(_annotation(system, card))
    listed = ElementTree.SubElement(root, "ModelVariables")
    # FMI 2.0 counts variables from 1 in `derivative` and in the structure; value references are not always these.
    index = {v.name: str(references[v.name] if card.fmi == 3 else i) for i, v in enumerate(variables, start=1)}
    for variable in variables:
        listed.append((_scalar if card.fmi == 2 else _float64)(str(references[variable.name]), variable, index))
        listed[-1].set("name", system.shown(variable.name))
        if card.fmi == 3 and variable.kind == "input" and _inside(system, card):
            listed[-1].set("intermediateUpdate", "true")
    root.append((_structure2 if card.fmi == 2 else _structure3)(structure, index))
    if card.fmi == 3:
        annotations = ElementTree.SubElement(root, "Annotations")
        ElementTree.SubElement(annotations, "Annotation", type=TOOL).append(_annotation(system, card))
    return document(root)


def _made_by(system: System) -> dict[str, str]:
    """Who made it and under which licence; a date only where the user sets one, so that bytes repeat."""
    about = metadata(TOOL)
    told = {"version": about["Version"], "license": "BSD-3-Clause, texts in documentation/licenses"}
    told["generationTool"] = f"{TOOL} {about['Version']}"
    told["author"] = system.author
    if date := os.environ.get("SOURCE_DATE_EPOCH", ""):
        try:
            told["generationDateAndTime"] = datetime.fromtimestamp(int(date), UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
        except (ValueError, OverflowError, OSError):
            raise InputError(f"SOURCE_DATE_EPOCH is {date!r}, expected seconds since 1970") from None
    return {key: value for key, value in told.items() if value}


def _stop(card: Card) -> float:
    """End of the default experiment in s: the reference run, but no more steps than a table of results should hold."""
    return card.stop_time if card.step is None else min(card.stop_time, _MOST_STEPS * card.step)


def document(root: Element) -> str:
    """The XML file."""
    ElementTree.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _inside(system: System, card: Card) -> bool:
    """Co-simulation integrates a structure, and its inputs may go on within a step."""
    return bool(card.runtime == "c" and system.states)


def _interface(root: Element, kind: str, card: Card, system: System) -> None:
    steps = kind == "CoSimulation"
    native = card.runtime == "c"
    state, plural = ("state", "") if card.fmi == 2 else ("State", "s")
    attributes = {
        "modelIdentifier": card.identifier,
        "needsExecutionTool": "false" if native else "true",
        "canBeInstantiatedOnlyOncePerProcess": "false",
        f"canGetAndSetFMU{state}": "true",
        f"canSerializeFMU{state}": "true",
    }
    if native:
        attributes[f"providesDirectionalDerivative{plural}"] = "true"
    if card.fmi == 2:
        attributes["canNotUseMemoryManagementFunctions"] = "true"
    elif native:
        attributes["providesAdjointDerivatives"] = "true"
    if steps:
        attributes["canHandleVariableCommunicationStepSize"] = "true"
        if card.fmi == 2:
            attributes["canInterpolateInputs"] = "true" if _inside(system, card) else "false"
        elif _inside(system, card):
            attributes |= {"providesIntermediateUpdate": "true", "recommendedIntermediateInputSmoothness": "2"}
        if _inside(system, card):
            attributes["maxOutputDerivativeOrder"] = "1"
    elif not system.states and card.fmi == 2:
        attributes["completedIntegratorStepNotNeeded"] = "true"
    elif system.states and card.fmi == 3:  # FMI 2.0 takes that for granted
        attributes["needsCompletedIntegratorStep"] = "true"
    interface = ElementTree.SubElement(root, kind, attributes)
    if card.fmi == 2 and card.sources:
        files = ElementTree.SubElement(interface, "SourceFiles")
        for name in card.sources:
            ElementTree.SubElement(files, "File", name=name)


def _annotation(system: System, card: Card) -> Element:
    """What FMI has no place for: largest step, how well the reference run repeats, range and errors of each joint."""
    known = {"maxStep": card.max_step, "referenceTolerance": card.tolerance, "replayTolerance": card.replayed}
    attributes = {"runtime": card.runtime, **{key: repr(value) for key, value in known.items() if value is not None}}
    if system.lone:
        return _identified(Element("Joint", attributes), system.lone, system, "")
    root = Element("System", attributes)
    for prefix, joint in system.joints:
        _identified(ElementTree.SubElement(root, "Joint", {"name": prefix} if prefix else {}), joint, system, prefix)
    return root


def _identified(element: Element, joint: Joint, system: System, prefix: str) -> Element:
    """Range and standard errors of the identification."""
    for quantity, (low, high) in joint.validity.items():
        unit = system.unit(prefix, VALIDITY_UNITS.get(quantity, ""))
        attributes = {"quantity": quantity, "low": repr(float(low)), "high": repr(float(high))}
        ElementTree.SubElement(element, "Validity", {**attributes, **({"unit": unit} if unit else {})})
    units = joint.units
    for name in joint.covariance.names if joint.covariance else ():
        error = joint.covariance.standard_error(name) if joint.covariance else float("nan")
        if name in units and np.isfinite(error):
            attributes = {"name": name, "standardError": repr(float(error)), "unit": system.unit(prefix, units[name])}
            ElementTree.SubElement(element, "Parameter", attributes)
    return element


def _units(root: Element, variables: Sequence[Variable]) -> None:
    definitions = ElementTree.SubElement(root, "UnitDefinitions")
    for name in sorted({v.unit for v in variables if v.unit}):
        unit = ElementTree.SubElement(definitions, "Unit", name=name)
        base = base_unit(name)
        # A unit with a broken power has a name but, in FMI, no base units.
        if base is not None:
            ElementTree.SubElement(unit, "BaseUnit", base)
        if name in DISPLAYED:
            shown, factor = DISPLAYED[name]
            ElementTree.SubElement(unit, "DisplayUnit", name=shown, factor=repr(factor))


def _numbers(variable: Variable, index: Mapping[str, str]) -> dict[str, str]:
    numbers = {
        "min": variable.minimum,
        "max": variable.maximum,
        "nominal": variable.nominal,
        "start": variable.start,
    }
    attributes = {"unit": variable.unit} if variable.unit else {}
    attributes |= {"displayUnit": DISPLAYED[variable.unit][0]} if variable.unit in DISPLAYED else {}
    attributes |= {key: repr(float(x)) for key, x in numbers.items() if x is not None}
    return attributes | ({"derivative": index[variable.derivative_of]} if variable.derivative_of else {})


def _attributes(reference: str, variable: Variable) -> dict[str, str]:
    attributes = {
        "name": variable.name,
        "valueReference": reference,
        "description": variable.description,
        "causality": variable.causality,
        "variability": variable.variability,
    }
    return attributes | ({"initial": variable.initial} if variable.initial else {})


def _scalar(reference: str, variable: Variable, index: Mapping[str, str]) -> Element:
    scalar = Element("ScalarVariable", _attributes(reference, variable))
    ElementTree.SubElement(scalar, "Real", _numbers(variable, index))
    return scalar


def _float64(reference: str, variable: Variable, index: Mapping[str, str]) -> Element:
    return Element("Float64", _attributes(reference, variable) | _numbers(variable, index))


def _structure2(structure: Structure, index: Mapping[str, str]) -> Element:
    out = Element("ModelStructure")
    for name, unknowns in (
        ("Outputs", structure.outputs),
        ("Derivatives", structure.rates),
        ("InitialUnknowns", structure.initial),
    ):
        if unknowns:
            _list(ElementTree.SubElement(out, name), "Unknown", "index", unknowns, index)
    return out


def _structure3(structure: Structure, index: Mapping[str, str]) -> Element:
    out = Element("ModelStructure")
    for name, unknowns in (
        ("Output", structure.outputs),
        ("ContinuousStateDerivative", structure.rates),
        ("InitialUnknown", structure.initial),
        ("EventIndicator", structure.indicators),
    ):
        _list(out, name, "valueReference", unknowns, index)
    return out


def _list(parent: Element, tag: str, key: str, unknowns: Iterable[Unknown], index: Mapping[str, str]) -> None:
    for unknown in unknowns:
        known = " ".join(index[name] for name in unknown.depends_on)
        ElementTree.SubElement(parent, tag, {key: index[unknown.name], "dependencies": known})


def fingerprint(identifier: str, token: str, description: str, source: Mapping[str, str], reference: str) -> str:
    """Hash of what makes the FMU; the identifier and the token, which carry it, count as blank."""
    digest = hashlib.sha256()
    for text in (description, *(part for item in sorted(source.items()) for part in item), reference):
        blank = text.replace(token, "") if token else text
        data = blank.replace(identifier, NAMELESS).encode("utf-8")
        digest.update(len(data).to_bytes(8, "big") + data)
    return digest.hexdigest()
