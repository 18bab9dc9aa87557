"""Machines: components and joints assembled by nonlinear receptance coupling, their response and their lobes."""

import sys

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
from .forced_response.response import AmplitudeMap, ArcLength, Newton, Response, response
from .harmonic_balance.assembly import mean_displacement
from .harmonic_balance.linear_check import LinearCheck, linear_check
from .loop.report import MachineTrace
from .loop.trace import trace_frfs, trace_machine
from .model.machine import Machine
from .modes.natural_modes import NaturalModes, natural_modes
from .moved import Moved
from .operating.constant_amplitude import ConstantAmplitude, constant_amplitude
from .operating.operating_point import OperatingPoint, frozen_receptance, operating_point
from .operating.peaks import Peak
from .road.piece import Piece, Step, steps
from .road.run import Run, run
from .shapes.profile import Material
from .shapes.segment import Segment
from .statics.statics import StaticPoint, static_point

sys.meta_path.append(Moved())

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
    "constant_amplitude",
    "couple",
    "frozen_receptance",
    "linear_check",
    "lobes_at_amplitude",
    "lobes_over_range",
    "mean_displacement",
    "natural_modes",
    "operating_point",
    "read_machine",
    "response",
    "run",
    "stability_lobes",
    "static_point",
    "steps",
    "trace_frfs",
    "trace_machine",
]
