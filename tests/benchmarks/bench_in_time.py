"""A chain of 50 masses with 5 cubic joints: forced response by harmonic balance, and by an equation solver in time.

``python tests/benchmarks/bench_in_time.py`` integrates the equations of motion with scipy's `solve_ivp`
(DOP853) at a few frequencies until the motion of the last mass repeats, and holds its first harmonic against the
receptance. The chain is that of `bench_commands` with dampers ten times as strong: with its own, transients last for
thousands of periods. Times are of the processor, a line by the solver against one of the response, peaks and errors
included.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from machines import read_machine, response

sys.path.insert(0, str(Path(__file__).parent))
from bench_commands import chain

MASSES, JOINTS, FORCE = 50, 5, 2000.0
MASS, STIFFNESS, DAMPING, CUBIC = 2.0, 4e8, 3000.0, -2e17
GROUND, GROUND_DAMPING = 4e7, 4000.0
FREQUENCIES = (130.0, 405.0, 650.0)
REPEATS, MOST, TOLERANCE = 1e-5, 4000, 1e-7
"""Change of the first harmonic over ten periods at which a motion counts as steady, and periods at most."""


def receptance(frequency: float) -> tuple[complex, int]:
    """First harmonic of the last mass over the force in m/N, from rest, and after how many periods."""
    omega = 2 * np.pi * frequency
    every = MASSES // JOINTS
    bent = np.array([CUBIC if i % every == every // 2 else 0.0 for i in range(1, MASSES)])

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        x, v = y[:MASSES], y[MASSES:]
        apart = np.diff(x)
        between = STIFFNESS * apart + bent * apart**3 + DAMPING * np.diff(v)
        force = np.zeros(MASSES)
        force[:-1] += between
        force[1:] -= between
        force[0] -= GROUND * x[0] + GROUND_DAMPING * v[0]
        force[-1] += FORCE * np.cos(omega * t)
        return np.concatenate([v, force / MASS])

    y, before, period = np.zeros(2 * MASSES), np.inf, 2 * np.pi / omega
    grid = np.arange(64) / 64 * period
    for lot in range(MOST // 10):
        begin = 10 * lot * period
        ends = begin + np.append(9 * period + grid, 10 * period)
        done = solve_ivp(rates, (begin, ends[-1]), y, "DOP853", ends, rtol=TOLERANCE, atol=1e-14)
        y = done.y[:, -1]
        found = 2 * np.mean(done.y[MASSES - 1, :-1] * np.exp(-1j * omega * grid)) / FORCE
        if abs(found - before) < REPEATS * abs(found):
            return found, 10 * (lot + 1)
        before = found
    raise SystemExit(f"{frequency:g} Hz: not steady after {MOST} periods")


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = chain(Path(folder) / "chain.toml", MASSES, JOINTS)
        text = path.read_text("utf-8").replace('"300 N s/m"', f'"{DAMPING:g} N s/m"')
        path.write_text(text.replace('"400 N s/m"', f'"{GROUND_DAMPING:g} N s/m"'), "utf-8")
        machine = read_machine(path)
    begun = time.process_time()
    found = response(machine, FORCE, (20.0, 2000.0))
    ours, lines = time.process_time() - begun, len(found.frfs[0].frequency)
    print(f"{MASSES} masses, {JOINTS} joints, {FORCE:g} N: {lines} lines with peaks and errors in {ours:.2f} s")
    alone, small = (
        response(machine, force, np.array(FREQUENCIES)).frfs[0].receptance for force in (FORCE, FORCE / 1e3)
    )
    for k, frequency in enumerate(FREQUENCIES):
        begun = time.process_time()
        theirs, periods = receptance(frequency)
        spent = time.process_time() - begun
        ratio, known = spent / (ours / lines), alone[k, 0, 0]
        print(
            f"  {frequency:g} Hz: {periods} periods in {spent:.2f} s, {ratio:.0f} times a line of ours; receptance "
            f"differs by {abs(theirs / known - 1):.1e}, that of a small force by {abs(small[k, 0, 0] / known - 1):.1e}"
        )
        assert abs(theirs / known - 1) < 1e-3


if __name__ == "__main__":
    main()
