"""joints.ssv: the parameters of the joints with their values, a set that hosts bind and engineers edit."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from xml.etree import ElementTree

from jointlib.errors import CheckFailed

from ..system.system import System, prefixed
from ..system.variables import variables_of
from .ssd import NAMESPACES, TOOL, VERSIONS, document, list_units, reals_of

SSV = "resources/joints.ssv"
_NAMESPACE = "http://ssp-standard.org/SSP1/SystemStructureParameterValues"
_KINDS = {2: "ssv:Real", 3: "ssv:Float64"}


def ssv_text(name: str, systems: Mapping[str, System], fmi: int = 2) -> str:
    """The XML document: every parameter of every joint in SI, as ``element.parameter`` (``guide.linear.stiffness``).

    The values are those that the FMUs start with. Of SSP 1.0, or 2.0 for FMI 3.0, whose numbers are Float64.
    """
    spaces = {"xmlns:ssv": _NAMESPACE, "xmlns:ssc": NAMESPACES["ssc"]}
    root = ElementTree.Element("ssv:ParameterSet", spaces | {"version": VERSIONS[fmi], "name": name})
    root.attrib["generationTool"] = TOOL
    listed, units = ElementTree.SubElement(root, "ssv:Parameters"), set()
    for element, system in systems.items():
        for prefix, joint in system.joints:
            for variable in variables_of(joint):
                if variable.kind != "parameter":
                    continue
                full = prefixed(element, prefixed(prefix, variable.name))
                entry = ElementTree.SubElement(listed, "ssv:Parameter", name=full)
                unit = system.unit(prefix, variable.unit)
                ElementTree.SubElement(entry, _KINDS[fmi], value=repr(variable.start), unit=unit)
                units.add(unit)
    list_units(ElementTree.SubElement(root, "ssv:Units"), units)
    return document(root)


def check_parameters(path: Path, members: Mapping[str, bytes]) -> None:
    """Read the set back: each of its parameters is one of the FMU that its name begins with, and starts at its value.

    ``path`` is the archive's name in messages.
    """
    starts = {
        f"{Path(member).stem}.{variable.get('name')}": float(real.get("start", "nan"))
        for member, data in members.items()
        if member.endswith(".fmu")
        for variable, real in reals_of(member, data)
        if variable.get("causality") == "parameter"
    }
    spaces = {"ssv": _NAMESPACE}
    for entry in ElementTree.fromstring(members[SSV]).iterfind("ssv:Parameters/ssv:Parameter", spaces):
        name, value = entry.get("name", ""), float(entry[0].get("value", "nan"))
        if starts.get(name) != value:
            raise CheckFailed(f"{path}: {SSV} has {name} = {value!r}, its FMU starts with {starts.get(name)!r}")
