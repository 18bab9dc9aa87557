"""Stability lobes beside plain loops: a chart by collocation, the boundary by each method. Run it as a script.

Times are of one core, OPENBLAS_NUM_THREADS=1, and do not count what other programs take.
"""

from __future__ import annotations

import sys
import time
import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq

from jointlib import read_joint
from jointlib.arrays import Array, ComplexArray
from machines import lobes_at_amplitude, read_machine
from machines.cutting.cutters.pattern_multipliers import largest_multipliers as cutter_multipliers
from machines.cutting.loops.collocation import arc_map
from machines.cutting.loops.multipliers import largest_multipliers
from machines.lobes import Cutting, stability_lobes
from machines.tool.tool_model import ToolModel
from machines.tool.tool_point import tool_point

sys.path.insert(0, str(Path(__file__).parents[1] / "machines"))
from semi_discretization import largest_multiplier, mean_stiffness

CUTTING = Cutting("milling", teeth=3, tangential=6e8, normal=4.2e7, mode="slot")
SPEEDS = np.linspace(4000.0, 20000.0, 400)
LINES = np.arange(5.0, 3000.0, 5.0)

NATURAL, ZETA, MASS = 922.0, 0.011, 0.03993
HALF = Cutting("milling", teeth=2, tangential=6e8, normal=2e8, mode="down", immersion=0.5)
CHART_SPEEDS = np.linspace(5000.0, 25000.0, 200)
DEPTHS = {1: np.linspace(0.0, 4e-3, 101)[1:], 2: np.linspace(0.0, 1e-3, 101)[1:]}
STEPS = 40


def receptance(f: Array) -> ComplexArray:
    """Two modes, 603 Hz along x and 666 Hz along y."""
    out = np.zeros((len(f), 2, 2), dtype=complex)
    for i, (frequency, zeta, stiffness) in enumerate(((603.0, 0.039, 5.59e6), (666.0, 0.035, 5.715e6))):
        r = f / frequency
        out[:, i, i] = 1 / (stiffness * (1 - r**2 + 2j * zeta * r))
    return out


def two_modes() -> ToolModel:
    natural, stiffness = np.array([603.0, 666.0]), np.array([5.59e6, 5.715e6])
    return ToolModel.from_modes(natural, [0.039, 0.035], stiffness / (2 * np.pi * natural) ** 2, np.eye(2))


def vectorised() -> Array:
    return stability_lobes(receptance, CUTTING, SPEEDS, "zero-order", frequency=LINES).depth


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


def textbook_point(speed: float, depth: float, directions: int, H: Array) -> float:
    """Largest |μ| at one point by semi-discretisation as in the textbooks: a product of sparse k-step matrices."""
    n = directions
    M, C, K = matrices(n)
    dt = 60 / (2 * speed) / STEPS
    inverse = np.linalg.inv(M)
    size = 2 * n + STEPS * n
    product = np.eye(size)
    for i in range(STEPS):
        w = depth * H[i]
        A = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ (K + w), -inverse @ C]])
        B = np.concatenate([np.zeros((n, n)), inverse @ w])
        P = expm(A * dt)
        R = (P - np.eye(2 * n)) @ np.linalg.solve(A, B) / 2
        step = np.zeros((size, size))
        step[: 2 * n, : 2 * n] = P
        step[: 2 * n, size - n :] = R
        step[: 2 * n, size - 2 * n : size - n] += R
        step[2 * n : 3 * n, :n] = np.eye(n)
        step[3 * n :, 2 * n : size - n] = np.eye(size - 3 * n)
        product = step @ product
    return float(np.max(np.abs(np.linalg.eigvals(product))))


def matrices(n: int) -> tuple[Array, Array, Array]:
    k = MASS * (2 * np.pi * NATURAL) ** 2
    return MASS * np.eye(n), 2 * ZETA * np.sqrt(k * MASS) * np.eye(n), k * np.eye(n)


def chart(directions: int) -> None:
    """200 × 100 points at half immersion, down."""
    n = directions
    tool = ToolModel.from_modes([NATURAL] * n, [ZETA] * n, [MASS] * n, np.eye(n), ("x", "y")[:n])
    depth = DEPTHS[n]
    ours, mu = timed(lambda: largest_multipliers(tool, HALF, CHART_SPEEDS, depth), 2)
    H = mean_stiffness(STEPS, 2, 6e8, 2e8, (HALF.entry_angle, HALF.exit_angle), n)
    points = [(s, d) for s in CHART_SPEEDS[::20] for d in depth[3::10]]
    loop, plain = timed(lambda: np.array([textbook_point(s, d, n, H) for s, d in points]), 1)
    seconds = loop / len(points) * mu.size
    semi = np.array([largest_multiplier(*matrices(n), H, s, 2, depth) for s in CHART_SPEEDS])
    check = semi[::20, 3::10].ravel()
    truth = np.array([np.max(np.abs(arc_map(tool, HALF, s, 40).multipliers(depth)), axis=1) for s in CHART_SPEEDS]) < 1
    wrong, theirs = np.count_nonzero((mu < 1) != truth), np.count_nonzero((semi < 1) != truth)
    print(
        f"{mu.size} points, {n} direction(s): {ours:.2f} s by collocation, {seconds:.0f} s by a loop of "
        f"semi-discretisation at {STEPS} steps ({len(points)} points timed): {seconds / ours:.0f}x; "
        f"misclassified {wrong} and {theirs}; the loop and its batch differ by {np.max(np.abs(plain - check)):.0e}"
    )


