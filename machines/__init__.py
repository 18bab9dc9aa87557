"""Machines: components and joints assembled by nonlinear receptance coupling, their response and their lobes."""

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

from .moved import Moved

if TYPE_CHECKING:
    from .answers.check import check
    from .answers.compare import compare
    from .answers.explore import explore
    from .answers.frf import frf
    from .answers.inspect import inspect
    from .answers.lobes import lobes
    from .answers.modes import modes
    from .answers.new import new
    from .answers.plan import plan
    from .answers.stickout import stickout
    from .answers.study import study
    from .answers.trace import trace
    from .answers.uncouple import uncouple
    from .components.beam import Beam
    from .components.component import Component, FirstOrder, SecondOrder
    from .components.connection import Connection, Identify
    from .components.lumped import Lumped
    from .components.matrices import Matrices
    from .components.measured import Measured
    from .components.modal import Modal
    from .components.rigid import Rigid
    from .components.state_space import StateSpace
    from .components.static_load import StaticLoad
    from .coupling.coupling import couple
    from .cutting.amplitude.frozen_lobes import lobes_at_amplitude
    from .cutting.amplitude.lobes_over_range import lobes_over_range
    from .cutting.process.chart import StabilityLobes
    from .cutting.process.cutting import Cutting
    from .cutting.rest.solve import stability_lobes
    from .files.machine_file import read_machine
    from .forced_response.methods import AmplitudeMap, ArcLength, Newton
    from .forced_response.response import Response, response
    from .harmonic_balance.linear_check import LinearCheck, linear_check
    from .harmonic_balance.mean_motions import mean_displacement
    from .loop.report import MachineTrace
    from .loop.trace import trace_frfs, trace_machine
    from .model.machine import Machine
    from .modes.natural_modes import NaturalModes, natural_modes
    from .operating.constant_amplitude import ConstantAmplitude, constant_amplitude
    from .operating.operating_point import OperatingPoint, frozen_receptance, operating_point
    from .operating.peaks import Peak
    from .road.piece import Piece, Step, steps
    from .road.run import Run, run
    from .shapes.profile import Material
    from .shapes.segment import Segment
    from .statics.statics import StaticPoint, static_point

sys.meta_path.append(Moved())

_HOME = {
    "AmplitudeMap": "forced_response.methods",
    "ArcLength": "forced_response.methods",
    "Beam": "components.beam",
    "Component": "components.component",
    "Connection": "components.connection",
    "ConstantAmplitude": "operating.constant_amplitude",
    "Cutting": "cutting.process.cutting",
    "FirstOrder": "components.component",
    "Identify": "components.connection",
    "LinearCheck": "harmonic_balance.linear_check",
    "Lumped": "components.lumped",
    "Machine": "model.machine",
    "MachineTrace": "loop.report",
    "Material": "shapes.profile",
    "Matrices": "components.matrices",
    "Measured": "components.measured",
    "Modal": "components.modal",
    "NaturalModes": "modes.natural_modes",
    "Newton": "forced_response.methods",
    "OperatingPoint": "operating.operating_point",
    "Peak": "operating.peaks",
    "Piece": "road.piece",
    "Response": "forced_response.response",
    "Rigid": "components.rigid",
    "Run": "road.run",
    "SecondOrder": "components.component",
    "Segment": "shapes.segment",
    "StabilityLobes": "cutting.process.chart",
    "StateSpace": "components.state_space",
    "StaticLoad": "components.static_load",
    "StaticPoint": "statics.statics",
    "Step": "road.piece",
    "check": "answers.check",
    "constant_amplitude": "operating.constant_amplitude",
    "couple": "coupling.coupling",
    "frf": "answers.frf",
    "frozen_receptance": "operating.operating_point",
    "inspect": "answers.inspect",
    "linear_check": "harmonic_balance.linear_check",
    "lobes_at_amplitude": "cutting.amplitude.frozen_lobes",
    "lobes_over_range": "cutting.amplitude.lobes_over_range",
    "mean_displacement": "harmonic_balance.mean_motions",
    "natural_modes": "modes.natural_modes",
    "new": "answers.new",
    "operating_point": "operating.operating_point",
    "plan": "answers.plan",
    "read_machine": "files.machine_file",
    "response": "forced_response.response",
    "run": "road.run",
    "stability_lobes": "cutting.rest.solve",
    "static_point": "statics.statics",
    "steps": "road.piece",
    "stickout": "answers.stickout",
    "trace": "answers.trace",
    "trace_frfs": "loop.trace",
    "trace_machine": "loop.trace",
    "uncouple": "answers.uncouple",
}
"""Where each name lives: its module is imported when it is first asked for, so that `--help` is there at once."""

_ROOMS = ("compare", "explore", "lobes", "modes", "study")
"""Verbs whose function is the module of that name, see `machines.verb_room`."""


def __getattr__(name: str) -> Any:
    if name in _ROOMS:
        return import_module(f".{name}", __name__)
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f".{_HOME[name]}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME, *_ROOMS})


__all__ = [
    "AmplitudeMap",
    "ArcLength",
    "Beam",
    "Component",
    "Connection",
    "ConstantAmplitude",
    "Cutting",
    "FirstOrder",
    "Identify",
    "LinearCheck",
    "Lumped",
    "Machine",
    "MachineTrace",
    "Material",
    "Matrices",
    "Measured",
    "Modal",
    "NaturalModes",
    "Newton",
    "OperatingPoint",
    "Peak",
    "Piece",
    "Response",
    "Rigid",
    "Run",
    "SecondOrder",
    "Segment",
    "StabilityLobes",
    "StateSpace",
    "StaticLoad",
    "StaticPoint",
    "Step",
    "check",
    "compare",
    "constant_amplitude",
    "couple",
    "explore",
    "frf",
    "frozen_receptance",
    "inspect",
    "linear_check",
    "lobes",
    "lobes_at_amplitude",
    "lobes_over_range",
    "mean_displacement",
    "modes",
    "natural_modes",
    "new",
    "operating_point",
    "plan",
    "read_machine",
    "response",
    "run",
    "stability_lobes",
    "static_point",
    "steps",
    "stickout",
    "study",
    "trace",
    "trace_frfs",
    "trace_machine",
    "uncouple",
]
