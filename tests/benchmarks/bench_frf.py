"""Forced response of machines of many contacts: lines shared among peaks, beside lines of its own for each peak.

``python tests/benchmarks/bench_frf.py [MACHINE --force N]``; without a machine the column mill of the library. Both
follow the same curves; the second is what a line list without sharing costs. Times are those of one process.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from unittest.mock import patch

import numpy as np

from machines import read_machine
from machines.continuation import line_by_line
from machines.forced_response.response import response

MILL = Path(__file__).parents[2] / "machines" / "library" / "column_mill_a.toml"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("machine", nargs="?", type=Path, default=MILL)
    parser.add_argument("--force", type=float, default=20.0)
    given = parser.parse_args()
    machine = read_machine(given.machine)
    drive = machine.tool_dofs[0]
    found, spent = [], []
    for apart in (line_by_line._APART, 0.0):
        with patch.object(line_by_line, "_APART", apart):
            start = time.process_time()
            found.append(response(machine, given.force, drive=drive))
            spent.append(time.process_time() - start)
    points = [max(sum(len(b.frequency) for b in of_force) for of_force in r.branches) for r in found]
    top = [max(p.amplitude for p in r.peaks) for r in found]
    print(f"{given.machine.name}, {len(machine.flexible)} contacts, {given.force:g} N on {drive}")
    print(f"shared lines: {points[0]} points, {spent[0]:.1f} s; each its own: {points[1]} points, {spent[1]:.1f} s")
    print(f"ratio {spent[1] / spent[0]:.2f}; largest peak differs by {abs(top[0] / top[1] - 1):.1e}")
    assert np.isfinite(top).all()


if __name__ == "__main__":
    main()
