"""Long random motion with random parameters under the sanitizers: nothing but forces that the physics allows."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from fmpy import read_model_description
from host import label
from runtime_library import HEADERS, HERE, SANITIZED, compiled
from storm import EVERYTHING, JOINTS, plan
from tools import require

from fmu.export import export_fmu
from fmu.members.archive import read_archive, unpack
from jointlib.joint import Joint

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="loads Linux libraries")
OPTIONS = {"ASAN_OPTIONS": "quarantine_size_mb=1:thread_local_quarantine_size_kb=16"}
"""Little memory for freed blocks: it is full before a quarter of a run, and from then on only a leak grows."""


def storm(joint: Joint, lives: int, steps: int, folder: Path) -> None:
    """Compile the sources inside the FMU of a joint and drive it through some lives of random steps."""
    require("gcc")
    file = export_fmu(joint, folder / "a.fmu", runtime="c").file
    read = read_model_description(str(file))
    unpack(file, read_archive(file), folder / "a")
    sources = folder / "a" / "sources"
    # Neither of the two is part of "undefined".
    strict = ["-fsanitize=float-divide-by-zero,float-cast-overflow"]
    flags = [*SANITIZED, *strict, "-shared", "-fPIC", "-fvisibility=hidden"]
    library = compiled(f"{label(joint)}.so", [*flags, f"-I{sources}", sources / "all.c", "-lm"])
    host = compiled("storm", [*SANITIZED, "-Wno-unused-function", f"-I{HEADERS}", HERE / "storm_host.c", "-ldl", "-lm"])
    references = {str(v.name): int(v.valueReference) for v in read.modelVariables}
    continuous = [str(u.variable.derivative.name) for u in read.derivatives]
    request = plan(joint, references, continuous, int(read.numberOfEventIndicators), lives)
    done = subprocess.run(
        [str(host), str(library), read.guid, str(steps)], input=request, capture_output=True, text=True, env=OPTIONS
    )
    assert (done.returncode, done.stderr) == (0, ""), done.stdout + done.stderr
    made, moved, share, early, late = map(float, done.stdout.split())
    assert made == lives * steps
    assert moved > 0.5 * made
    assert share > 0.5  # the bounds are not empty words
    # Pages of 4 KiB. An instance and its saved state that are not freed take more than one in each life.
    assert late - early < 64


@pytest.mark.slow
def test_two_hundred_thousand_steps_with_all_laws_at_once_stay_within_the_physics(tmp_path: Path) -> None:
    storm(EVERYTHING, 200, 1000, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("joint", JOINTS, ids=label)
def test_ten_million_steps_over_all_laws_stay_within_the_physics(joint: Joint, tmp_path: Path) -> None:
    storm(joint, 400, -(-10_000_000 // (400 * len(JOINTS))), tmp_path)
