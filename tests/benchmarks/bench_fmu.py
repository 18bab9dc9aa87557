"""One step of a native FMU beside the same joint in Python: in a C client, and in FMPy.

The C client preloads libpython for the FMU with the Python runtime; without that it could not load it. Fails where the
native FMU of LuGre friction is not 200 times as fast, or an archive is larger than 500 kB.
Run it on one core: OPENBLAS_NUM_THREADS=1 python tests/benchmarks/bench_fmu.py
"""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
import tempfile
import time
from pathlib import Path

import fmpy
from fmpy.fmi2 import FMU2Slave
from fmpy.model_description import read_model_description

from fmu.export import Export, export_fmu
from fmu.members.archive import read_archive, unpack
from fmu.members.build import PLATFORMS, compilers
from jointlib.joint import Joint
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.laws.lugre import LuGre

FRICTION = LuGre(4e7, 300.0, 36.0, 50.0, 0.02)
JOINTS = (Joint((FRICTION,), "LuGre"), Joint((HertzGuide(630.0, 3.931408125e-8), FRICTION), "guide with LuGre"))
RATIO, LARGEST = 200, 500_000
HERE = Path(__file__).parent


def in_c(told: Export, folder: Path, host: Path, steps: int) -> tuple[float, float]:
    """Time of a step and of the birth of an instance in s."""
    unpack(told.file, read_archive(told.file), folder)
    read = read_model_description(str(folder))
    (library,) = (folder / "binaries" / fmpy.platform).glob(f"{read.coSimulation.modelIdentifier}.*")
    command = [str(host), str(library), read.guid, (folder / "resources").as_uri(), str(steps), "5"]
    command.append(str(first_reference(folder)))
    environment = dict(os.environ)
    if told.runtime == "python":
        python = Path(sysconfig.get_config_var("LIBDIR")) / sysconfig.get_config_var("INSTSONAME")
        environment |= {"LD_PRELOAD": str(python), "PYTHONHOME": sys.base_prefix}
        environment["PYTHONPATH"] = os.pathsep.join(path for path in sys.path if path)
    done = subprocess.run(command, env=environment, check=True, stdout=subprocess.PIPE, text=True)
    step, born = map(float, done.stdout.split())
    return step / 1e9, born / 1e9


def first_reference(folder: Path) -> int:
    """Value reference of the displacement, which velocity and force follow."""
    (first,) = (
        v.valueReference for v in read_model_description(str(folder)).modelVariables if v.name == "displacement"
    )
    return int(first)


def in_fmpy(folder: Path, steps: int) -> float:
    """Time of a step in s."""
    read = read_model_description(str(folder))
    fmu = FMU2Slave(
        guid=read.guid, modelIdentifier=read.coSimulation.modelIdentifier, unzipDirectory=str(folder), instanceName="x"
    )
    fmu.instantiate()
    fmu.setupExperiment()
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    best = float("inf")
    z = first_reference(folder)
    for k in range(5):
        start = time.perf_counter()
        for i in range(steps):
            fmu.setReal([z, z + 1], [1e-9 * (i % 1000), 1e-3])
            fmu.doStep((k * steps + i) * 1e-6, 1e-6)
            fmu.getReal([z + 2])
        best = min(best, (time.perf_counter() - start) / steps)
    fmu.freeInstance()
    return best


def compared(joint: Joint, folder: Path, host: Path) -> tuple[float, int]:
    """Print times and sizes; how many times as long the C client waits for Python, and the size of the native FMU."""
    native = export_fmu(joint, folder / "native.fmu", runtime="c")
    python = export_fmu(joint, folder / "python.fmu", runtime="python")
    fast, born = in_c(native, folder / "native", host, 1_000_000)
    slow, slowly_born = in_c(python, folder / "python", host, 10_000)
    fast_there, slow_there = in_fmpy(folder / "native", 20_000), in_fmpy(folder / "python", 20_000)
    print(joint.name)
    print(
        f"  C client, set + step + get   native {fast * 1e6:7.3f} us, Python {slow * 1e6:6.1f} us: 1/{slow / fast:.0f}"
    )
    print(f"  C client, start              native {born * 1e6:7.0f} us, Python {slowly_born * 1e6:6.0f} us")
    there = f"1/{slow_there / fast_there:.1f}"
    print(
        f"  FMPy, set + step + get       native {fast_there * 1e6:7.2f} us, Python {slow_there * 1e6:6.1f} us: {there}"
    )
    sizes = [told.file.stat().st_size for told in (native, python)]
    for told, size in zip((native, python), sizes, strict=True):
        print(f"  archive, {told.runtime + ' runtime':19} {size / 1000:.0f} kB with {', '.join(told.platforms)}")
    return slow / fast, sizes[0]


def main() -> int:
    """Print times, ratios and sizes; 1 if one is not what is demanded."""
    import pythonfmu  # noqa: F401  # the one that is installed, not the copy in a folder

    with tempfile.TemporaryDirectory(prefix="jointlib-") as name:
        host = Path(name) / "fmu_speed"
        headers = Path(fmpy.__file__).with_name("c-code")
        flags = ["-std=c99", "-O2", f"-I{headers}"]
        subprocess.run(["cc", *flags, str(HERE / "fmu_speed.c"), "-o", str(host), "-ldl", "-lm"], check=True)
        found = []
        for i, joint in enumerate(JOINTS):
            (Path(name) / str(i)).mkdir()
            found.append(compared(joint, Path(name) / str(i), host))
    if len(compilers()) < len(PLATFORMS):
        print(f"{len(compilers())} of {len(PLATFORMS)} platforms; pip install 'jointlib[native]' brings the others")
    good = found[0][0] >= RATIO and all(size <= LARGEST for _, size in found)
    print(f"demanded: LuGre at most 1/{RATIO}, archives at most {LARGEST // 1000} kB: {'kept' if good else 'MISSED'}")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
