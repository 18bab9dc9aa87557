"""Which suspects a machine has."""

from __future__ import annotations

import numpy as np

from ..cutting.process.cutting import Cutting
from .doubted_modes import JointSlip, MissingMode, ModeDamping, ModeFrequency, SpindleSoftening
from .sampled_tool import SampledTool
from .suspects import Coefficient, ProcessDamping, RunOut, Suspect


def suspects_of(
    tool: SampledTool, cutting: Cutting, fastest: float, usual: float, heard: float = 0.0
) -> tuple[list[Suspect], list[dict[str, str]]]:
    """Those that can be told apart on this machine, and what cannot be decided with the reason.

    ``fastest`` is the highest speed of the cuts in rpm, ``usual`` a depth in their middle, m, and ``heard`` the highest
    chatter frequency in Hz.
    """
    found: list[Suspect] = [Coefficient()]
    undecided = []
    if cutting.diameter is not None:
        found.append(ProcessDamping())
    else:
        undecided.append(
            {"family": "process-damping", "needs": "diameter in [cutting]: it goes with the cutting speed"}
        )
    if not tool.modal:
        for family in ("mode-frequency", "spindle-softening", "mode-damping", "missing-mode", "joint-slip"):
            undecided.append({"family": family, "needs": "a tool that is known by its modes, not on lines alone"})
        return found, undecided
    modes = tool.felt()
    for mode in modes:
        at = tool.frequency(mode)
        found += [ModeFrequency(mode, at), SpindleSoftening(mode, at, fastest), ModeDamping(mode, at)]
    ends = tool.frequency(modes[0]), tool.frequency(modes[-1])
    for axis, name in enumerate(tool.axes):
        peak = np.median(np.abs(tool.residue[:, modes, axis, axis]) / np.abs(tool.poles[:, modes].real), axis=0)
        found.append(MissingMode(axis, name, *ends, float(np.max(peak)), heard))
    if cutting.process != "milling" or cutting.pitch is not None or cutting.helix is not None:
        for family in ("joint-slip", "run-out"):
            undecided.append({"family": family, "needs": "milling with even, straight teeth"})
        return found, undecided
    found += [JointSlip(mode, tool.frequency(mode), usual) for mode in modes]
    if cutting.cuts_per_revolution > 1:
        found.append(RunOut(cutting.cuts_per_revolution))
    return found, undecided
