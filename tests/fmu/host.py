"""Our FMUs as a Python client sees them: exported once for all tests, run in this process by FMPy."""

from __future__ import annotations

import functools
import sys
import tempfile
import zipfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave
from fmpy.model_description import ModelDescription, read_model_description
from samples import KAPPA, LAWS

from fmu.export import Export, export_fmu
from jointlib.arrays import Array
from jointlib.joint import Joint
from jointlib.law import Motion
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.viscous import Viscous

__all__ = ["GUIDE", "JOINTS", "FMICallException", "Running", "exported", "label", "law_force", "path", "running"]

GUIDE = Joint((HertzGuide(630.0, KAPPA), Viscous(503.0), Coulomb(20.0), Jenkins(4e7, 36.0)), "guide")
"""A guide with every kind of part: stiff, damped, rubbing, remembering."""
JOINTS = (*(Joint((law,), f"{law.kind} {i}") for i, law in enumerate(LAWS) if law.in_time), GUIDE)
_FOLDER = tempfile.TemporaryDirectory(prefix="jointlib-test-")


def label(joint: Joint) -> str:
    """Short name for a test."""
    return joint.name.replace(" ", "-")


@functools.cache
def _exported(number: int) -> Export:
    return export_fmu(JOINTS[number], Path(_FOLDER.name) / f"{number}.fmu", runtime="python")


def exported(joint: Joint) -> Export:
    """The export of one of JOINTS."""
    return _exported(JOINTS.index(joint))


def path() -> tuple[Array, Array]:
    """Displacement (m) and velocity (m/s): rest, reversals past lift-off (4.1 µm), creep, jumps, reversed motion."""
    rng = np.random.default_rng(20)
    z = np.concatenate(
        [np.zeros(5), 9e-6 * np.sin(np.linspace(0, 14, 150)), 5e-6 + np.zeros(5), rng.uniform(-8e-6, 8e-6, 100)]
    )
    v = np.concatenate([np.zeros(5), rng.normal(0, 0.1, 150), np.zeros(5), rng.uniform(-2e-3, 2e-3, 100)])
    return z, v


def law_force(joint: Joint, z: Array, v: Array, h: float) -> Array:
    """Force of the Python law in N after each step of h seconds, the virgin state at z[0]."""
    state, force = joint.initial_state(z[0]), np.empty(z.shape)
    force[0] = joint.step(Motion(z[0], v[0]), state)[0]
    for i in range(1, len(z)):
        force[i], state = joint.step(Motion(z[i], v[i], h), state)
    return force


class Running:
    """One instance; variables by name."""

    def __init__(self, fmu: FMU2Slave, description: ModelDescription) -> None:
        self.fmu, self.description = fmu, description
        self.reference = {v.name: v.valueReference for v in description.modelVariables}
        self.time = 0.0

    def get(self, name: str) -> float:
        (value,) = self.fmu.getReal([self.reference[name]])
        return float(value)

    def set(self, **values: float) -> None:
        self.put(values)

    def put(self, values: dict[str, float]) -> None:
        self.fmu.setReal([self.reference[name] for name in values], list(values.values()))

    def initialize(self, displacement: float = 0.0, velocity: float = 0.0) -> None:
        self.fmu.setupExperiment()
        self.fmu.enterInitializationMode()
        self.set(displacement=displacement, velocity=velocity)
        self.fmu.exitInitializationMode()

    def step(self, displacement: float, velocity: float, h: float = 1e-5) -> float:
        self.set(displacement=displacement, velocity=velocity)
        self.fmu.doStep(self.time, h)
        self.time += h
        return self.get("force")

    def run(self, z: Array, v: Array, h: float) -> Array:
        self.initialize(z[0], v[0])
        first = self.get("force")
        return np.array([first, *(self.step(z[i], v[i], h) for i in range(1, len(z)))])


@contextmanager
def running(files: Sequence[Path], folder: Path) -> Iterator[list[Running]]:
    """Instances of FMUs in this process, in FMPy."""
    # The slaves then use this pythonfmu, not the copy in a folder that the test deletes.
    import pythonfmu  # noqa: F401

    before = list(sys.path)
    instances = []
    for i, file in enumerate(files):
        unpacked = folder / str(i)
        with zipfile.ZipFile(file) as archive:
            archive.extractall(unpacked)
        description = read_model_description(str(unpacked), validate=False)
        identifier = description.coSimulation.modelIdentifier
        fmu = FMU2Slave(guid=description.guid, modelIdentifier=identifier, unzipDirectory=str(unpacked))
        fmu.instantiate(loggingOn=True)
        instances.append(Running(fmu, description))
    try:
        yield instances
    finally:
        for instance in instances:
            instance.fmu.freeInstance()
        sys.path[:] = before
