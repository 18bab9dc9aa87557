"""Where an identified joint comes from and how far it holds."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np

from jointlib.identification.integration import frequencies
from jointlib.identification.records import FitRecords
from jointlib.io.atomic import sha256


def validity(tests: Sequence[FitRecords]) -> dict[str, tuple[float, float]]:
    """Amplitude (m) that every test reaches, largest velocity (m/s), band of the lines used (Hz)."""
    reach = [max(float(np.ptp(b.z)) / 2 for b in t.balances) for t in tests]
    out = {"amplitude": (0.0, min(reach))}
    speed = max(float(np.max(np.abs(b.v))) for t in tests for b in t.balances)
    if speed > 0:
        out["velocity"] = (0.0, speed)
    surfaces = [s for t in tests for s in t.surfaces]
    if surfaces:
        lines = [frequencies(len(s.z) + 2 * s.margin, s.sample_rate)[s.gain > 0.5] for s in surfaces]
        out["frequency"] = (min(float(f[0]) for f in lines), max(float(f[-1]) for f in lines))
    return out


def provenance(tests: Sequence[FitRecords]) -> dict[str, Any]:
    """Program version and the hash of every file that was read; records of one file are named once."""
    try:
        program = f"jointlib {version('jointlib')}"
    except PackageNotFoundError:
        program = "jointlib"
    files: dict[str, str] = {}
    for test in tests:
        source = test.measurement.source
        if source.is_file():
            files[source.name] = sha256(source)
        files.update({record.source.file.name: record.sha256 for record in test.records})
    simulated = any(t.measurement.simulated for t in tests)
    listed = [{"file": name, "sha256": digest} for name, digest in files.items()]
    return {"program": program, "simulated": simulated, "files": listed}
