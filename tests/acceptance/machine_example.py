"""The records of ``machines/library/three_joints``: the machine of the file with friction in its guide.

    python tests/acceptance/machine_example.py machines/library/three_joints

The numbers of the machine stand here again, so that nothing is shared with the program.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from machine_forces import hidden_coulomb
from machine_records import Case, JointTruth, Plant, Records, measure

_FORCES = np.array([1.0, 3.0, 8.0, 15.0, 20.0])
_SEALED = 3
_FRICTION = 2.0
"""N; rounded where the guide moves slower than some tenths of a millimetre a second."""
_MOTION = (2e-6, 2e-3)
"""m and m/s: what the size of the friction is told for."""


def plant() -> Plant:
    """The machine of the file."""
    mass = np.diag([180.0, 90.0, 25.0, 8.0])
    C, K = np.zeros((4, 4)), np.zeros((4, 4))
    C[0, 0], K[0, 0] = 6800.0, 160e6
    rows = np.array([[-1.0, 1, 0, 0], [0, -1, 1, 0], [0, 0, -1, 1]])
    guide = {"preload": 170.0, "kappa": 1.38e-7}
    joints = (
        JointTruth("foot", "", rows[0], 300e6, 6000.0),
        JointTruth("guide", "", rows[1], 0.0, 1500.0, "guide", guide),
        JointTruth("bearing", "", rows[2], 90e6, 900.0),
    )
    names = ("base", "column", "slide", "spindle")
    return Plant(mass, K, C, joints, "", {f"{n}.x": np.eye(4)[i] for i, n in enumerate(names)}, "spindle.x")


def case() -> Case:
    """What is declared, what there is, and the test."""
    declared = plant()
    guide = replace(declared.joints[1], hidden=hidden_coulomb(_FRICTION, *_MOTION, np.random.default_rng(3)))
    lines = np.round(np.geomspace(60.0, 800.0, 150), 2)
    actual = declared.with_joint(1, guide)
    return Case(5, declared, actual, "guide", "coulomb", _FRICTION, 0.0, lines, _FORCES, ("spindle.x",), _SEALED)


def write(case: Case, records: Records, folder: Path) -> None:
    """A CSV per force; the measurement file that names them stands beside."""
    for i, force in enumerate(case.forces):
        H = records.noisy[i, :, 0]
        table = np.column_stack([case.frequency, H.real, H.imag])
        name = folder / f"tip_{force:.0f}N.csv"
        np.savetxt(name, table, ["%.2f", "%.5e", "%.5e"], ",", header="frequency,re,im", comments="")


if __name__ == "__main__":
    write(case(), measure(case()), Path(sys.argv[1]))
