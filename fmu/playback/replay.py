"""Run an unpacked FMU along given inputs in FMPy; started as a process of its own, so that a crash stays there.

Reads a JSON request on standard input and writes the answer to the file named in it: the FMU may print.
"""

from __future__ import annotations

import math
import time
from typing import Any

from .fresh_process import answering

MOST, LONGEST, BATCH = 2000, 0.5, 50
"""Steps, and seconds, that a look at the pace takes at most; steps in a batch."""


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


def paces(request: dict[str, Any]) -> list[float]:
    """Processor time of a communication step in s at each of the tolerances that are asked about, None for none."""
    return [_pace(request, tolerance) for tolerance in request.get("pace", {}).get("tolerances", [])]


def _pace(request: dict[str, Any], tolerance: float | None) -> float:
    """The least mean of some batches of steps under inputs that change."""
    fmu = _instance(request)
    if request["fmi"] == 2:
        fmu.setupExperiment(tolerance=tolerance, startTime=0.0)
        fmu.enterInitializationMode()
    else:
        fmu.enterInitializationMode(tolerance=tolerance, startTime=0.0)
    fmu.exitInitializationMode()
    write = fmu.setReal if request["fmi"] == 2 else fmu.setFloat64
    step, sizes = request["pace"]["step"], request["pace"]["sizes"]
    best, done, begun = math.inf, 0, time.process_time()
    while done < MOST and (done < 2 * BATCH or time.process_time() - begun < LONGEST):
        taken = 0.0
        for i in range(done, done + BATCH):
            write(request["pace"]["inputs"], [math.sin(0.15 * i) * size for size in sizes])
            before = time.process_time()
            fmu.doStep(i * step, step)
            taken += time.process_time() - before
        done += BATCH
        best = min(best, taken / BATCH)
    fmu.freeInstance()
    return best


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
    answering(lambda asked: {"runs": replay(asked), "paces": paces(asked)})
