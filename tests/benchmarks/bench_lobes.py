"""Zero-order lobes at 400 speeds, beside a plain loop over speeds and roots. Run it as a script."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq

from jointlib.arrays import Array, ComplexArray
from machines.lobes import Cutting, stability_lobes

CUTTING = Cutting("milling", teeth=3, tangential=6e8, normal=4.2e7, mode="slot")
SPEEDS = np.linspace(4000.0, 20000.0, 400)
LINES = np.arange(5.0, 3000.0, 5.0)


def receptance(f: Array) -> ComplexArray:
    """Two modes, 603 Hz along x and 666 Hz along y."""
    out = np.zeros((len(f), 2, 2), dtype=complex)
    for i, (frequency, zeta, stiffness) in enumerate(((603.0, 0.039, 5.59e6), (666.0, 0.035, 5.715e6))):
        r = f / frequency
        out[:, i, i] = 1 / (stiffness * (1 - r**2 + 2j * zeta * r))
    return out


def vectorised() -> Array:
    return stability_lobes(receptance, CUTTING, SPEEDS, frequency=LINES).depth


def one_by_one() -> Array:
    """Per speed: eigenvalues on a grid shared by all speeds, then brentq on every change of sign."""
    D = CUTTING.mean_stiffness
    lines = np.arange(2.5, 3000.0, 2.5)
    values = np.linalg.eigvals(D @ receptance(lines))
    depths = []
    for speed in SPEEDS:
        tau = 60 / (CUTTING.cuts_per_revolution * speed)
        delay = 1 - np.exp(-2j * np.pi * lines * tau)
        best = np.inf
        for j in range(len(lines) - 1):
            for start in values[j]:
                end = values[j + 1][np.argmin(np.abs(values[j + 1] - start))]
                if start.real >= 0 or (delay[j] * start).imag * (delay[j + 1] * end).imag >= 0:
                    continue

                def loop(f: float, near: complex = start, tau: float = tau) -> complex:
                    found = np.linalg.eigvals(D @ receptance(np.array([f]))[0])
                    return complex((1 - np.exp(-2j * np.pi * f * tau)) * found[np.argmin(np.abs(found - near))])

                root = loop(brentq(lambda f, loop=loop: loop(f).imag, lines[j], lines[j + 1], xtol=1e-10))
                if root.real < -1e-9 * abs(start):
                    best = min(best, -1 / root.real)
        depths.append(best)
    return np.array(depths)


def timed(work: Callable[[], Array], repeats: int) -> tuple[float, Array]:
    seconds = []
    for _ in range(repeats):
        start = time.perf_counter()
        result = work()
        seconds.append(time.perf_counter() - start)
    return min(seconds), result


def main() -> None:
    fast, depth = timed(vectorised, 9)
    slow, check = timed(one_by_one, 1)
    print(f"400 speeds, zero-order: {fast * 1e3:.1f} ms vectorised, {slow * 1e3:.0f} ms one by one: {slow / fast:.0f}x")
    print(f"largest relative difference of the depths: {np.max(np.abs(depth / check - 1)):.1e}")


if __name__ == "__main__":
    main()
