"""Run an unpacked FMU along given inputs in FMPy; started as a process of its own, so that a crash stays there.

Reads a JSON request on standard input and writes the answer to the file named in it: the FMU may print.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any


def replay(request: dict[str, Any]) -> list[list[list[float]]]:
    """Outputs row by row; the first row is initialization. Twice, with a reset between."""
    from fmpy.fmi2 import FMU2Slave

    fmu = FMU2Slave(
        guid=request["guid"],
        modelIdentifier=request["identifier"],
        unzipDirectory=request["folder"],
        instanceName="replay",
    )
    fmu.instantiate(loggingOn=True)
    runs = []
    for _ in range(2):
        fmu.setupExperiment(startTime=request["time"][0])
        fmu.enterInitializationMode()
        fmu.setReal(request["inputs"], request["values"][0])
        fmu.exitInitializationMode()
        rows = [fmu.getReal(request["outputs"])]
        for i in range(1, len(request["time"])):
            start, end = request["time"][i - 1 : i + 1]
            fmu.setReal(request["inputs"], request["values"][i])
            fmu.doStep(start, end - start)
            rows.append(fmu.getReal(request["outputs"]))
        runs.append(rows)
        fmu.reset()
    fmu.freeInstance()
    return runs


if __name__ == "__main__":
    asked = json.load(sys.stdin)
    Path(asked["answer"]).write_text(json.dumps(replay(asked)), encoding="utf-8")
