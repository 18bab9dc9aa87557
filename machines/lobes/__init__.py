"""Stability lobes: how deep a machine can cut before it chatters."""

from .chart import LobeBranch, StabilityLobes
from .cutting import Cutting
from .power_law import depth_ratio
from .solve import METHODS, stability_lobes
from .threshold import AmplitudeLimits, Cycle, Turn, amplitude_limits
from .tool_model import ToolModel
from .tool_point import Receptance, ToolPoint, tool_point
from .turning import minimum_depth_of_mode, notch_delays
from .uncertainty import Band, frf_band, lobe_band, measured_lobe_band
from .unstable_depths import UnstableDepths, unstable_depths
from .witness import Witness, witness

__all__ = [
    "METHODS",
    "AmplitudeLimits",
    "Band",
    "Cutting",
    "Cycle",
    "LobeBranch",
    "Receptance",
    "StabilityLobes",
    "ToolModel",
    "ToolPoint",
    "Turn",
    "UnstableDepths",
    "Witness",
    "amplitude_limits",
    "depth_ratio",
    "frf_band",
    "lobe_band",
    "measured_lobe_band",
    "minimum_depth_of_mode",
    "notch_delays",
    "stability_lobes",
    "tool_point",
    "unstable_depths",
    "witness",
]
