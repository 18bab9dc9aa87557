"""``jointlib study run`` killed at random moments, as by a batch queue: in the end nothing tells that it was."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

STUDY = """
schema = "jointlib/study/1"
base = "machines/library/two_mode_tool.toml"
factor = [
    { name = "immersion", path = "cutting.immersion", range = [0.2, 0.8] },
    { name = "damping", path = "component.cutter.damping_ratio[0]", range = [0.02, 0.06] },
]
conditions = { speeds = 40 }
objective = [{ quantity = "minimum-depth", goal = "max" }]
sampling = { method = "latin-hypercube", count = 12000 }
"""
KILLS = 20


def shards(folder: str) -> set[str]:
    return {path.name for path in Path(folder, "shards").glob("*.npz")}


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="SIGKILL is one of POSIX systems")
def test_twenty_kills_at_random_moments_leave_the_bytes_of_an_undisturbed_run(here: Path) -> None:
    Path("s.study.toml").write_text(STUDY)
    command = [str(Path(sys.executable).with_name("jointlib")), "study", "run", "s.study.toml", "-o"]
    start = time.monotonic()
    process = subprocess.Popen([*command, "whole", "--workers", "2"], stdout=subprocess.DEVNULL)
    while not shards("whole"):
        time.sleep(0.01)
    first = time.monotonic() - start
    assert process.wait() == 0
    rng, killed, done = np.random.default_rng(7), 0, set[str]()
    while killed < KILLS:
        process = subprocess.Popen([*command, "killed", "--workers", "2"], stdout=subprocess.DEVNULL)
        time.sleep(first * rng.uniform(0.1, 2.0))
        process.send_signal(signal.SIGKILL)
        assert process.wait() == -signal.SIGKILL, "the study was through before it was killed often enough"
        killed += 1
        now = shards("killed")
        assert done <= now, "a shard was lost"
        done = now
    assert done
    subprocess.run([*command[:2], "resume", *command[3:], "killed", "--workers", "2"], check=True, capture_output=True)
    for name in ("results.npz", "study.json"):
        assert Path("killed", name).read_bytes() == Path("whole", name).read_bytes()
