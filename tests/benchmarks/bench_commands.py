"""Verbs as a user types them, each a process: seconds on the clock and of the processor, memory, and where they went.

    python tests/benchmarks/bench_commands.py [--beside OTHER/bin/python] [--only WORD] [--runs 2]
        [--pages docs/times.md]

Machines are those of the library, a chain of 50 masses with 5 nonlinear joints, and the mill that `jointlib new`
writes. With the Python of another installation every command runs there as well, in turn, and the ratios of both times
are told. With --pages the table is put into a page, between the lines that mark its place. Shares are of the clock,
from one more run that is looked at every few milliseconds: start-up is the interpreter and everything that is
imported, wherever that happens.
"""

from __future__ import annotations

import argparse
import os
import platform
import resource
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

LIBRARY = Path(__file__).parents[2] / "machines" / "library"
COMMANDS = (
    "--help",
    "inspect {library}/two_mode_tool.toml",
    "modes {library}/two_mode_tool.toml",
    "new machine -o {out}.toml",
    "laws",
    "doctor",
    "import {library}/guide_mill/static.csv -o {out}.measurement.toml",
    "estimate {library}/tap_test/hits.measurement.toml -o {out}.measurement.toml",
    "identify {library}/guide_mill/static.measurement.toml {library}/guide_mill/rig.measurement.toml"
    " --start {library}/guide_mill/start.joint.toml -o {out}.joint.toml",
    "df {library}/guide.joint.toml --amplitude 1um 3um 5um --frequency 500",
    "check {library}/two_mass.toml",
    "compare {library}/paper_sdof.toml {library}/paper_sdof_hertz.toml",
    "uncouple {library}/bar.measurement.toml --remove {library}/bar.component.toml -o {out}.toml",
    "stickout {library}/end_mill.toml --between 66mm 76mm --speed 15000 --method zero-order",
    "plan {library}/guide.joint.toml --rig {library}/guide_mill/rig.measurement.toml"
    " --effects quadratic-damping -o {out}",
    "trace {library}/guide_mill/rig.measurement.toml --joint {library}/guide_mill/start.joint.toml -o {out}",
    "frf {library}/two_mass.toml -o {out}.npz",
    "frf {chain} -o {out}.npz",
    "frf {library}/guide_mill.toml -o {out}.npz",
    "frf {library}/lathe.toml -o {out}.npz",
    "frf {library}/column_mill_a.toml -o {out}.npz",
    "frf {new} -o {out}.npz",
    "lobes {library}/two_mode_tool.toml -o {out}.npz",
    "lobes {library}/guide_mill.toml -o {out}.npz",
    "lobes {library}/column_mill_a.toml -o {out}.npz",
    "lobes {new} -o {out}.npz",
    "modes {library}/column_mill_a.toml",
    "fmu {library}/guide_mill.toml -o {out}.fmu",
    "ssp {library}/two_mass.toml -o {out}.ssp",
    "study run {library}/guide_mill.study.toml -o {out}",
    "run {library}/guide_mill.toml -o {out}",
)
STAGES = {
    "start-up": ("_find_and_load",),
    "reading": ("read_machine", "with_joints"),
    "solving": ("in_one_harmonic", "stability_lobes", "natural_modes", "chatter_band"),
    "searching peaks": ("resonances", "tops"),
    "between speeds": ("over_the_range",),
    "harmonics": ("refined",),
    "estimating errors": ("with_errors", "with_held_forces"),
    "stability": ("with_stability",),
    "over amplitude": ("over_amplitude",),
    "forced": ("forced", "forced_field"),
    "writing": ("write_response", "write_lobes", "export_fmu", "draw"),
}
"""Functions whose time counts as that of a stage, less that of others of them that they call."""
MARKS = ("<!-- times -->", "<!-- end of times -->")
_EVERY = 0.003


def chain(path: Path, masses: int = 50, joints: int = 5) -> Path:
    """Masses in a row on springs, of which some are cubic."""
    rows = ['schema = "jointlib/machine/1"', 'name = "chain"']
    for i in range(masses):
        ground = ', stiffness = [["40 N/um"]], damping = [["400 N s/m"]]' if i == 0 else ""
        rows += [f'[[component]]\nname = "m{i}"\nkind = "lumped"\ndofs = ["x"]\nmass = [["2 kg"]]']
        rows += [line for line in ground.removeprefix(", ").split(", ") if line]
    every = masses // joints
    for i in range(1, masses):
        cubic = ', { kind = "cubic", stiffness3 = -2e17 }' if i % every == every // 2 else ""
        laws = f'{{ kind = "linear", stiffness = "400 N/um" }}, {{ kind = "viscous", damping = "300 N s/m" }}{cubic}'
        rows += [f'[[connection]]\nname = "k{i}"\nbetween = ["m{i}.x", "m{i - 1}.x"]\njoint = {{ law = [{laws}] }}']
    rows += [f'[tool]\nx = "m{masses - 1}.x"', '[response]\nforce = ["20 N"]\nfrequency = ["20 Hz", "2 kHz"]']
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return path


