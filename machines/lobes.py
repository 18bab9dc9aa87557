"""Stability lobes: how deep a machine can cut before it chatters. Called, it does what ``jointlib lobes`` does."""

from .cutting.amplitude.amplitude_limits import AmplitudeLimits, Cycle, Turn, amplitude_limits
from .cutting.amplitude.frozen_modes import multipliers
from .cutting.amplitude.unstable_depths import UnstableDepths, unstable_depths, unstable_depths_of
from .cutting.forced.forced_vibration import forced_vibration
from .cutting.forced.shaken_limits import shaken_limit
from .cutting.in_time.witness import Witness, witness
from .cutting.process.chart import METHODS, LobeBranch, StabilityLobes
from .cutting.process.cutting import Cutting
from .cutting.process.power_law import depth_ratio
from .cutting.process.turning import minimum_depth_of_mode, notch_delays
from .cutting.rest.solve import stability_lobes
from .tool.tool_model import ToolModel
from .tool.tool_point import Receptance, ToolPoint, tool_point
from .uncertainty.lobe_bands import Band, frf_band, lobe_band, measured_lobe_band
from .verb_room import called_as_verb

__path__: list[str] = []
"""Submodules that once stood here are found by `machines.moved`."""

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
    "forced_vibration",
    "frf_band",
    "lobe_band",
    "measured_lobe_band",
    "minimum_depth_of_mode",
    "multipliers",
    "notch_delays",
    "shaken_limit",
    "stability_lobes",
    "tool_point",
    "unstable_depths",
    "unstable_depths_of",
    "witness",
]

called_as_verb(__name__)
