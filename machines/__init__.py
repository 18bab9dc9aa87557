"""Machines: components and joints assembled by nonlinear receptance coupling, their response and their lobes."""

from .assembly import mean_displacement
from .beam import Beam
from .component import Component, FirstOrder, SecondOrder
from .connection import Connection, Identify
from .constant_amplitude import ConstantAmplitude, constant_amplitude
from .coupling import couple
from .files import read_machine
from .linear import LinearCheck, linear_check
from .lobes import Cutting, StabilityLobes, stability_lobes
from .lobes.amplitude import lobes_at_amplitude
from .lobes.lowest import lobes_over_range
from .loop.report import MachineTrace
from .loop.trace import trace_frfs, trace_machine
from .lumped import Lumped
from .machine import Machine
from .matrices import Matrices
from .measured import Measured
from .modal import Modal
from .natural_modes import NaturalModes, natural_modes
from .operating import OperatingPoint, frozen_receptance, operating_point
from .peaks import Peak
from .profile import Material
from .response import AmplitudeMap, ArcLength, Newton, Response, response
from .rigid import Rigid
from .segment import Segment
from .state_space import StateSpace
from .static_load import StaticLoad
from .statics import StaticPoint, static_point

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
    "Response",
    "Rigid",
    "SecondOrder",
    "Segment",
    "StabilityLobes",
    "StateSpace",
    "StaticLoad",
    "StaticPoint",
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
    "stability_lobes",
    "static_point",
    "trace_frfs",
    "trace_machine",
]
