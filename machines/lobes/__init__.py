"""Stability lobes: how deep a machine can cut before it chatters."""

from .chart import LobeBranch, StabilityLobes
from .cutting import Cutting
from .solve import METHODS, stability_lobes
from .tool_model import ToolModel
from .tool_point import Receptance, ToolPoint, tool_point
from .turning import minimum_depth_of_mode, notch_delays

__all__ = [
    "METHODS",
    "Cutting",
    "LobeBranch",
    "Receptance",
    "StabilityLobes",
    "ToolModel",
    "ToolPoint",
    "minimum_depth_of_mode",
    "notch_delays",
    "stability_lobes",
    "tool_point",
]