def uneven_chart() -> None:
    """200 × 100 points of cutters with unequal pitches and helix, beside the chart of even teeth."""
    tool = ToolModel.from_modes([800.0] * 2, [0.02] * 2, [1.0] * 2, np.eye(2))
    even = Cutting("milling", teeth=4, tangential=2e8, normal=6e7, mode="down", immersion=0.5, diameter=0.012)
    speeds, depth = np.linspace(4000.0, 12000.0, 200), np.linspace(0.0, 20e-3, 101)[1:]
    before, mu = timed(lambda: cutter_multipliers(tool, even, speeds, depth), 3)
    print(f"{mu.size} points, four even teeth: {before:.2f} s")
    for name, more in (
        ("pitches 70, 110, 70, 110", {"pitch": (70, 110, 70, 110)}),
        ("helix 40", {"helix": 40.0}),
        ("both", {"pitch": (70, 110, 70, 110), "helix": 40.0}),
    ):
        cut = replace(even, **more)
        seconds, _ = timed(lambda c=cut: cutter_multipliers(tool, c, speeds, depth), 2)
        print(f"{mu.size} points, {name}: {seconds:.2f} s, {seconds / before:.1f} times the even ones")


def slow_uneven() -> None:
    """The limit of an uneven cutter at slow speeds: a march over the pattern beside determinants of its loop."""
    tool = ToolModel.from_modes(
        [420.0, 655.0, 1310.0], [0.03, 0.02, 0.025], [1.1, 0.6, 0.2], [[1, 0, 0.6], [0, 1, 0.8]]
    )
    cut = Cutting("milling", teeth=4, tangential=7e8, normal=2.5e8, mode="down", immersion=0.6, pitch=(84, 96, 83, 97))
    point = tool_point(tool, tool.axes, tool.lines)
    for speed in (4000.0, 2000.0, 1000.0):
        marched, depth = timed(lambda rpm=speed: stability_lobes(tool, cut, [rpm], "multi-frequency").depth, 1)
        formed, other = timed(lambda rpm=speed: stability_lobes(point, cut, [rpm], "multi-frequency").depth, 1)
        print(
            f"limit at {speed:g} rpm, uneven pitch: {marched:.1f} s by a march, {formed:.1f} s by determinants: "
            f"{formed / marched:.1f}x; depths differ by {abs(depth[0] / other[0] - 1):.0e}"
        )


def memory() -> None:
    """Peak beside the result while computing charts of 400 to 400 000 points."""
    tool = two_modes()
    for speeds, depths in ((4, 100), (4, 1000), (400, 100), (400, 1000)):
        tracemalloc.start()
        chart = largest_multipliers(tool, CUTTING, np.linspace(4e3, 2e4, speeds), np.linspace(1e-5, 4e-3, depths))
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        beside, own = (peak - chart.nbytes) / 1e6, chart.nbytes / 1e6
        print(f"peak memory, {speeds} x {depths} points: {beside:.2f} MB beside a result of {own:.2f} MB")


def boundary() -> None:
    for method in ("collocation", "multi-frequency", "zero-order"):
        seconds, _ = timed(lambda m=method: stability_lobes(two_modes(), CUTTING, SPEEDS, m).depth, 1)
        print(f"boundary at {len(SPEEDS)} speeds, slot, three teeth: {seconds:.2f} s by {method}")


def developed() -> None:
    """Milling at an amplitude of the guide mill: all speeds at once beside one after the other."""
    library = Path(__file__).parents[2] / "machines" / "library"
    machine = read_machine(library / "guide_mill.toml").with_joint("guide", read_joint(library / "guide.joint.toml"))
    speeds = np.linspace(3000.0, 12000.0, 32)
    lobes_at_amplitude(machine, speeds[:1], 5e-6)  # what all speeds share
    together, depth = timed(lambda: lobes_at_amplitude(machine, speeds, 5e-6).depth, 1)
    apart, other = timed(lambda: np.array([lobes_at_amplitude(machine, [s], 5e-6).depth[0] for s in speeds]), 1)
    print(
        f"{len(speeds)} speeds at 5 um, {1e3 * together / len(speeds):.0f} ms each at once: {apart / together:.2f} "
        f"times as long one after the other; depths differ by {np.max(np.abs(depth / other - 1)):.0e}"
    )


def timed(work: Callable[[], Array], repeats: int) -> tuple[float, Array]:
    seconds = []
    for _ in range(repeats):
        start = time.process_time()
        result = work()
        seconds.append(time.process_time() - start)
    return min(seconds), result


def main() -> None:
    for directions in (1, 2):
        chart(directions)
    uneven_chart()
    slow_uneven()
    memory()
    boundary()
    developed()
    fast, depth = timed(vectorised, 9)
    slow, check = timed(one_by_one, 1)
    print(f"400 speeds, zero-order: {fast * 1e3:.1f} ms vectorised, {slow * 1e3:.0f} ms one by one: {slow / fast:.0f}x")
    print(f"largest relative difference of the depths: {np.max(np.abs(depth / check - 1)):.1e}")


if __name__ == "__main__":
    main()
