"""The whole trace of the guide's rig and of long paths beside the least that is done with their records, and laws with
memory stepped at once.

Run it on one core: OPENBLAS_NUM_THREADS=1 python tests/benchmarks/bench_trace.py
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import machines
from jointlib import read_joint, read_measurement, trace
from jointlib.arrays import Array
from jointlib.identification.path_record import low_pass
from jointlib.io.measurement_file import read_records
from jointlib.law import Motion
from jointlib.laws.dahl import Dahl
from jointlib.laws.jenkins import Jenkins
from jointlib.loop.balance.steady import steady_force

GUIDE = Path(machines.__file__).parent / "library" / "guide_mill"
SAMPLES, STEP, PERIODS = 10240, 1 / 204.8e3, 2
PATHS = (("random", 1500), ("random", 16384), ("random", 133334))
"""How paths move, and samples in each of their three records."""
SHAPES = 3e-6 * np.geomspace(0.01, 1.0, 15)
"""Slip distances in m."""


def best(function: Callable[[], object], repeats: int) -> float:
    """Shortest time in s."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return min(times)


def read_and_transform() -> None:
    """What every look at the records must do at least."""
    test = read_measurement(GUIDE / "rig.measurement.toml")
    for record in read_records(test, test.records):
        for x in record.channels.values():
            np.fft.rfft(x)


def whole() -> None:
    trace(read_measurement(GUIDE / "rig.measurement.toml"), read_joint(GUIDE / "start.joint.toml"))


def long_path(folder: Path, signal: str, samples: int) -> tuple[Path, Path]:
    """A path of the acceptance suite but for its length: friction that follows a voltage, and a force that is late."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "acceptance"))
    import path_records

    path_records.SAMPLES = samples
    return path_records.write(folder, path_records.Case(("coulomb", "modulation", "lag"), signal, 60, 1))


def filtered_once(measurement: Path) -> None:
    """Reading a path and filtering force and displacement, the least that a trace of it does."""
    test = read_measurement(measurement)
    for record in read_records(test, test.records):
        for x in record.channels.values():
            low_pass(x, 4.0, record.sample_rate)


def paths() -> tuple[Array, Array]:
    """z in m and ż in m/s of three multisines from 2 to 8 kHz, peaks 0.4, 3 and 3 um, shape (samples, records)."""
    omega = 2 * np.pi * np.fft.rfftfreq(SAMPLES, STEP)
    inside = (omega > 2 * np.pi * 2e3) & (omega < 2 * np.pi * 8e3)
    phases = np.random.default_rng(1).uniform(0, 2 * np.pi, (3, len(omega)))
    Z = np.where(inside, np.exp(1j * phases), 0)
    z = np.fft.irfft(Z, SAMPLES).T
    scale = np.array([0.4e-6, 3e-6, 3e-6]) / np.abs(z).max(axis=0)
    return z * scale, np.fft.irfft(1j * omega * Z, SAMPLES).T * scale


def one_by_one(law: type[Jenkins] | type[Dahl], z: Array, v: Array) -> None:
    """Per shape and record a plain loop over the samples of two periods: run-in and steady state."""
    for d in SHAPES:
        for r in range(z.shape[1]):
            one, state = law(1.0, float(d)), law(1.0, float(d)).initial_state(np.zeros(()))
            for _ in range(PERIODS):
                for i in range(SAMPLES):
                    _, state = one.step(Motion(z[i, r], v[i, r], STEP), state)


def main() -> None:
    """Print the times and their ratios."""
    least, all_of_it = best(read_and_transform, 5), best(whole, 2)
    print(f"guide mill, reading and FFT {least * 1e3:8.1f} ms")
    print(f"guide mill, whole trace     {all_of_it * 1e3:8.1f} ms   {all_of_it / least:.0f} times as long")
    for signal, samples in PATHS:
        with tempfile.TemporaryDirectory() as folder:
            file, joint = long_path(Path(folder), signal, samples)
            least = best(lambda file=file: filtered_once(file), 3)  # type: ignore[misc]
            start = time.process_time()
            trace(read_measurement(file), read_joint(joint))
            spent = time.process_time() - start
        print(
            f"{signal} path, 3 x {samples} samples, reading and filtering {least * 1e3:.1f} ms, whole trace "
            f"{spent:.1f} s: {spent / least:.0f} times as long"
        )
    z, v = paths()
    for law in (Jenkins, Dahl):
        grid = law(1.0, SHAPES[:, None])  # type: ignore[arg-type]
        at_once = best(lambda grid=grid: steady_force(grid, z[:, None], v[:, None], STEP), 3)  # type: ignore[misc]
        plain = best(lambda law=law: one_by_one(law, z, v), 1)  # type: ignore[misc]
        print(
            f"{law.kind}, {len(SHAPES)} shapes x 3 records: at once {at_once * 1e3:.0f} ms, one by one "
            f"{plain * 1e3:.0f} ms: {plain / at_once:.0f} times as long"
        )


if __name__ == "__main__":
    main()
