"""Depths of a study in which the machine depends on the speed of its spindle."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

from jointlib.arrays import Array
from jointlib.errors import InputError

from ..cutting.amplitude.frozen_lobes import lobes_at_amplitude
from ..cutting.process.chart import StabilityLobes
from ..cutting.process.cutting import Cutting
from ..model.machine import Machine
from ..model.spindle_speed import beyond_speeds


@dataclass(frozen=True, eq=False)
class SpeedDependent:
    """A machine that depends on the speed of its spindle, while its tool point vibrates with ``amplitude`` in m."""

    machine: Machine
    amplitude: float

    def lobes(self, cutting: Cutting, speed: Array, method: str) -> StabilityLobes:
        """Every speed with the machine as it is at that speed, for a cut of a study; `InputError` at unknown ones."""
        if beyond := beyond_speeds(self.machine, speed):
            raise InputError(f"{self.machine.where}: {beyond[0]} Expected speeds of the study within what is known.")
        own = {each.name: getattr(cutting, each.name) for each in fields(cutting) if each.init}
        return lobes_at_amplitude(replace(self.machine, cutting=own), speed, self.amplitude, method)
