"""Run a system of FMUs in FMPy; started as a process of its own, so that a crash stays there.

Reads a JSON request on standard input and writes the answer to the file named in it: the FMUs may print.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any


def replay(request: dict[str, Any]) -> dict[str, list[float]]:
    """Every connector's value at the end of every step."""
    from fmpy.ssp.simulation import simulate_ssp

    step = request["step"]
    inputs = {name: _held(values, step) for name, values in request["inputs"].items()}
    rows = simulate_ssp(request["file"], stop_time=(request["steps"] - 0.5) * step, step_size=step, input=inputs)
    return {name: rows[name].tolist() for name in rows.dtype.names}


def _held(values: list[float], step: float) -> Callable[[float], float]:
    return lambda time: values[round(time / step)]


if __name__ == "__main__":
    asked = json.load(sys.stdin)
    Path(asked["answer"]).write_text(json.dumps(replay(asked)), encoding="utf-8")
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    os._exit(0)  # pythonfmu's library reads its interpreter after it was freed, where a process ends in order
