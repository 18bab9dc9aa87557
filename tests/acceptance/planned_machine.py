"""Tests of a machine that follow a plan, integrated in time by the generator of the acceptance suite."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from machine_example import plant
from machine_forces import HIDDEN
from machine_records import Case, _responses, _sized, _with, measure
from machine_steps import NoMotion, equivalent


def measured(folder: Path, plan: dict[str, Any], name: str, seed: int) -> bool:
    """Fill the folder of a plan with responses of the three-joint machine; ``name`` is "place:effect", or empty.

    The size is drawn from one to two times that of the plan. False where nothing of that size, or no motion, is found.
    """
    rng = np.random.default_rng([20261124, seed, *name.encode()])
    test = plan["campaign"]
    forces = np.array(sorted([*test["forces"], test["sealed_force"]]))
    sealed = int(np.searchsorted(forces, test["sealed_force"]))
    declared, lines = plant(), np.array(test["frequency"])
    case = Case(seed, declared, declared, None, "", 0.0, 0.0, lines, forces, tuple(test["responses"]), sealed)
    if name:
        place, what = name.split(":")
        i = next(i for i, joint in enumerate(declared.joints) if joint.name == place)
        joint = declared.joints[i]
        if what == "refit":
            what = str(rng.choice(["preload" if joint.kind == "guide" else "stiffness", "damping"]))
        # The guide of the example has its stiffness in the rows of balls.
        spring = 6 * np.sin(np.pi / 4) ** 2 * 170.0 ** (1 / 3) / 1.38e-7
        base = joint if joint.stiffness else replace(joint, stiffness=spring)
        straight = plant().with_joint(i, base)
        x = equivalent(straight.structure(), 2 * np.pi * lines, np.full(len(lines), forces[-1]))
        z = float(np.max(np.abs(x @ joint.row)))
        made = partial(_with, base, what, float(rng.choice([-1.0, 1.0])), int(rng.integers(2**31)), z, 2 * np.pi * 300)
        wanted = plan["size"] * rng.uniform(1.0, 2.0)
        found = _sized(replace(case, place=place, what=what), i, made, wanted, _responses(declared, case))
        if found is None or found.change < plan["size"]:
            return False
        case = found
    try:
        records = measure(case)
    except NoMotion:
        return False
    for n, force in enumerate(forces):
        for r, response in enumerate(test["responses"]):
            H = records.noisy[n, :, r]
            file = folder / f"{response.replace('.', '_')}_{force:.3g}N.csv"
            np.savetxt(
                file, np.column_stack([lines, H.real, H.imag]), "%.9g", ",", header="frequency,re,im", comments=""
            )
    return True


def ended_as_said(plan: dict[str, Any], name: str, report: Any) -> bool:
    """Whether a trace ended as the plan said: with names that were foreseen, or the right one beside unasked ones."""
    foreseen = set(next(e["named"] for e in plan["ends"] if e["hidden"] == (name or None)))
    verdict = report.verdict.value
    if verdict == "nothing_missing":
        return "nothing" in foreseen
    if verdict in ("partial", "unexplained"):
        return "no name" in foreseen
    asked = {e["hidden"] for e in plan["ends"]} - {None}
    rows = [(report.place, report.chosen.family), *((r.place, r.family) for r in report.rivals)]
    named = {f"{place}:{family}" for place, family in rows}
    return named <= foreseen or (bool(name) and name in named and named & asked <= foreseen)


KNOWN = (*HIDDEN, "refit")
