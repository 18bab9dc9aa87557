"""Machine FMUs in a C client: how many times real time, beside the explicit steps that they replaced, in one run.

The same library takes explicit steps of 1e-10 where a damping that is in its modes is moved by 1e-12 of itself. Forces
are sums of sines of the size that the machine's file names. Fails where a machine of the library is slower than is
demanded, or its motion at the tool, or the work of the force there, differs by more than 1e-4 from the explicit steps.
Run it on one core: OPENBLAS_NUM_THREADS=1 python tests/benchmarks/bench_machine_fmu.py
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path

import fmpy
import numpy as np
from fmpy.model_description import read_model_description

from fmu.export import export_fmu
from fmu.members.archive import read_archive, unpack
from jointlib.arrays import Array

HERE = Path(__file__).parent
LIBRARY = HERE.parents[1] / "machines" / "library"
DEMANDED = {"guide_mill": 100.0, "three_joints": 100.0, "column_mill_a": 1.0, "column_mill_b": 1.0, "lathe": 1.0}
"""Times real time at a tolerance of 1e-4."""
STEPS, FEW, CLOSE = 4000, 60, 1e-4


def main() -> int:
    """Print times real time and differences; 1 if one is not what is demanded."""
    good = True
    with tempfile.TemporaryDirectory(prefix="jointlib-") as name:
        host = Path(name) / "machine_speed"
        headers = Path(fmpy.__file__).with_name("c-code")
        source = str(HERE / "machine_speed.c")
        subprocess.run(["cc", "-std=c99", "-O2", f"-I{headers}", source, "-o", str(host), "-ldl", "-lm"], check=True)
        for machine in sys.argv[1:] or DEMANDED:
            good &= compared(machine, DEMANDED[machine], Path(name), host)
    print("kept" if good else "MISSED")
    return 0 if good else 1


def compared(machine: str, demanded: float, folder: Path, host: Path) -> bool:
    """One machine; True if it is fast and right."""
    begun = time.process_time()
    file = export_fmu(LIBRARY / f"{machine}.toml", folder / f"{machine}.fmu").file
    taken, size = time.process_time() - begun, file.stat().st_size
    unpack(file, read_archive(file), folder / machine)
    read = read_model_description(str(folder / machine))
    variables = {str(v.name): v for v in read.modelVariables}
    force = variables["force_x"]
    nudged = next(int(v.valueReference) for n, v in variables.items() if n.endswith("viscous.damping"))
    (library,) = (folder / machine / "binaries" / fmpy.platform).iterdir()
    h = float(read.defaultExperiment.stepSize)

    def run(steps: int, tolerance: float, moved: int = 0) -> tuple[float, float, Array]:
        asked = [force.valueReference, variables["displacement_x"].valueReference, float(force.nominal), tolerance]
        command = [str(host), str(library), read.guid, *map(str, asked), repr(h), str(steps), "1", str(moved)]
        done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
        first, work, *rest = map(float, done.stdout.split())
        return first, work, np.array(rest)

    about = f"steps of {h * 1e6:.3g} us under {float(force.nominal):g} N"
    print(f"{machine}: exported in {taken:.0f} s of processor time beside the compiler's, {size / 1e6:.1f} MB, {about}")
    before, work, expected = run(FEW, 0.0, nudged)
    moved = np.max(np.abs(expected - expected[0]))
    print(f"  explicit, 1e-10      {h / before:9.3g} times real time")
    for tolerance in (0.0, 1e-6, 1e-4):
        now = min(run(STEPS, tolerance)[0] for _ in range(3))
        _, done, found = run(FEW, tolerance)
        off, lost = float(np.max(np.abs(found - expected)) / moved), abs(done - work) / abs(work)
        word = f"tolerance {tolerance:g}" if tolerance else "no tolerance told"
        pace = f"{h / now:9.3g} times real time, 1/{before / now:.0f} of the time"
        print(f"  {word:20} {pace}, {off:.1e} off, work {lost:.1e}")
    return bool(h / now >= demanded and max(off, lost) <= CLOSE)


if __name__ == "__main__":
    sys.exit(main())
