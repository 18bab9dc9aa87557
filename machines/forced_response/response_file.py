"""The file of a forced response: curves by drive, force and output."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from jointlib.io.atomic import write_npz

from .response import Response


def write_response(path: Path, results: Sequence[Response], band: dict[str, Any] | None = None) -> list[Path]:
    """Receptances per force, and every branch: ``frequency_0`` … (Hz), ``receptance_0`` … (m/N), ``branch_0_0_…``.

    Of a branch: motions of the joints and outputs (m), stability of the whole and of every point, estimated error of
    the first harmonic, outcome of every point, harmonics and, where there are several, the motions in
    the others; under a static load where the joints stand; where sliders stick what a force that they hold can
    change. A band adds ``band_frequency`` and ``band``, |G| in m/N as
    [force, share, line, output] at the shares ``band_share`` of the samples. What belongs to a second drive has the
    same names with ``drive_1_`` before them.
    """
    arrays: dict[str, Any] = {
        "force": np.array(results[0].force),
        "drive": np.array(results[0].drive),
        "outputs": np.array(results[0].outputs),
        "connections": np.array(results[0].connections),
    }
    for d, result in enumerate(results):
        own = _curves(result)
        arrays |= own if d == 0 else {f"drive_{d}_{name}": value for name, value in own.items()}
        arrays |= {f"drive_{d}": np.array(result.drive)} if d else {}
    if band is not None:
        arrays |= {"band_frequency": band["frequency"], "band": band["size"], "band_share": np.array(band["share"])}
    write_npz(path, arrays)
    return [path]


def _curves(result: Response) -> dict[str, Any]:
    """The arrays of one drive."""
    arrays: dict[str, Any] = {}
    for i, (frf, branches) in enumerate(zip(result.frfs, result.branches, strict=True)):
        arrays[f"frequency_{i}"], arrays[f"receptance_{i}"] = frf.frequency, frf.receptance[:, :, 0]
        for k, branch in enumerate(branches):
            arrays[f"branch_{i}_{k}_frequency"] = branch.frequency
            arrays[f"branch_{i}_{k}_joint"] = branch.joint
            arrays[f"branch_{i}_{k}_output"] = branch.output
            arrays[f"branch_{i}_{k}_stability"] = np.array(branch.stability.value)
            arrays[f"branch_{i}_{k}_labels"] = np.array([label.value for label in branch.labels])
            arrays[f"branch_{i}_{k}_outcomes"] = np.array([outcome.name.lower() for outcome in branch.outcomes])
            arrays[f"branch_{i}_{k}_error"] = branch.error
            if branch.held.size:
                arrays[f"branch_{i}_{k}_held"] = branch.held
            arrays[f"branch_{i}_{k}_harmonics"] = np.array(branch.harmonics)
            if len(branch.harmonics) > 1:
                arrays[f"branch_{i}_{k}_overtones"] = branch.overtones
            if branch.mean.size:
                arrays[f"branch_{i}_{k}_mean"] = branch.mean
    return arrays
