"""Joints whose parameters follow conditions, courses of these, and the forces by laws and by FMUs."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from host import path, running
from machine_host import Stepping, unpacked
from tools import require

from fmu.export import export_fmu
from fmu.system.system import system_of_joint
from jointlib.arrays import Array
from jointlib.joint import Joint
from jointlib.law import Motion
from jointlib.laws.bouc_wen import BoucWen
from jointlib.laws.dahl import Dahl
from jointlib.laws.gap import Gap
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.laws.iwan import Iwan
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.lugre import LuGre
from jointlib.laws.maxwell import Maxwell
from jointlib.laws.viscous import Viscous
from jointlib.modulation import Modulation
from jointlib.parameter import Role

LAG = 3e-4
VOLTAGE = Modulation(Role.SLIP_FORCE, "voltage", 1.0, ((0.0, 0.4), (1.0, 1.0), (3.0, 1.7)))
WARMTH = Modulation(Role.STIFFNESS, "temperature", 293.0, ((283.0, 1.1), (293.0, 1.0), (313.0, 0.8)))
COLD = Modulation(Role.SLIP_FORCE, "temperature", 293.0, ((283.0, 1.3), (313.0, 0.4)))
BALLS = Modulation(Role.PRELOAD, "position", 0.0, ((0.0, 1.0), (1e-3, 1.2), (3e-3, 0.9)), period=4e-3)
REMEMBERING = (
    Jenkins(4e7, 36.0, 1e-7),
    BoucWen(3e7, 20.0, 2.0, 0.5),
    Dahl(3e7, 25.0),
    Iwan((2e7, 1e7), (20.0, 30.0)),
    LuGre(4e7, 300.0, 36.0, 50.0, 0.02),
    Maxwell(3e7, 500.0),
)
OF_ALL_KINDS = Joint((*REMEMBERING, HertzGuide(630.0, 3.9e-8), Gap(1e7, 4e-6), Viscous(500.0)), "of all kinds")
EVERY = replace(OF_ALL_KINDS, modulations=(VOLTAGE, WARMTH, COLD, BALLS))
LATE = replace(OF_ALL_KINDS, name="late", modulations=(replace(VOLTAGE, lag=LAG), WARMTH))
SPRING = Joint((Linear(1e7),), "spring", modulations=(replace(WARMTH, lag=LAG),))
PLAIN = replace(EVERY, modulations=())
STEP = 2e-5
_FOLDER = tempfile.TemporaryDirectory(prefix="jointlib-test-")
_MADE: list[tuple[Joint, Path]] = []


def conditions(joint: Joint) -> list[str]:
    return [c.kind for c in system_of_joint(joint).conditions]


def stepped(joint: Joint, at: Sequence[Mapping[str, float]]) -> Array:
    """Force in N after each step along :func:`path`, a joint of its own at every sample."""
    z, v = path()
    state, force = joint.at(at[0]).initial_state(z[0]), np.empty(z.shape)
    for i, each in enumerate(at):
        force[i], state = joint.at(each).step(Motion(z[i], v[i], STEP if i else 0.0), state)
    return force


def course(joint: Joint, how: str) -> list[dict[str, float]]:
    """Conditions along :func:`path`: ramps through the tables and beyond their ends, or jumps."""
    n = len(path()[0])
    ends = {"voltage": (-0.5, 3.5), "temperature": (280.0, 315.0), "position": (-7e-3, 9e-3)}
    rng = np.random.default_rng(5)
    out = {}
    for k, name in enumerate(conditions(joint)):
        low, high = ends[name]
        swept = np.interp(np.linspace(k, k + 4, n) % 2, [0, 1, 2], [low, high, low])
        out[name] = swept if how == "ramps" else np.repeat(rng.uniform(low, high, n // 7 + 1), 7)[:n]
    return [dict(zip(out, row, strict=True)) for row in np.array(list(out.values())).T.tolist()]


def in_python(joint: Joint) -> Path:
    """The FMU with the Python runtime, made once."""
    known = [file for each, file in _MADE if each is joint]
    if not known:
        known.append(export_fmu(joint, Path(_FOLDER.name) / f"{len(_MADE)}.fmu", runtime="python").file)
        _MADE.append((joint, known[0]))
    return known[0]


def by_fmu(joint: Joint, at: Sequence[Mapping[str, float]], runtime: str, fmi: int, folder: Path) -> Array:
    """The same by an FMU in FMPy."""
    z, v = path()
    rows = [{"displacement": z[i], "velocity": v[i], **each} for i, each in enumerate(at)]
    if runtime == "python":
        with running([in_python(joint)], folder) as (slave,):
            slave.fmu.setupExperiment()
            slave.fmu.enterInitializationMode()
            slave.put(rows[0])
            slave.fmu.exitInitializationMode()
            force = [slave.get("force")]
            for i, row in enumerate(rows[1:]):
                slave.put(row)
                slave.fmu.doStep(i * STEP, STEP)
                force.append(slave.get("force"))
            return np.array(force)
    require("cc")
    native = Stepping(unpacked(joint, fmi), fmi, rows[0])
    force = [float(native.get(["force"])[0])]
    for row in rows[1:]:
        native.step(row, STEP)
        force.append(float(native.get(["force"])[0]))
    return np.array(force)
