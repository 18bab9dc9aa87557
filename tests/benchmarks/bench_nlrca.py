"""Forced response of two masses with one softening joint: all branches on 600 lines at 4 forces, against a plain loop.

Then curves by arc length with one harmonic and with three, the estimate of what further harmonics change, labels by
Hill's method, and chains of masses; pyHarm beside them where PYHARM_PYTHON names its Python. Processor times.

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
from machines import Machine, read_machine, response
from machines.continuation.all_curves import Starts, follow, from_branches
from machines.continuation.arclength import Path
from machines.coupling.second_order import machine_equations
from machines.harmonic_balance.assembly import Assembly
from machines.harmonic_balance.truncation import truncation_error
from machines.operating.amplitude_map import roots
from machines.operating.solutions import Solutions, by_amplitude_map, by_newton
from machines.stability.hill import growth

sys.path.insert(0, str(Here(__file__).parents[1] / "machines"))
from test_several_joints import chain

LIBRARY = Here(machines.__file__).parent / "library"
LINES = np.linspace(1000.0, 7000.0, 600)
FORCES = np.array([10.0, 25.0, 50.0, 75.0])


def best(function: Callable[[], object], repeats: int) -> float:
    """Shortest processor time in s."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        function()
        times.append(time.process_time() - start)
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
    equations = machine_equations(assembly.machine)
    label = best(lambda: growth(equations, assembly.joints, z, view.omega, (1,)), 5) / 600
    print(f"  error estimate {error / per_point:.1f}, Hill's label {label / per_point:.1f} times the map, per point")


def several() -> None:
    """Chains at 50 N: the table's largest solution, everything on its lines, and everything over a range."""
    for masses, joints in ((10, 5), (50, 5), (50, 20)):
        solution = best(lambda n=masses, k=joints: solution_of(chain(n, k), 50.0), 3)  # type: ignore[misc]
        on_lines = best(lambda n=masses, k=joints: response(chain(n, k), 50.0, LINES), 2)  # type: ignore[misc]
        whole = best(lambda n=masses, k=joints: response(chain(n, k), 50.0, (1000.0, 7000.0)), 1)  # type: ignore[misc]
        print(
            f"  {masses} masses, {joints} joints: receptances and Newton on 600 lines {solution * 1e3:.0f} ms, with "
            f"peaks and errors {on_lines * 1e3:.0f} ms, over the range, round folds too, {whole * 1e3:.0f} ms"
        )


def solution_of(machine: Machine, force: float) -> Solutions:
    """All that is solved for on the 600 lines, from the matrices of the machine on."""
    assembly = Assembly(machine, ("row.m1",), ("row.m1",))
    if len(assembly.nonlinear) == 1:
        return by_amplitude_map(assembly, np.array([force]), LINES, 150)
    return by_newton(assembly, np.array([force]), LINES)


def peer() -> None:
    """PyHarm beside it, per accepted point; its first run compiles and is not counted."""
    python = os.environ.get("PYHARM_PYTHON")
    if python is None:
        return
    machine = read_machine(LIBRARY / "two_mass.toml")

    def theirs(*words: str) -> float:
        call = [python, str(Here(__file__).parent / "peer_pyharm.py"), *words]
        environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
        answer = subprocess.run(call, env=environment, capture_output=True, text=True, check=True)
        found = json.loads(answer.stdout.splitlines()[-1])
        return float(found["seconds"]) / len(found["frequency"])

    points = len(LINES) * len(FORCES)
    each = theirs("75", "4900", "5300", "1", "1")
    whole = best(lambda: response(machine, FORCES.tolist(), (1000.0, 7000.0)), 5)
    print(f"pyHarm beside it, {each * 1e3:.2f} ms per point with one harmonic")
    print(f"  one joint, 600 lines x 4 forces: {each * points / whole:.0f} times ours, peaks and errors included")
    each = theirs("75", "4900", "5300", "1,3,5", "1")
    one = response(machine, 75.0, (4900.0, 5300.0))
    assembly = Assembly(machine, ("slide.x",), ("slide.x",))
    starts = from_branches(assembly, one.branches, (1, 3, 5))
    path = Path(assembly, (1, 3, 5), 2 * np.pi * 4900.0, 2 * np.pi * 5300.0)
    lines = 2 * np.pi * np.linspace(4900.0, 5300.0, 600)
    count = sum(len(c.p) for c in follow(path, np.array([75.0]), starts, lines)[0])
    ours = best(lambda: follow(path, np.array([75.0]), starts, lines), 3) / count
    print(f"  harmonics 1, 3, 5: {each * 1e3:.2f} ms per point, ours {ours * 1e3:.2f}, {each / ours:.1f} times")
    each = theirs("50", "1040", "1100", "1", "20", "50")
    solution = best(lambda: solution_of(chain(50, 1), 50.0), 5)
    whole = best(lambda: response(chain(50, 1), 50.0, (1000.0, 7000.0)), 5)
    print(
        f"  50 masses, {each * 1e3:.2f} ms per point: 600 points are {each * 600 / solution:.0f} times our solution on "
        f"600 lines, {each * 600 / whole:.0f} times all with refined lines, peaks and errors"
    )


if __name__ == "__main__":
    main()
