"""How the response of a machine grows with lines, joints and degrees of freedom; draws docs/growth.png.

The nonlinear solve (Newton's method at all lines, in blocks as `response` takes them) and the receptances it needs,
gains at rest coupled in, are timed apart, in processor time.

Run it: OPENBLAS_NUM_THREADS=1 python tests/benchmarks/bench_growth.py
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import matplotlib
import numpy as np

from machines import Machine
from machines.blocks import blocks
from machines.harmonic_balance.assembly import Assembly
from machines.harmonic_balance.newton import solve
from machines.operating.solutions import caps_of

sys.path.insert(0, str(Path(__file__).parents[1] / "machines"))
from test_large_machines import carriages
from test_several_joints import chain

PICTURE = Path(__file__).parents[2] / "docs" / "growth.png"
LINES, FORCE = 600, 50.0


def fastest(function: Callable[[], object], repeats: int = 7) -> float:
    """Shortest processor time in s."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        function()
        times.append(time.process_time() - start)
    return min(times)


def times(
    machine: Machine, drive: str, lines: int, band: tuple[float, float] = (1000.0, 7000.0)
) -> tuple[float, float]:
    """Seconds for the nonlinear solve and for the receptances that it needs."""
    omega = 2 * np.pi * np.linspace(*band, lines)
    assembly = Assembly(machine, (drive,), (drive,), (float(omega[0]), float(omega[-1])))
    parts, caps = list(blocks(lines, assembly.entries)), caps_of(assembly)
    views = [assembly.at_rest(omega[some]) for some in parts]
    force = np.full(lines, FORCE)

    def solved() -> None:
        for view, some in zip(views, parts, strict=True):
            solve(view, assembly.moving, force[some], caps)

    def formed() -> None:
        for some in parts:
            assembly.at_rest(omega[some])

    return fastest(solved), fastest(formed)


def slope(x: list[int], y: list[float]) -> float:
    """Exponent of y over x."""
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


def main() -> None:
    """Measure, print and draw."""
    matplotlib.use("Agg")
    from matplotlib import pyplot

    lines = [300, 600, 1200, 2400, 4800, 9600]
    joints = [2, 5, 10, 20, 40, 80, 160, 300]
    rows = [12, 24, 48, 96, 192]
    dofs = [25, 50, 100, 200, 400]
    by_lines = [times(chain(50, 5), "row.m1", n) for n in lines]
    by_joints = [times(chain(max(50, n + 10), n), "row.m1", LINES) for n in joints]
    by_rows = [times(carriages(n), "a.uz", LINES, (5500.0, 6500.0)) for n in rows]
    by_dofs = [times(chain(n, 5), "row.m1", LINES) for n in dofs]
    panels = (
        ("frequencies (50 masses, 5 joints)", [(lines, by_lines, "")]),
        ("joints (600 frequencies)", [(joints, by_joints, ", in a chain"), (rows, by_rows, ", between two bodies")]),
        ("masses (600 frequencies, 5 joints)", [(dofs, by_dofs, "")]),
    )
    figure, axes = pyplot.subplots(1, 3, figsize=(12.0, 3.8), layout="constrained", sharey=True)
    axes[0].set(ylim=(0.5, 3000.0))
    for ax, (word, curves) in zip(axes, panels, strict=True):
        for k, (x, y, what) in enumerate(curves):
            solved, formed = ([1e3 * pair[i] for pair in y] for i in (0, 1))
            print(f"{word}{what}: {x}")
            print(f"  nonlinear solve [ms] {[f'{v:.1f}' for v in solved]}, exponent {slope(x, solved):.2f}")
            print(f"  receptances     [ms] {[f'{v:.1f}' for v in formed]}, exponent {slope(x, formed):.2f}")
            style = "-" if k == 0 else "--"
            ax.loglog(x, solved, f"o{style}", color="C0", label=f"nonlinear solve{what}")
            ax.loglog(x, formed, f"s{style}", color="C1", label=f"receptances{what}", markersize=4)
        ax.set(xlabel=word)
        ax.grid(True, which="both", linewidth=0.3)
        first = curves[0]
        ax.loglog(
            first[0], [1e3 * first[1][0][0] * v / first[0][0] for v in first[0]], ":", color="0.5", label="linear"
        )
        ticks = sorted({v for x, _, _ in curves for v in x} - {12, 24, 48, 96, 192})
        ax.set_xticks(ticks, [str(v) for v in ticks], fontsize=8)
        ax.set_xticks([], minor=True)
        ax.legend(fontsize=7, handlelength=3.0, loc="upper left")
    axes[0].set(ylabel="processor time [ms]")
    figure.savefig(PICTURE, dpi=110, metadata={"Software": None})


if __name__ == "__main__":
    main()
