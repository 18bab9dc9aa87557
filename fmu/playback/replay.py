"""Run an unpacked FMU along given inputs in FMPy; started as a process of its own, so that a crash stays there.

Reads a JSON request on standard input and writes the answer to the file named in it: the FMU may print.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any


def replay(request: dict[str, Any]) -> list[list[list[float]]]:
    """Outputs row by row; the first row is initialization. Twice, with a reset between."""
    fmu = _instance(request)
    read, write = (fmu.getReal, fmu.setReal) if request["fmi"] == 2 else (fmu.getFloat64, fmu.setFloat64)
    runs = []
    for _ in range(2):
        if request["fmi"] == 2:
            fmu.setupExperiment(tolerance=request.get("tolerance"), startTime=request["time"][0])
            fmu.enterInitializationMode()
        else:
            fmu.enterInitializationMode(tolerance=request.get("tolerance"), startTime=request["time"][0])
        write(request["inputs"], request["values"][0])
        fmu.exitInitializationMode()
        rows = [list(read(request["outputs"]))]
        for i in range(1, len(request["time"])):
            start, end = request["time"][i - 1 : i + 1]
            write(request["inputs"], request["values"][i])
            fmu.doStep(start, end - start)
            rows.append(list(read(request["outputs"])))
        runs.append(rows)
        fmu.reset()
    fmu.freeInstance()
    return runs


def _instance(request: dict[str, Any]) -> Any:
    """An instance for co-simulation."""
    from fmpy.fmi2 import FMU2Slave
    from fmpy.fmi3 import FMU3Slave

    fmu = (FMU2Slave if request["fmi"] == 2 else FMU3Slave)(
        guid=request["guid"],
        modelIdentifier=request["identifier"],
        unzipDirectory=request["folder"],
        instanceName="replay",
    )
    fmu.instantiate(loggingOn=True)
    return fmu


if __name__ == "__main__":
    asked = json.load(sys.stdin)
    Path(asked["answer"]).write_text(json.dumps(replay(asked)), encoding="utf-8")
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    os._exit(0)  # pythonfmu's library reads its interpreter after it was freed, where a process ends in order
