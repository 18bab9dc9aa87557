"""Measured frequency responses against a machine, for programs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..model.machine import Machine
from .comparison import Comparison, compared, depths

_SPEEDS = 40


def over_measured(machine: Machine, files: Sequence[Path]) -> tuple[list[Comparison], dict[str, Any]]:
    """Measured frequency responses against the machine, and what is told of them as JSON: ``measured``, ``depth``."""
    laid = [comparison for file in files for comparison in compared(machine, file)]
    data: dict[str, Any] = {
        "measured": [
            {
                "record": c.record.name,
                "drive": c.record.drive,
                "output": c.record.response,
                "force": c.record.force,
                "frac": c.frac,
                "resonances": [
                    {
                        "measured": None if pair.measured is None else vars(pair.measured),
                        "predicted": None if pair.predicted is None else vars(pair.predicted),
                        "differences": pair.differences(),
                    }
                    for pair in c.pairs
                ],
                "sentence": c.sentence(),
                "warnings": list(c.warnings),
            }
            for c in laid
        ]
    }
    if machine.cutting is not None and machine.cutting.get("speed") is not None:
        low, high = machine.cutting["speed"]
        found = depths(machine, [c.record for c in laid], np.linspace(low, high, _SPEEDS))
        data["depth"] = None if found is None else vars(found) | {"sentence": found.sentence()}
    return laid, data
