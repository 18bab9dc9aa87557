"""Forced response of two masses with one softening joint: all branches on 600 lines at 4 forces, against a plain loop.

Run it: python tests/benchmarks/bench_nlrca.py
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.optimize import fsolve

import machines
from jointlib.laws.cubic import Cubic
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import read_machine, response
from machines.amplitude_map import roots
from machines.assembly import Assembly

LIBRARY = Path(machines.__file__).parent / "library"
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


if __name__ == "__main__":
    main()