def taken(python: str, arguments: Sequence[str]) -> tuple[float, float, float, int]:
    """Seconds on the clock and of the processor, peak MiB and the exit status of one process."""
    begun = time.perf_counter()
    running = subprocess.Popen(
        [python, "-m", "jointlib", *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    _, status, used = os.wait4(running.pid, 0)
    running.returncode = os.waitstatus_to_exitcode(status)
    spent = time.perf_counter() - begun
    return spent, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024, running.returncode


def shares(arguments: Sequence[str]) -> str:
    """Where the time goes, in words, from a process of its own."""
    code = f"import bench_commands; bench_commands.profiled({list(arguments)!r})"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=Path(__file__).parent, capture_output=True, text=True, check=False
    )
    return done.stdout.splitlines()[-1] if done.stdout else "no shares"


def profiled(arguments: list[str]) -> None:
    """One command, looked at every few milliseconds; the last line says the shares."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    started = used.ru_utime + used.ru_stime
    stage_of = {name: stage for stage, names in STAGES.items() for name in names}
    seen: Counter[str] = Counter()
    ended, watched = threading.Event(), threading.get_ident()

    def look() -> None:
        while not ended.wait(_EVERY):
            frame = sys._current_frames().get(watched)
            while frame is not None and frame.f_code.co_name not in stage_of:
                frame = frame.f_back
            seen["else" if frame is None else stage_of[frame.f_code.co_name]] += 1

    sys.argv = ["jointlib", *arguments]
    out, sys.stdout = sys.stdout, open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
    looking = threading.Thread(target=look)
    looking.start()
    begun = time.perf_counter()
    try:
        from jointlib.cli.main import main

        main()
    except SystemExit:
        pass
    ended.set()
    looking.join()
    sys.stdout = out
    looks, spent = max(seen.total(), 1), time.perf_counter() - begun
    told = {stage: spent * seen[stage] / looks for stage in (*STAGES, "else")}
    told["start-up"] += started
    whole = sum(told.values())
    print(", ".join(f"{stage} {100 * each / whole:.0f} %" for stage, each in told.items() if each > 0.02 * whole))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--beside", help="Python of another installation of jointlib")
    parser.add_argument("--only", default="", help="commands with this word in them")
    parser.add_argument("--runs", type=int, default=2, help="of every command, of which the shortest counts")
    parser.add_argument("--pages", type=Path, help="a page that is to hold the table")
    given = parser.parse_args()
    print("Processor time is user and system, of every process of a command. Beside other work it grows too, though")
    print("less than the clock, which two processors shorten where a command shares its work among them:")
    print("compare two only in one run, by --beside.")
    print(f"{'command':44}{'clock [s]':>10}{'processor [s]':>14}{'MiB':>6}{'times':>12}  where it goes")
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        new = Path(folder) / "new.toml"
        subprocess.run([sys.executable, "-m", "jointlib", "new", "machine", "-o", str(new)], check=True, stdout=-3)
        places = {"library": LIBRARY, "chain": chain(Path(folder) / "chain.toml"), "new": new}
        for count, command in enumerate(COMMANDS):
            if given.only not in command:
                continue
            name = command.partition(" -o")[0].replace("{library}/", "").format(chain="chain", new="new")
            runs = []
            for k, python in enumerate((sys.executable, given.beside)):
                if python:
                    each = []
                    for again in range(1 if k else given.runs):
                        filled = command.format(**places, out=Path(folder) / f"out{count}{k}{again}").split()
                        each.append(taken(python, filled))
                    runs.append(min(each))
            clock, processor, memory, status = runs[0]
            ratio = f"{runs[1][0] / clock:.2f}, {runs[1][1] / processor:.2f}" if len(runs) > 1 else ""
            where = shares(command.format(**places, out=Path(folder) / f"shares{count}").split())
            ended = f"  (exit {status})" if status else ""
            rows.append(f"| `{name}` | {clock:.2f} | {processor:.2f} | {memory:.0f} | {where}{ended} |")
            print(f"{name:44}{clock:10.2f}{processor:14.2f}{memory:6.0f}{ratio:>12}  {where}{ended}", flush=True)
    if given.pages:
        put(given.pages, rows)


def put(page: Path, rows: Sequence[str]) -> None:
    """The table into a page, in place of what stands between its two marks."""
    before, _, rest = page.read_text("utf-8").partition(MARKS[0])
    _, _, after = rest.partition(MARKS[1])
    load = os.getloadavg()[0]
    about = (
        f"Times of {time.strftime('%d %B %Y', time.gmtime())}: {processor_name()}, {os.cpu_count()} cores, "
        f"Python {platform.python_version()}, one thread a process, "
        f"{load:.1f} processes at work in the last minute; ten million additions in a loop take {yardstick():.2f} s."
    )
    table = ["| command | clock [s] | processor [s] | MiB | where it goes |", "|---|---|---|---|---|", *rows]
    page.write_text("\n".join([before + MARKS[0], about, "", *table, "", MARKS[1] + after]), "utf-8")


def yardstick() -> float:
    """Seconds of a plain loop, by which tables of different days and machines are told apart."""
    begun, total = time.perf_counter(), 0
    for i in range(10_000_000):
        total += i
    return time.perf_counter() - begun


def processor_name() -> str:
    """As the system tells it."""
    lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines() if Path("/proc/cpuinfo").exists() else []
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), platform.machine())


if __name__ == "__main__":
    main()
