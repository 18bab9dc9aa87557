"""How soon the explorer answers each slider of guide_mill, beside the commands that show the same. Run it as a script.

    OPENBLAS_NUM_THREADS=1 python tests/benchmarks/bench_explore.py

Every answer is a setting never asked for before: receptance, describing functions and lobes, computed warm. The
commands `jointlib lobes` and `jointlib frf` start anew, as for somebody who edits the file and calls them.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage

import numpy as np

from machines import read_machine
from machines.explore import AMPLITUDE, Control, Explorer
from machines.road.open_joints import with_joints

MILL = Path(__file__).parents[2] / "machines" / "library" / "guide_mill.toml"
LIMIT = 0.3
TRIES = 9


def timed(function: Callable[[], object]) -> tuple[float, float]:
    """Seconds on the clock, and of processor time."""
    clock, work = time.perf_counter(), time.process_time()
    function()
    return time.perf_counter() - clock, time.process_time() - work


def places(control: Control) -> Iterator[float]:
    """Values over the whole slider, none of them that of the file."""
    share = (np.arange(TRIES) + 0.37) / TRIES
    low, high = control.low, control.high
    values = low * (high / low) ** share if control.logarithmic else low + (high - low) * share
    if control.whole:
        yield from (n for n in np.arange(low, high + 1) if n != control.value)
    else:
        yield from values


def answers(explorer: Explorer, control: Control, others: dict[str, float]) -> np.ndarray:
    """Seconds on the clock and of processor time for every place of a slider."""
    return np.array([timed(lambda v=v: explorer.curves({**others, control.key: v})) for v in places(control)])


def command(*words: str) -> tuple[float, float]:
    """Seconds on the clock, and of processor time, of one call from the command line."""
    before, clock = getrusage(RUSAGE_CHILDREN), time.perf_counter()
    run = [sys.executable, "-c", "from jointlib.cli.main import main; main()", *words]
    subprocess.run(run, check=True, stdout=subprocess.DEVNULL)
    after = getrusage(RUSAGE_CHILDREN)
    work = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return time.perf_counter() - clock, work


def main() -> None:
    machine, _ = with_joints(read_machine(MILL))
    joints = {c.name: c.joint for c in machine.flexible if c.joint is not None}
    print(f"start without identification: {timed(lambda: Explorer(MILL, joints=joints).controls)[0]:.2f} s")
    explorer = Explorer(MILL, joints=joints)
    explorer.curves({AMPLITUDE: 1.0})
    with tempfile.TemporaryDirectory() as folder:
        saved = str(explorer.save({}, Path(folder), "saved")[0])
        exact = command("lobes", saved, "--amplitude", "0")
        preview = command("lobes", saved, "--amplitude", "0", "--method", "zero-order")
        response = command("frf", saved, "-o", f"{folder}/frf.npz")
    for name, (clock, work) in (("lobes", exact), ("lobes, zero order", preview), ("frf", response)):
        print(f"jointlib {name}: {clock:.2f} s, {work:.2f} s of processor time")
    full, same = exact[1] + response[1], preview[1] + response[1]
    print("slider, tool at rest and at 10 µm: processor time and clock, largest of all places [ms]; times faster than")
    print("the commands by their own method, and by the same method (zero order)")
    worst = 0.0
    for control in explorer.controls:
        label = f"{control.group}, {control.label}"
        for others in ({}, {AMPLITUDE: 10.0}) if control.key != AMPLITUDE else ({},):
            clock, work = np.max(answers(explorer, control, others), axis=0)
            worst = max(worst, work)
            at = " at 10 µm" if others else ""
            print(f"{label + at:42s} {1e3 * work:6.0f} {1e3 * clock:6.0f} {full / work:7.0f} {same / work:7.0f}")
    said = "holds" if worst <= LIMIT else "IS EXCEEDED"
    print(f"slowest {1e3 * worst:.0f} ms of processor time: the limit of {1e3 * LIMIT:.0f} ms {said}")
    clock, work = timed(lambda: explorer.at({AMPLITUDE: 3.3}, 6100.0))
    print(f"a click: {timed(lambda: explorer.at({}, 6100.0))[1]:.3f} s at rest, {work:.3f} s at an amplitude")


if __name__ == "__main__":
    main()
