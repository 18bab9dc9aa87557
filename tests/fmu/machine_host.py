"""Machine FMUs as a client sees them: held forces in co-simulation, rates for an own solver in model exchange."""

from __future__ import annotations

import ctypes
import functools
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from unittest import mock

import numpy as np
from fmpy.fmi2 import FMU2Model, FMU2Slave
from fmpy.fmi3 import FMU3Model, FMU3Slave
from fmpy.model_description import read_model_description
from scipy.integrate import solve_ivp

from fmu.export import export_fmu
from fmu.members.archive import read_archive, unpack
from fmu.playback.reference import ReferenceRun, reference_run
from fmu.system.step_limit import Range
from fmu.system.system import System
from jointlib.arrays import Array
from jointlib.io.joint_file import read_joint
from jointlib.joint import Joint
from machines import Machine, read_machine

LIBRARY = Path(__file__).parents[2] / "machines" / "library"
_FOLDER = tempfile.TemporaryDirectory(prefix="jointlib-test-")
_MADE: list[tuple[object, int, Path]] = []
_RUNS: list[tuple[object, ReferenceRun]] = []


@functools.cache
def library_machine(name: str) -> Machine:
    """A shipped machine; the guide that guide_mill identifies is that of the paper."""
    machine = read_machine(LIBRARY / f"{name}.toml")
    if name != "guide_mill":
        return machine
    return machine.with_joint("guide", read_joint(LIBRARY / "guide.joint.toml"))


def unpacked(model: Joint | Machine | System, fmi: int) -> Path:
    """The folder of the native FMU, made once."""
    for known, version, folder in _MADE:
        if known is model and version == fmi:
            return folder
    folder = Path(_FOLDER.name) / str(len(_MADE))

    def once(system: System, over: Range | None) -> ReferenceRun:
        """Both versions of a model have the same reference run, which takes longest."""
        runs = [run for known, run in _RUNS if known is model]
        if not runs:
            runs.append(reference_run(system, over))
            _RUNS.append((model, runs[0]))
        return runs[0]

    with mock.patch("fmu.export.reference_run", once):
        file = export_fmu(model, folder.with_suffix(".fmu"), fmi=fmi, runtime="c").file
    unpack(file, read_archive(file), folder)
    _MADE.append((model, fmi, folder))
    return folder


class _Instance:
    """Variables by name."""

    def __init__(
        self,
        folder: Path,
        fmi: int,
        exchange: bool,
        start: Mapping[str, float],
        tolerance: float | None = None,
        forces_at: Callable[[float], Mapping[str, float]] | None = None,
    ) -> None:
        self.fmi, self.read = fmi, read_model_description(str(folder))
        self.place = {str(v.name): v.valueReference for v in self.read.modelVariables}
        interface = self.read.modelExchange if exchange else self.read.coSimulation
        kind = {(2, True): FMU2Model, (2, False): FMU2Slave, (3, True): FMU3Model, (3, False): FMU3Slave}[fmi, exchange]
        self.fmu = kind(
            guid=self.read.guid,
            modelIdentifier=interface.modelIdentifier,
            unzipDirectory=str(folder),
            instanceName="machine",
        )
        if forces_at is None:
            self.fmu.instantiate()
        else:
            self.fmu.instantiate(intermediateUpdate=lambda _where, time, *_: self.put(forces_at(time)))
        if fmi == 2:
            self.fmu.setupExperiment(tolerance=tolerance)
            self.fmu.enterInitializationMode()
        else:
            self.fmu.enterInitializationMode(tolerance=tolerance)
        self.put(start)
        self.fmu.exitInitializationMode()

    def put(self, values: Mapping[str, float]) -> None:
        write = self.fmu.setReal if self.fmi == 2 else self.fmu.setFloat64
        write([self.place[name] for name in values], list(values.values()))

    def get(self, names: Sequence[str]) -> Array:
        read = self.fmu.getReal if self.fmi == 2 else self.fmu.getFloat64
        return np.array(read([self.place[name] for name in names]))


class Stepping(_Instance):
    """Co-simulation."""

    def __init__(
        self,
        folder: Path,
        fmi: int,
        start: Mapping[str, float] | None = None,
        tolerance: float | None = None,
        forces_at: Callable[[float], Mapping[str, float]] | None = None,
    ) -> None:
        """``forces_at`` answers an FMU of FMI 3.0 that asks within a step."""
        super().__init__(folder, fmi, False, start or {}, tolerance, forces_at)
        self.time = 0.0

    def step(self, forces: Mapping[str, float], h: float) -> None:
        self.put(forces)
        self.fmu.doStep(self.time, h)
        self.time += h

    def run(self, forces: Mapping[str, Array], h: float, outputs: Sequence[str]) -> Array:
        """Outputs behind each step of h seconds at held forces."""
        rows = []
        for values in zip(*forces.values(), strict=True):
            self.step(dict(zip(forces, values, strict=True)), h)
            rows.append(self.get(outputs))
        return np.array(rows)


class Exchange(_Instance):
    """Model exchange, past the first event."""

    def __init__(self, folder: Path, fmi: int, start: Mapping[str, float] | None = None) -> None:
        super().__init__(folder, fmi, True, start or {})
        self.settle()
        self.rates = [str(u.variable.name) for u in self.read.derivatives]
        self.states = [str(u.variable.derivative.name) for u in self.read.derivatives]
        self.n = len(self.states)
        self._read = self.fmu.getDerivatives if fmi == 2 else self.fmu.getContinuousStateDerivatives

    def settle(self) -> None:
        """One event."""
        (self.fmu.newDiscreteStates if self.fmi == 2 else self.fmu.updateDiscreteStates)()
        self.fmu.enterContinuousTimeMode()

    def at(self, x: Array) -> None:
        self.fmu.setContinuousStates((ctypes.c_double * self.n)(*x), self.n)

    def slope(self, _time: float, x: Array) -> Array:
        """Rates of the states, for a solver."""
        self.at(x)
        rates = (ctypes.c_double * self.n)()
        self._read(rates, self.n)
        return np.array(rates)

    def run(self, forces: Mapping[str, Array], h: float, outputs: Sequence[str]) -> Array:
        """Outputs behind each step of h seconds at held forces, integrated by scipy."""
        x, rows = np.zeros(self.n), []
        for values in zip(*forces.values(), strict=True):
            self.put(dict(zip(forces, values, strict=True)))
            x = solve_ivp(self.slope, (0.0, h), x, method="DOP853", rtol=1e-10, atol=1e-18).y[:, -1]
            self.at(x)
            rows.append(self.get(outputs))
        return np.array(rows)
