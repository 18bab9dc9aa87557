"""Campaigns that follow a plan, simulated by the generator of the acceptance suite: its formulas, its solver.

What is played is read from the files of the plan; the rig, what is hidden in it and the noise come from here.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import effects
import numpy as np
from generator import Equation, NoMotion, Rig, by_mixture, by_steps, sampled
from numpy.typing import NDArray

Array = NDArray[np.float64]
FINE = 8
MAKERS = {
    "cubic": effects.cubic,
    "quadratic": effects.quadratic,
    "gap": effects.gap,
    "contact-loss": effects.contact_loss,
    "coulomb": effects.coulomb,
    "stribeck": effects.stribeck,
    "hysteresis": effects.hysteresis,
    "quadratic-damping": effects.quadratic_damping,
    "viscous-by-direction": effects.viscous_by_direction,
    "structural-damping": effects.structural_damping,
    "relaxation": effects.relaxation,
}


def played(folder: Path, plan: dict[str, Any]) -> Array:
    """Forces in N on the fine points of one period, (records, points)."""
    table = np.loadtxt(folder / "excitation.csv", delimiter=",", skiprows=1)
    once = table[:, 1:].T
    n = plan["campaign"]["period"]
    return np.asarray(np.fft.irfft(np.fft.rfft(once), n * FINE) * FINE)


def campaign(folder: Path, plan: dict[str, Any], rig: Rig, name: str, seed: int) -> bool:
    """Fill the folder of a plan with records; ``name`` is hidden in the joint, nothing where it is empty.

    Its size is drawn from one to two times that of the plan. False where the rig has no steady motion with it.
    """
    rng = np.random.default_rng([20261123, seed, *name.encode()])
    c = plan["campaign"]
    drive, step = played(folder, plan), 1 / (FINE * c["sample_rate"])
    motion = by_mixture(Equation(rig, drive, step))
    scale = _scale(motion, rig, len(drive), c)
    state = rng.bit_generator.state
    hidden = rig
    if name:
        size, share = plan["size"] * rng.uniform(1.0, 2.0), 0.03
        state = rng.bit_generator.state
        for _ in range(3):
            rng.bit_generator.state = state
            made = MAKERS[name](rng, scale, share)
            hidden = Rig(rig.m1, rig.m2, rig.m3, rig.stiffness, rig.damping, made.hidden, made.dynamic)
            share *= size / _left(made, motion, c, step)
        rng.bit_generator.state = state
        made = MAKERS[name](rng, scale, share)
        hidden = Rig(rig.m1, rig.m2, rig.m3, rig.stiffness, rig.damping, made.hidden, made.dynamic)
        try:
            motion = by_mixture(Equation(hidden, drive, step))
        except NoMotion:
            try:
                motion = by_steps(Equation(hidden, drive, step), 4)
            except NoMotion:
                return False
    periods = c["settle"] + c["periods"]
    shown = {"a1": motion.a1, "a2": motion.a2, "a3": motion.a2, "P": motion.drive}
    names = [*(f"fit_{i + 1}" for i in range(len(c["levels"]))), "sealed", "quiet"]
    for r, record in enumerate(names):
        columns = []
        for channel, x in shown.items():
            clean = np.zeros(c["period"]) if record == "quiet" else sampled(x[r], c["period"])
            noise = plan["noise"][channel] * rng.standard_normal(periods * c["period"])
            columns.append(np.tile(clean, periods) + noise)
        text = np.column_stack(columns)
        np.savetxt(folder / f"{record}.csv", text, "%.8g", ",", header=",".join(shown), comments="")
    return True


def _scale(motion: Any, rig: Rig, records: int, c: dict[str, Any]) -> effects.Scale:
    top = slice(len(c["levels"]) - 2, len(c["levels"]))
    z, v = motion.z[top], motion.v[top]
    return effects.Scale(
        z=float(np.abs(z).max()),
        v=float(np.abs(v).max()),
        v_rms=float(np.sqrt(np.mean(v**2))),
        force=rig.stiffness * float(np.abs(z).max()),
        records=records,
        window=(c["settle"] + c["periods"]) * c["period"] / c["sample_rate"],
        position=np.zeros(records),
        feed=0.0,
    )


def _left(made: effects.Injected, motion: Any, c: dict[str, Any], step: float) -> float:
    """Rms of what is hidden beside spring and damper over that of the joint force, at the top level."""
    r = len(c["levels"]) - 2
    z, v = motion.z[r : r + 1], motion.v[r : r + 1]
    omega = 2 * np.pi * np.fft.rfftfreq(z.shape[1], step)
    f = made.hidden(z, v, step * np.arange(z.shape[1])) + np.fft.irfft(made.dynamic(omega) * np.fft.rfft(z), z.shape[1])
    known = np.array([z[0] / np.std(z), v[0] / np.std(v), np.ones(z.shape[1])])
    left = f[0] - np.linalg.solve(known @ known.T, known @ f[0]) @ known
    return float(np.std(left) / np.std(motion.force[r]))


def ended_as_said(plan: dict[str, Any], name: str, report: Any) -> bool:
    """Whether a trace ended as the plan said: of the effects in question none is named that was not foreseen, and the
    right one is, unless the plan said that it may end unnamed or unseen."""
    foreseen = set(next(e["named"] for e in plan["ends"] if e["hidden"] == (name or None)))
    verdict = report.verdict.value
    if verdict == "nothing_missing":
        return "nothing" in foreseen
    if verdict in ("partial", "unexplained"):
        return "no name" in foreseen
    asked = {e["hidden"] for e in plan["ends"]} - {None}
    named = {report.chosen.family, *(r.family for r in report.rivals)}
    return bool(name) and name in named and named & asked <= foreseen
