"""What the modes of a machine come to, in sentences: which one matters, what bends in it, what stiffness would give."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..indices import Index
from .depth_sensitivity import DepthSensitivity
from .mode_energy import ModeEnergies, bundles
from .natural_modes import NaturalModes

_FIRST = 10
_SHOWN = 1e-2
"""Share of the largest compliance at the tool from which on a mode beyond the first ten is shown."""
_STIFFER = 1.1
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
    tool, else the first. The figure for 10 % more stiffness carries the sensitivity on as a power, 1.1^S.
    """
    if not len(modes.pole):
        return ("nothing in this machine swings: no mode has stiffness and mass that oscillate.",)
    peak = modes.tool_peak if modes.machine.tool else np.zeros(len(modes.pole))
    mode = depth.mode if depth is not None else int(np.argmax(peak))
    if depth is not None:
        which = "that limits the depth"
    else:
        which = "that the tool feels most" if np.any(peak) else "that comes first"
    gain = depth.joints if depth is not None else energies.sensitivity[:, mode]
    found = holders(modes, energies, mode)
    groups = bundles(modes.machine.flexible)
    by_bundle = {name: float(np.sum(gain[rows])) for name, rows in groups.items()}
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
    sentences = [f"{said}: 10 % more stiffness there gives {_gained(by_bundle[in_joints[0]], depth)}."]
    if depth is not None:
        best = max(by_bundle, key=lambda name: abs(by_bundle[name]))
        if best != in_joints[0] and abs(by_bundle[best]) > 1.2 * abs(by_bundle[in_joints[0]]):
            sentences.append(
                f"The depth depends most on {best}: 10 % more stiffness gives {_gained(by_bundle[best], depth)}."
            )
        how = "of the zero-order approximation" if depth.method == "zero-order" else "in turning"
        how += f" without the {depth.instead}" if depth.instead else ""
        sentences.append(
            f"The depth is the lowest over all speeds {how}, {_joints(depth)}: {depth.depth * 1e3:.4g} mm, chatter at "
            f"{depth.frequency:.4g} Hz."
        )
    return tuple(sentences)


def _joints(depth: DepthSensitivity) -> str:
    """What the joints are while the depth is told, as words."""
    if not depth.amplitude:
        return "at rest"
    return f"with the joints as they are held at a tool-point amplitude of {depth.amplitude * 1e6:g} um"


def _gained(sensitivity: float, depth: DepthSensitivity | None) -> str:
    """What 10 % more stiffness gives, as words."""
    change = _STIFFER**sensitivity - 1
    if depth is None:
        return f"{100 * change:.2g} % more frequency" if abs(change) >= _WORTH / 10 else "no other frequency"
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
