"""SystemStructure.ssd of SSP 1.0, or 2.0 for FMI 3.0: written from elements and wires, checked against the FMUs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree import ElementTree

from jointlib.errors import CheckFailed

from ..members.archive import read_archive
from ..system.si_unit import base_unit

SSD = "SystemStructure.ssd"
INNER_SSD = "WithoutSystemConnectors.ssd"
"""The same without connectors of the system itself, for masters that know none (Ecos, libcosim)."""
TOOL = "jointlib"
NAMESPACES = {
    "ssc": "http://ssp-standard.org/SSP1/SystemStructureCommon",
    "ssd": "http://ssp-standard.org/SSP1/SystemStructureDescription",
    "oms": "https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd",
}
VERSIONS = {2: "1.0", 3: "2.0"}
"""Of SSP, by the version of FMI."""
TYPES = {2: "ssc:Real", 3: "ssc:Float64"}
MASTER = "master"
"""Name of the solver that steps the FMUs."""
End = tuple[str | None, str]
"""Element and connector; the element is None on the system itself."""


@dataclass(frozen=True)
class Connector:
    """A signal that an element takes in or gives out; the unit is one of SI."""

    name: str
    kind: str
    """``input`` or ``output``."""
    unit: str
    description: str = ""


@dataclass(frozen=True)
class Element:
    """An FMU in its place."""

    name: str
    source: str
    """Its path in the archive."""
    connectors: tuple[Connector, ...]
    description: str = ""


@dataclass(frozen=True)
class Structure:
    """A system of FMUs without systems in it."""

    name: str
    connectors: tuple[Connector, ...]
    elements: tuple[Element, ...]
    """In the order in which a sequential master steps them."""
    wires: tuple[tuple[End, End], ...]
    """From where a value comes to where it goes."""
    parameters: str = ""
    """Path in the archive of the parameter set that is bound to it."""
    author: str = ""


def inner(structure: Structure) -> Structure:
    """The structure without connectors of the system: what came from outside stays at its start value."""
    wires = tuple((start, end) for start, end in structure.wires if start[0] is not None and end[0] is not None)
    return replace(structure, name=f"{structure.name}_without_connectors", connectors=(), wires=wires)


def ssd_text(
    structure: Structure, coupling: Mapping[str, str], step: float | None, stop_time: float, fmi: int = 2
) -> str:
    """The XML document; ``coupling`` becomes the attributes of an annotation of type jointlib.

    SSP has no place for a communication step, its default experiment states times only. OMSimulator looks for one in
    annotations of its own, the Python interface of its version 3 in the attributes of what its version 2 reads as
    child; that gets ``step`` (s). Signals are Real in SSP 1.0; those of FMI 3.0 are Float64, which SSP 2.0 brought.
    """
    root = ElementTree.Element("ssd:SystemStructureDescription", {f"xmlns:{k}": v for k, v in NAMESPACES.items()})
    root.attrib |= {"version": VERSIONS[fmi], "name": structure.name, "generationTool": TOOL}
    root.attrib |= {"author": structure.author} if structure.author else {}
    system = ElementTree.SubElement(root, "ssd:System", name=structure.name)
    _connectors(system, structure.connectors, fmi)
    if structure.parameters:
        bindings = ElementTree.SubElement(system, "ssd:ParameterBindings")
        ElementTree.SubElement(bindings, "ssd:ParameterBinding", source=structure.parameters)
    elements = ElementTree.SubElement(system, "ssd:Elements")
    for element in structure.elements:
        attributes = {"name": element.name, "type": "application/x-fmu-sharedlibrary", "source": element.source}
        attributes |= {"implementation": "CoSimulation"}
        attributes |= {"description": element.description} if element.description else {}
        component = ElementTree.SubElement(elements, "ssd:Component", attributes)
        _connectors(component, element.connectors, fmi)
        if step is not None:
            _master(component, {"name": MASTER})
    wires = ElementTree.SubElement(system, "ssd:Connections")
    for start, end in structure.wires:
        attributes = {}
        for side, (name, connector) in (("start", start), ("end", end)):
            attributes |= ({f"{side}Element": name} if name is not None else {}) | {f"{side}Connector": connector}
        ElementTree.SubElement(wires, "ssd:Connection", attributes)
    if step is not None:
        told = {"name": MASTER, "method": "oms_ma", "fixedStepSize": repr(step), "stepSize": repr(step)}
        master = {"description": "oms-ma", "stepSize": repr(step)}
        tolerance = {"absoluteTolerance": "1e-4", "relativeTolerance": "1e-4"}
        ElementTree.SubElement(_master(system, told | tolerance), "oms:FixedStepMaster", master | tolerance)
    every = [*structure.connectors, *(c for e in structure.elements for c in e.connectors)]
    list_units(ElementTree.SubElement(root, "ssd:Units"), {connector.unit for connector in every})
    ElementTree.SubElement(root, "ssd:DefaultExperiment", startTime="0", stopTime=repr(stop_time))
    ElementTree.SubElement(_annotation(root, TOOL), "Coupling", dict(coupling))
    return document(root)


def list_units(parent: ElementTree.Element, names: Iterable[str]) -> None:
    """Units of SI by what they are made of."""
    for name in sorted(names):
        unit = ElementTree.SubElement(parent, "ssc:Unit", name=name)
        ElementTree.SubElement(unit, "ssc:BaseUnit", base_unit(name) or {})


def document(root: ElementTree.Element) -> str:
    """An element as an XML document, indented."""
    ElementTree.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _master(parent: ElementTree.Element, told: Mapping[str, str]) -> ElementTree.Element:
    """What OMSimulator reads of a solver: its settings at the system, its name at each element that it steps."""
    noted = ElementTree.SubElement(_annotation(parent, "org.openmodelica"), "oms:Annotations")
    return ElementTree.SubElement(noted, "oms:SimulationInformation", dict(told))


def _annotation(parent: ElementTree.Element, kind: str) -> ElementTree.Element:
    return ElementTree.SubElement(ElementTree.SubElement(parent, "ssd:Annotations"), "ssc:Annotation", type=kind)


def _connectors(parent: ElementTree.Element, connectors: tuple[Connector, ...], fmi: int) -> None:
    if not connectors:
        return
    listed = ElementTree.SubElement(parent, "ssd:Connectors")
    for connector in connectors:
        told = {"description": connector.description} if connector.description else {}
        entry = ElementTree.SubElement(
            listed, "ssd:Connector", {"name": connector.name, "kind": connector.kind, **told}
        )
        ElementTree.SubElement(entry, TYPES[fmi], unit=connector.unit)


def check_structure(path: Path, members: Mapping[str, bytes]) -> None:
    """Read the document back and compare it with the FMUs beside it; ``path`` is the archive's name in messages.

    Every connector is a variable of its FMU with the same causality and unit; every wire leads from what gives a
    value to what takes it, unit to unit; every input of an FMU and every output of the system has one source.
    """
    root = ElementTree.fromstring(members[SSD])
    system = root.find("ssd:System", NAMESPACES)
    assert system is not None
    found = _read(system)
    for component in system.iterfind("ssd:Elements/ssd:Component", NAMESPACES):
        own = component.get("name", "")
        variables = _variables(path, component.get("source", ""), members)
        for (_, connector), kind in _read(component).items():
            if variables.get(connector) != kind:
                raise CheckFailed(
                    f"{path}: connector {own}.{connector} is {' in '.join(kind)}, "
                    f"the FMU has {' in '.join(variables[connector]) if connector in variables else 'no such variable'}"
                )
            found[own, connector] = kind
        for name, (causality, _) in variables.items():
            if causality == "input" and (own, name) not in found:
                raise CheckFailed(f"{path}: input {name} of the FMU {own} has no connector")
    sources: Counter[End] = Counter()
    for wire in system.iterfind("ssd:Connections/ssd:Connection", NAMESPACES):
        start = wire.get("startElement"), wire.get("startConnector", "")
        end = wire.get("endElement"), wire.get("endConnector", "")
        text = " -> ".join(".".join(filter(None, side)) for side in (start, end))
        for side in (start, end):
            if side not in found:
                raise CheckFailed(f"{path}: connection {text} has an end that does not exist")
        # Seen from inside, the system's inputs give values and its outputs take them.
        if found[start][0] != _gives(start) or found[end][0] == _gives(end) or found[start][1] != found[end][1]:
            raise CheckFailed(f"{path}: connection {text} joins {found[start]} with {found[end]}")
        sources[end] += 1
    for side, (causality, _) in found.items():
        if causality != _gives(side) and sources[side] != 1:
            raise CheckFailed(f"{path}: {'.'.join(filter(None, side))} has {sources[side]} sources, expected one")


def _gives(end: End) -> str:
    return "input" if end[0] is None else "output"


def _read(element: ElementTree.Element) -> dict[End, tuple[str, str]]:
    """Kind and unit of the connectors of an element."""
    found: dict[End, tuple[str, str]] = {}
    for connector in element.iterfind("ssd:Connectors/ssd:Connector", NAMESPACES):
        real = next((x for x in (connector.find(kind, NAMESPACES) for kind in TYPES.values()) if x is not None), None)
        unit = real.get("unit", "") if real is not None else ""
        found[None, connector.get("name", "")] = connector.get("kind", ""), unit
    return found


def _variables(path: Path, source: str, members: Mapping[str, bytes]) -> dict[str, tuple[str, str]]:
    """Causality and unit of the inputs and outputs of an FMU."""
    if source not in members:
        raise CheckFailed(f"{path}: {source} is not in the archive")
    return {
        variable.get("name", ""): (variable.get("causality", ""), real.get("unit", ""))
        for variable, real in reals_of(source, members[source])
        if variable.get("causality") in {"input", "output"}
    }


def reals_of(source: str, data: bytes) -> list[tuple[ElementTree.Element, ElementTree.Element]]:
    """The variables of an FMU that are numbers, each with the element that holds its unit and its start."""
    description = ElementTree.fromstring(read_archive(Path(source), data)["modelDescription.xml"])
    found = ((v, v if v.tag == "Float64" else v.find("Real")) for v in description.iterfind("ModelVariables/*"))
    return [(variable, real) for variable, real in found if real is not None]
