"""Forced response of two masses with one softening joint: all branches on 600 lines at 4 forces, against a plain loop.

Then curves by arc length with one harmonic and with three, the estimate of what further harmonics change, labels by
Hill's method, and a chain of 10 masses with 5 joints; pyHarm beside them where PYHARM_PYTHON names its Python.

Run it: python tests/benchmarks/bench_nlrca.py
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path as Here

import numpy as np
from scipy.optimize import fsolve

import machines
from jointlib.laws.cubic import Cubic
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import ArcLength, read_machine, response
from machines.amplitude_map import roots
from machines.arclength import Path
from machines.assembly import Assembly
from machines.following import Starts, follow, from_branches
from machines.hill import growth, hill_equations
from machines.truncation import truncation_error

sys.path.insert(0, str(Here(__file__).parents[1] / "machines"))
from test_several_joints import chain

LIBRARY = Here(machines.__file__).parent / "library"
LINES = np.linspace(1000.0, 7000.0, 600)
FORCES = np.array([10.0, 25.0, 50.0, 75.0])


def best(function: Callable[[], object], repeats: int) -> float:
    """Shortest time in s."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return min(times)


def plain_loop() -> None:
    """One unknown complex displacement per line and force, scipy's fsolve, started from the neighbouring line."""
    machine = read_machine(LIBRARY / "two_mass.toml")
    linear, cubic, viscous = machine.joints()[0].laws
    assert isinstance(linear, Linear)
    assert isinstance(cubic, Cubic)
    assert isinstance(viscous, Viscous)
    for force in FORCES:
        start = np.zeros(2)
        for w in 2 * np.pi * LINES:
            driven = -1 / (0.942 * w**2)
            h = driven + 1 / (2e8 + 200j * w - 2.2 * w**2)

            def balance(y, w=w, h=h, driven=driven, force=force):  # type: ignore[no-untyped-def]
                z = (y[0] + 1j * y[1]) * 1e-6
                gain = linear.stiffness + 0.75 * cubic.stiffness3 * abs(z) ** 2 + 1j * w * viscous.damping
                r = (z + h * gain * z - driven * force) * 1e6
                return [r.real, r.imag]

            start = fsolve(balance, start, xtol=1e-12)


def main() -> None:
    """Print the times and their ratios."""
    machine = read_machine(LIBRARY / "two_mass.toml")
    assembly = Assembly(machine, ("slide.x",), ("slide.x",))
    joint, limit = assembly.joints[0], assembly.limits[0]
    branches = best(lambda: roots(assembly.at(2 * np.pi * LINES), joint, FORCES, limit), 9)
    whole = best(lambda: response(machine, FORCES.tolist(), (1000.0, 7000.0)), 5)
    loop = best(plain_loop, 1)
    points = len(LINES) * len(FORCES)
    print(f"{len(LINES)} lines x {len(FORCES)} forces")
    print(f"  all branches on the lines       {branches * 1e3:8.1f} ms   {branches / points * 1e6:6.1f} us per point")
    print(f"  with refined lines and peaks    {whole * 1e3:8.1f} ms")
    print(f"  plain fsolve loop, one branch   {loop * 1e3:8.1f} ms   {loop / points * 1e6:6.1f} us per point")
    print(f"  the loop takes {loop / branches:.0f} times as long as all branches, {loop / whole:.0f} times the whole")
    curves(assembly, branches / points)
    several()
    peer()


def curves(assembly: Assembly, per_point: float) -> None:
    """Times of curves per accepted point, as multiples of the map's."""
    starts = from_branches(assembly, response(assembly.machine, FORCES.tolist()).branches, (1,))
    low, high = 2 * np.pi * LINES[0], 2 * np.pi * LINES[-1]
    for harmonics in ((1,), (1, 3, 5)):
        path = Path(assembly, harmonics, low, high)
        whole = np.zeros((len(starts.omega), len(harmonics), 1), dtype=complex)
        whole[:, :1] = starts.z
        chosen = Starts(starts.force, starts.omega, whole)
        found: list[int] = []

        def run(path: Path = path, chosen: Starts = chosen, found: list[int] = found) -> None:
            found.append(
                sum(len(c.p) for of_force in follow(path, FORCES, chosen, 2 * np.pi * LINES) for c in of_force)
            )

        each = best(run, 3) / found[0]
        print(
            f"  arc length, harmonics {harmonics}  {each * 1e6:6.0f} us per point, {each / per_point:.0f} times the map"
        )
    view = assembly.at(2 * np.pi * LINES)
    z = np.full((len(LINES), 1, 1), 2e-6 + 0j)
    error = best(lambda: truncation_error(assembly, view.omega, np.full(600, 50.0), z, (1,), (1, 3, 5)), 5) / 600
    equations = hill_equations(assembly.machine)
    assert not isinstance(equations, str)
    label = best(lambda: growth(equations, assembly.joints, z, view.omega, (1,)), 5) / 600
    print(f"  error estimate {error / per_point:.1f}, Hill's label {label / per_point:.1f} times the map, per point")


def several() -> None:
    """A chain of 10 masses and 5 joints at 50 N: Newton on lines, and arc length round its fold."""
    machine = chain(10, 5)
    lines = np.linspace(1000.0, 2000.0, 600)
    newton = best(lambda: response(machine, 50.0, lines), 3)
    traced = best(lambda: response(machine, 50.0, (1000.0, 2000.0)), 2)
    print(
        f"10 masses, 5 joints: Newton on 600 lines {newton * 1e3:.0f} ms, all curves {traced / newton:.1f} times that"
    )


def peer() -> None:
    """PyHarm's time per accepted point, compiled beforehand by a first run of its own."""
    python = os.environ.get("PYHARM_PYTHON")
    if python is None:
        return
    script = Here(__file__).parent / "peer_pyharm.py"
    for names, harmonics in (("1", (1,)), ("1,3,5", (1, 3, 5))):
        call = [python, str(script), "75", "4900", "5300", names, "1"]
        environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
        theirs = json.loads(
            subprocess.run(call, env=environment, capture_output=True, text=True, check=True).stdout.splitlines()[-1]
        )
        machine = read_machine(LIBRARY / "two_mass.toml")
        method = ArcLength() if harmonics == (1,) else None
        start = time.perf_counter()
        found = response(machine, 75.0, (4900.0, 5300.0), method=method, harmonics=harmonics)
        ours = (time.perf_counter() - start) / sum(len(b.frequency) for b in found.branches[0])
        each = theirs["seconds"] / len(theirs["frequency"])
        print(f"  pyHarm {harmonics}: {each * 1e3:.1f} ms per point, {each / ours:.1f} times ours with everything")


if __name__ == "__main__":
    main()
