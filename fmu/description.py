"""modelDescription.xml of an FMI 2.0 co-simulation FMU, and the fingerprint that stands in it."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from xml.etree import ElementTree

from jointlib.joint import Joint

from .si_unit import exponents
from .variables import Variable, direct_inputs, variables_of

TOOL = "jointlib"


def description_text(
    joint: Joint, *, identifier: str, token: str, runtime: str, max_step: float | None, stop_time: float
) -> str:
    """The model description; ``token`` is FMI's guid."""
    variables = variables_of(joint)
    structured = not any("][" in v.name for v in variables)
    root = ElementTree.Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=joint.name,
        guid=token,
        description=f"Restoring force of the joint {joint.name}: " + " + ".join(law.kind for law in joint.laws),
        generationTool=TOOL,
        # The structured convention knows one pair of brackets only, joints name table entries [i][j].
        variableNamingConvention="structured" if structured else "flat",
    )
    ElementTree.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=identifier,
        needsExecutionTool="true" if runtime == "python" else "false",
        canHandleVariableCommunicationStepSize="true",
        canInterpolateInputs="false",
        canBeInstantiatedOnlyOncePerProcess="false",
        canNotUseMemoryManagementFunctions="true",
        canGetAndSetFMUstate="true",
        canSerializeFMUstate="true",
    )
    _units(root, variables)
    if max_step is not None:
        experiment = {"startTime": "0", "stopTime": repr(stop_time), "stepSize": repr(max_step / 20)}
        ElementTree.SubElement(root, "DefaultExperiment", experiment)
    annotations = ElementTree.SubElement(root, "VendorAnnotations")
    tool = ElementTree.SubElement(annotations, "Tool", name=TOOL)
    ElementTree.SubElement(
        tool, "Joint", {"runtime": runtime, **({} if max_step is None else {"maxStep": repr(max_step)})}
    )
    listed = ElementTree.SubElement(root, "ModelVariables")
    for reference, variable in enumerate(variables):
        listed.append(_scalar(reference, variable))
    _structure(root, joint, variables)
    ElementTree.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _units(root: ElementTree.Element, variables: Sequence[Variable]) -> None:
    definitions = ElementTree.SubElement(root, "UnitDefinitions")
    for name in sorted({v.unit for v in variables}):
        unit = ElementTree.SubElement(definitions, "Unit", name=name)
        powers = exponents(name)
        # A unit with a broken power has a name but, in FMI 2, no base units.
        if powers is not None:
            ElementTree.SubElement(unit, "BaseUnit", {base: str(power) for base, power in powers.items()})


def _scalar(reference: int, variable: Variable) -> ElementTree.Element:
    attributes = {
        "name": variable.name,
        "valueReference": str(reference),
        "description": variable.description,
        "causality": variable.causality,
        "variability": variable.variability,
    }
    if variable.initial is not None:
        attributes["initial"] = variable.initial
    scalar = ElementTree.Element("ScalarVariable", attributes)
    numbers = {"min": variable.minimum, "max": variable.maximum, "start": variable.start}
    real = {"unit": variable.unit, **{key: repr(float(x)) for key, x in numbers.items() if x is not None}}
    ElementTree.SubElement(scalar, "Real", real)
    return scalar


def _structure(root: ElementTree.Element, joint: Joint, variables: Sequence[Variable]) -> None:
    """FMI 2 counts variables from 1 here; value references count from 0."""
    index = {v.name: str(i) for i, v in enumerate(variables, start=1)}
    inputs = direct_inputs(joint)
    structure = ElementTree.SubElement(root, "ModelStructure")
    force = {"index": index["force"], "dependencies": " ".join(index[name] for name in inputs)}
    ElementTree.SubElement(ElementTree.SubElement(structure, "Outputs"), "Unknown", force)
    known = [*inputs, *(v.name for v in variables if v.causality == "parameter")]
    first = {"index": index["force"], "dependencies": " ".join(index[name] for name in known)}
    ElementTree.SubElement(ElementTree.SubElement(structure, "InitialUnknowns"), "Unknown", first)


def fingerprint(description: str, source: str, reference: str) -> str:
    """Hash of what makes the FMU; the names that carry it are blank in the description and the source."""
    digest = hashlib.sha256()
    for text in (description, source, reference):
        data = text.encode("utf-8")
        digest.update(len(data).to_bytes(8, "big") + data)
    return digest.hexdigest()
