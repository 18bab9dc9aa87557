"""What the modes of a machine come to, in sentences: which one matters, what bends in it, what stiffness would give."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ..indices import Index
from ..model.joint_places import bundles
from .mode_energy import ModeEnergies
from .natural_modes import NaturalModes

if TYPE_CHECKING:
    from .depth_sensitivity import DepthSensitivity

_FIRST = 10
_SHOWN = 1e-2
"""Share of the largest compliance at the tool from which on a mode beyond the first ten is shown."""
_STIFFER = 0.1
_STEEPEST = 10.0
"""Of d ln f/d ln K, which is half where a joint alone holds a mode; beyond it is rounding."""
_MOST = 1.2
"""Times the change by the joint that holds the energy from which on another joint is told beside it."""
_WORTH = 0.005
"""Least relative change that is spoken of."""


def shown_modes(modes: NaturalModes) -> Index:
    """The first ten modes, and those that the tool feels strongly."""
    strong = modes.tool_peak > _SHOWN * np.max(modes.tool_peak, initial=0.0)
    return np.flatnonzero(strong | (np.arange(len(modes.pole)) < _FIRST))


def holders(modes: NaturalModes, energies: ModeEnergies, mode: int) -> dict[str, float]:
    """Shares of the strain energy of a mode by bundle, and by component's own elasticity (its name in brackets)."""
    joints = {
        name: float(np.sum(energies.strain[rows, mode])) for name, rows in bundles(modes.machine.flexible).items()
    }
    inside = zip(modes.machine.components, energies.strain_inside[:, mode], strict=True)
    return joints | {f"({c.name})": float(share) for c, share in inside if np.isfinite(share)}


def dissipaters(modes: NaturalModes, energies: ModeEnergies, mode: int) -> dict[str, float]:
    """Shares of what a mode loses, named as in `holders`."""
    joints = {name: float(np.sum(energies.loss[rows, mode])) for name, rows in bundles(modes.machine.flexible).items()}
    inside = zip(modes.machine.components, energies.loss_inside[:, mode], strict=True)
    return joints | {f"({c.name})": float(share) for c, share in inside if np.isfinite(share)}


def movers(modes: NaturalModes, energies: ModeEnergies, mode: int) -> dict[str, float]:
    """Shares of the kinetic energy of a mode by component; empty where they are not known."""
    if energies.kinetic is None:
        return {}
    pairs = zip(modes.machine.components, energies.kinetic[:, mode], strict=True)
    return {c.name: float(share) for c, share in pairs}


def largest(shares: Mapping[str, float], count: int = 2, least: float = 0.05) -> str:
    """The largest shares as words: ``z_guide 62 %, (column) 20 %``."""
    best = sorted(shares.items(), key=lambda item: -item[1])[:count]
    return ", ".join(f"{name} {percent(share)}" for name, share in best if share >= least)


def percent(share: float) -> str:
    """A share in whole percent."""
    return f"{100 * share:.0f} %"


