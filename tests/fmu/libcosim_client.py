"""One FMU in libcosim along given inputs; a process of its own, so that a crash stays there.

Reads a JSON request on standard input and writes the forces to the file named in it: libcosim prints its log.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimManipulator import CosimManipulator
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave


def forces(request: dict[str, Any]) -> list[float]:
    """The output after each step; steps are whole nanoseconds."""
    execution = CosimExecution.from_step_size(step_size=round(request["step"] * 1e9))
    slave = execution.add_local_slave(local_slave=CosimLocalSlave(fmu_path=request["file"], instance_name="joint"))
    inputs, observer = CosimManipulator.create_override(), CosimObserver.create_last_value()
    execution.add_manipulator(manipulator=inputs)
    execution.add_observer(observer=observer)
    out = []
    for values in request["values"]:
        inputs.slave_real_values(slave, request["inputs"], values)
        execution.step()
        out += observer.last_real_values(slave, request["outputs"])
    return out


if __name__ == "__main__":
    asked = json.load(sys.stdin)
    Path(asked["answer"]).write_text(json.dumps(forces(asked)), encoding="utf-8")
