"""What FMPy's solver makes of an FMU by model exchange, beside its own co-simulation."""

from __future__ import annotations

import tempfile
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from jointlib.errors import CheckFailed

from ..system.conditions import NAMES
from .fresh_process import answer_of
from .reference import SMALL, ReferenceRun, sizes, told_of

_TIME_LIMIT = 60.0
_RATES = {"m/s", "rad/s"}
_SAMPLES = 40
"""Of a reference run under forces, in a period of the sines."""


def exchanged(path: Path, folder: str, description: ElementTree.Element, run: ReferenceRun) -> tuple[float | None, str]:
    """How far model exchange is from co-simulation where every input is a sine as large as in the reference run, but
    conditions, which stay at their start values.

    Velocities are the rates of displacements: their ratio tells the period. Under forces it is forty samples.
    """
    if description.find("ModelExchange") is None:
        return None, "the FMU offers none"
    scalars = {s.get("name"): s for s in description.iterfind("ModelVariables/*")}
    given = {n: float(np.max(np.abs(x))) for n, x in zip(run.names, run.rows.T, strict=True)}
    given_ones = [name for name in run.names[1:] if scalars[name].get("causality") == "input"]
    inputs = [name for name in given_ones if name not in NAMES]
    outputs = [name for name in run.names[1:] if name not in given_ones]
    units = {name: told_of(scalars[name], "unit") for name in inputs}
    moved = max((given[name] for name in inputs if units[name] in {"m", "rad"}), default=0.0)
    speed = max((given[name] for name in inputs if units[name] in _RATES), default=0.0)
    step = float(np.min(np.diff(run.rows[:, 0])))
    request = {
        "folder": folder,
        "inputs": inputs,
        "sizes": [given[name] for name in inputs],
        "rates": [units[name] in _RATES for name in inputs],
        "outputs": outputs,
        "period": 2 * np.pi * moved / speed if moved and speed else _SAMPLES * step,
    }
    try:
        with tempfile.TemporaryDirectory(prefix="jointlib-") as scratch:
            where = f"{path}: the FMU"
            answer = answer_of("exchange", request, Path(scratch), where, _TIME_LIMIT, "run by model exchange")
    except CheckFailed as failed:
        return None, str(failed)
    if "said" in answer:
        return None, f"FMPy does not end it ({answer['said']})"
    stepped, solved = np.array(answer["stepped"]), np.array(answer["solved"])
    size = sizes(stepped, [told_of(scalars[name], "unit") for name in outputs], SMALL)
    # An output that follows an input at once has that of the interval's beginning in co-simulation.
    apart = [np.max(np.abs(a - b) / size, axis=0) for a, b in ((solved, stepped), (solved[:-1], stepped[1:]))]
    return float(np.max(np.minimum(*apart))), ""