def leading(modes: NaturalModes, energies: ModeEnergies, depth: DepthSensitivity | None) -> tuple[str, ...]:
    """Which mode matters, what holds its energy, and what more stiffness there would give.

    It is the mode that limits the depth, where there is a cut that chatters, else the one that is most compliant at the
    tool, else the first. For 10 % more stiffness the depth is computed again; the frequency f is carried on, f·1.1^S.
    """
    if not len(modes.pole):
        return ("nothing in this machine swings: no mode has stiffness and mass that oscillate.",)
    peak = modes.tool_peak if modes.machine.tool else np.zeros(len(modes.pole))
    mode = depth.mode if depth is not None else int(np.argmax(peak))
    missed = depth.missed if depth is not None else None
    if depth is not None:
        which = "that limits the depth" if missed is None else "that limits the depth, at no speed of the file,"
    else:
        which = "that the tool feels most" if np.any(peak) else "that comes first"
    found = holders(modes, energies, mode)
    groups = bundles(modes.machine.flexible)
    said = f"the mode at {modes.frequency[mode]:.4g} Hz {which} bends "
    whole = sorted(found.items(), key=lambda item: -item[1])
    in_joints = [name for name, _ in whole if name in groups]
    if whole and whole[0][0] not in groups:
        said += f"{whole[0][0].strip('()')} itself ({percent(whole[0][1])} of its energy)"
        if not in_joints or found[in_joints[0]] < 0.01:
            return (said + ", and no joint holds as much as 1 % of it.",)
        said += f" and, of the joints, {in_joints[0]} most ({percent(found[in_joints[0]])})"
    elif in_joints:
        said += f"{in_joints[0]} ({percent(found[in_joints[0]])} of its energy)"
    else:
        return (said + "no joint.",)
    first = in_joints[0]
    if depth is None:
        slope = float(np.sum(energies.sensitivity[groups[first], mode]))
        if not abs(slope) < _STEEPEST:
            return (f"{said}.",)
        more = (1 + _STIFFER) ** slope - 1
        return (f"{said}: 10 % more stiffness there gives {_frequency(more)}.",)
    more = depth.stiffer(groups[first], _STIFFER) / depth.depth - 1
    sentences = [f"{said}: 10 % more stiffness there gives {_depth(more)}."]
    if missed is not None:
        sentences.append(_at_its_speeds(modes, energies, depth, missed))
    best = max(groups, key=lambda name: abs(float(np.sum(depth.joints[groups[name]]))))
    if best != first:
        most = depth.stiffer(groups[best], _STIFFER) / depth.depth - 1
        if abs(most) > _MOST * abs(more):
            sentences.append(f"The depth depends most on {best}: 10 % more stiffness gives {_depth(most)}.")
    how = "of the zero-order approximation" if depth.method == "zero-order" else "in turning"
    how += f" without the {depth.instead}" if depth.instead else ""
    sentences.append(
        f"The depth is the lowest over all speeds {how}, {_joints(depth)}: {depth.depth * 1e3:.4g} mm, chatter at "
        f"{depth.frequency:.4g} Hz."
    )
    return tuple(sentences)


def _at_its_speeds(
    modes: NaturalModes, energies: ModeEnergies, depth: DepthSensitivity, speeds: tuple[float, float]
) -> str:
    """What limits the depth where the file cuts, if no lobe touches the lowest depth of all there."""
    said = f"No lobe comes down to that depth from {speeds[0]:g} to {speeds[1]:g} rpm"
    found = depth.at_its_speeds(modes)
    if found is None:
        return f"{said}; `jointlib lobes` tells what limits it there."
    lowest, f, mode = found
    bent = largest(holders(modes, energies, mode))
    return (
        f"{said}: there it is the mode at {modes.frequency[mode]:.4g} Hz, at {lowest * 1e3:.4g} mm (chatter at {f:.4g} "
        f"Hz); it bends {bent}."
    )


def _joints(depth: DepthSensitivity) -> str:
    """What the joints are while the depth is told, as words."""
    if not depth.amplitude:
        return "at rest"
    return f"with the joints as they are held at a tool-point amplitude of {depth.amplitude * 1e6:g} um"


def _frequency(change: float) -> str:
    if abs(change) < _WORTH / 10:
        return "no other frequency"
    return f"{100 * abs(change):.2g} % {'more' if change > 0 else 'less'} frequency"


def _depth(change: float) -> str:
    if not np.isfinite(change):
        return "a cut that never chatters"
    if abs(change) < _WORTH:
        return f"hardly any depth ({100 * change:+.1f} %)"
    return f"{100 * abs(change):.2g} % {'more' if change > 0 else 'less'} depth"


def warnings(modes: NaturalModes, compliance: Mapping[str, float | None]) -> tuple[str, ...]:
    """What about these modes must be known before they are used, a sentence each."""
    said = []
    if modes.equations is None:
        said.append(
            "A component has state equations only, which tell no energy: shares of joints are twice the sensitivity of "
            "the frequency, and what is missing to 100 % lies in the components."
        )
    said += [
        f"Nothing holds the tool in {axis}: a free motion takes it along."
        for axis, value in compliance.items()
        if value is None
    ]
    growing = np.flatnonzero(modes.damping_ratio < -1e-9)
    if len(growing):
        said.append(
            f"The mode at {modes.frequency[growing[0]]:.4g} Hz grows by itself, its damping is below zero "
            f"({100 * modes.damping_ratio[growing[0]]:.2g} %): a joint yields energy."
        )
    if np.any(modes.limited):
        at = modes.frequency[modes.limited]
        said.append(
            f"At {len(at)} modes ({at[0]:.4g} Hz and on) a joint cannot follow an amplitude of "
            f"{modes.amplitude * 1e6:g} um at the tool and is held at the end of its range, or its gain did not settle."
        )
    return tuple(said)
