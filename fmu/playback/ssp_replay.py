"""Run a system of FMUs in FMPy; started as a process of its own, so that a crash stays there.

Reads a JSON request on standard input and writes the answer to the file named in it: the FMUs may print.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from .fresh_process import answering

SSD = "{http://ssp-standard.org/SSP1/SystemStructureDescription}"
CONNECTOR = f"{SSD}Connectors/{SSD}Connector"


def replay(request: dict[str, Any]) -> dict[str, list[float]]:
    """Every connector's value at the end of every step."""
    if request["fmi"] == 3:
        return stepped(request)
    from fmpy.ssp.simulation import simulate_ssp

    step = request["step"]
    inputs = {name: _held(values, step) for name, values in request["inputs"].items()}
    rows = simulate_ssp(request["file"], stop_time=(request["steps"] - 0.5) * step, step_size=step, input=inputs)
    return {name: rows[name].tolist() for name in rows.dtype.names}


def stepped(request: dict[str, Any]) -> dict[str, list[float]]:
    """A system of FMUs of FMI 3.0, stepped at once and then exchanging values, as FMPy does it for FMI 2.0."""
    import tempfile
    import zipfile

    from fmpy import read_model_description
    from fmpy.fmi3 import FMU3Slave

    with tempfile.TemporaryDirectory(prefix="jointlib-") as name:
        with zipfile.ZipFile(request["file"]) as archive:
            archive.extractall(name)
        system = ElementTree.parse(Path(name) / "SystemStructure.ssd").getroot().find(f"{SSD}System")
        assert system is not None
        values = {c.get("name", ""): 0.0 for c in system.iterfind(CONNECTOR)}
        elements = []
        for element in system.iterfind(f"{SSD}Elements/{SSD}Component"):
            own = element.get("name", "")
            folder = Path(name) / own
            with zipfile.ZipFile(Path(name) / element.get("source", "")) as archive:
                archive.extractall(folder)
            read = read_model_description(str(folder))
            place = {v.name: v.valueReference for v in read.modelVariables}
            ports = [
                (f"{own}.{c.get('name')}", c.get("kind"), place[c.get("name", "")]) for c in element.iterfind(CONNECTOR)
            ]
            fmu = FMU3Slave(
                guid=read.guid,
                modelIdentifier=read.coSimulation.modelIdentifier,
                unzipDirectory=str(folder),
                instanceName=own,
            )
            fmu.instantiate()
            fmu.enterInitializationMode(startTime=0.0)
            fmu.exitInitializationMode()
            values |= dict.fromkeys((path for path, *_ in ports), 0.0)
            elements.append((fmu, ports))
        wires = [
            (_end(wire, "start"), _end(wire, "end")) for wire in system.iterfind(f"{SSD}Connections/{SSD}Connection")
        ]
        rows: dict[str, list[float]] = {path: [] for path in values}
        for i in range(request["steps"]):
            values |= {path: given[i] for path, given in request["inputs"].items()}
            for fmu, ports in elements:
                taken, told = ([p for p in ports if p[1] == kind] for kind in ("input", "output"))
                fmu.setFloat64([p[2] for p in taken], [values[p[0]] for p in taken])
                fmu.doStep(i * request["step"], request["step"])
                values |= dict(zip((p[0] for p in told), fmu.getFloat64([p[2] for p in told]), strict=True))
            for start, end in wires:
                values[end] = values[start]
            for path, value in values.items():
                rows[path].append(float(value))
        return rows


def _end(wire: ElementTree.Element, side: str) -> str:
    element, connector = wire.get(f"{side}Element"), wire.get(f"{side}Connector", "")
    return f"{element}.{connector}" if element else connector


def _held(values: list[float], step: float) -> Callable[[float], float]:
    return lambda time: values[round(time / step)]


if __name__ == "__main__":
    answering(replay)
