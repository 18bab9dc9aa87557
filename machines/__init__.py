"""Machines: components and joints assembled by nonlinear receptance coupling, their response and their lobes."""

from .assembly import mean_displacement
from .component import Component, SecondOrder
from .connection import Connection, Identify
from .coupling import couple
from .files import read_machine
from .linear import LinearCheck, linear_check
from .lobes import Cutting, StabilityLobes, stability_lobes
from .lobes.amplitude import lobes_at_amplitude
from .lumped import Lumped
from .machine import Machine
from .modal import Modal
from .operating import OperatingPoint, frozen_receptance, operating_point
from .peaks import Peak
from .response import AmplitudeMap, Newton, Response, response
from .rigid import Rigid
from .static_load import StaticLoad
from .statics import StaticPoint, static_point

__all__ = [
    "AmplitudeMap",
    "Component",
    "Connection",
    "Cutting",
    "Identify",
    "LinearCheck",
    "Lumped",
    "Machine",
    "Modal",
    "Newton",
    "OperatingPoint",
    "Peak",
    "Response",
    "Rigid",
    "SecondOrder",
    "StabilityLobes",
    "StaticLoad",
    "StaticPoint",
    "couple",
    "frozen_receptance",
    "linear_check",
    "lobes_at_amplitude",
    "mean_displacement",
    "operating_point",
    "read_machine",
    "response",
    "stability_lobes",
    "static_point",
]
