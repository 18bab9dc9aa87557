"""The same two masses in pyHarm (Safran's harmonic balance code), compared at its own points."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import machines
from machines import ArcLength, read_machine, response

PEER = Path(__file__).parents[1] / "benchmarks" / "peer_pyharm.py"
PYTHON = os.environ.get("PYHARM_PYTHON") or (sys.executable if importlib.util.find_spec("pyHarm") else None)
"""A Python that has pyharm-os, which pins older numerical packages and so may need a folder of its own."""


@pytest.mark.slow
@pytest.mark.skipif(PYTHON is None, reason="pyharm-os is not installed; set PYHARM_PYTHON to a Python that has it")
@pytest.mark.parametrize(("harmonics", "error"), [((1,), 1e-8), ((1, 3, 5), 1e-4)])
@pytest.mark.parametrize(("force", "band", "step"), [(50.0, (1240.0, 1260.0), 20.0), (75.0, (4900.0, 5300.0), 1.0)])
def test_pyharm_finds_the_same_curve(
    force: float, band: tuple[float, float], step: float, harmonics: tuple[int, ...], error: float
) -> None:
    assert PYTHON is not None
    names = ",".join(str(h) for h in harmonics)
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    call = [PYTHON, str(PEER), str(force), str(band[0]), str(band[1]), names, str(step)]
    answer = subprocess.run(call, env=environment, capture_output=True, text=True, check=True, timeout=300)
    peer = json.loads(answer.stdout.splitlines()[-1])
    frequency, theirs = np.array(peer["frequency"]), 1e-6 * (np.array(peer["real"]) + 1j * np.array(peer["imag"]))
    inside = (frequency > band[0] + 1e-6) & (frequency < band[1] - 1e-6)
    frequency, theirs = frequency[inside], theirs[inside]
    assert len(frequency) > 20
    machine = read_machine(Path(machines.__file__).parent / "library" / "two_mass.toml")
    found = response(machine, force, np.array(sorted(frequency)), method=ArcLength(), harmonics=harmonics)
    (branch,) = found.branches[0]
    assert branch.harmonics == harmonics
    ours = branch.joint[np.searchsorted(branch.frequency, frequency), 0]
    assert np.max(np.abs(ours - theirs)) < error * np.max(np.abs(theirs))
