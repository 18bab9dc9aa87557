"""What is told of the modes of a machine."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from jointlib.shown.text import table

from ...model.joint_places import bundles
from ...modes.mode_words import dissipaters, holders, largest, movers

if TYPE_CHECKING:
    from ...modes.depth_sensitivity import DepthSensitivity
    from ...modes.mode_energy import ModeEnergies
    from ...modes.natural_modes import NaturalModes
    from ..modes import MachineModes


def modes_as_json(found: MachineModes) -> dict[str, Any]:
    """What is printed as JSON."""
    modes, energies, depth = found.modes, found.energies, found.depth
    return {
        "modes": [_mode(modes, energies, i) for i in found.shown],
        "count": len(modes.pole),
        "free": modes.free.shape[1],
        "decay": modes.decay,
        "static_compliance": found.static_compliance,
        "amplitude": modes.amplitude,
        "depth": None if depth is None else _depth(modes, depth),
        "sentence": found.finding(),
        "warnings": found.warnings,
    }


def modes_in_words(found: MachineModes) -> list[str]:
    """What is printed in words."""
    modes = found.modes
    lines = [*found.sentences, *_table(modes, found.energies, found.shown)]
    rest = len(modes.pole) - len(found.shown)
    lines += ["(part): by its own elasticity or damping, not by a joint."] if found.shown else []
    lines += [f"{rest} further modes up to {modes.frequency[-1]:.4g} Hz (--all)."] if rest else []
    free = modes.free.shape[1]
    lines += [f"{free} free motion{'s' if free > 1 else ''}, which nothing holds."] if free else []
    lines += [
        f"static compliance of the tool in {axis}: {value * 1e6:.4g} um/N ({1e-6 / value:.4g} N/um)"
        for axis, value in found.static_compliance.items()
        if value
    ]
    return [*lines, *found.warnings]


def _mode(modes: NaturalModes, energies: ModeEnergies, i: int) -> dict[str, Any]:
    machine = modes.machine
    names = [c.name for c in machine.flexible]
    columns = (energies.strain, energies.loss, energies.sensitivity)
    per_joint = zip(names, *(array[:, i] for array in columns), strict=True)
    inside = zip(
        machine.components,
        energies.strain_inside[:, i],
        energies.loss_inside[:, i],
        [None] * len(machine.components) if energies.kinetic is None else energies.kinetic[:, i],
        strict=True,
    )
    return {
        "frequency": modes.frequency[i],
        "damping_ratio": modes.damping_ratio[i],
        "tool_compliance": modes.tool_peak[i] if machine.tool else None,
        "joints": [
            {"connection": name, "share": share, "loss": loss, "frequency_sensitivity": slope}
            for name, share, loss, slope in per_joint
        ],
        "bundles": [
            {"bundle": name, "share": energies.strain[rows, i].sum(), "loss": energies.loss[rows, i].sum()}
            for name, rows in bundles(machine.flexible).items()
        ],
        "components": [
            {"component": c.name, "kinetic": moving, "share": _known(share), "loss": _known(loss)}
            for c, share, loss, moving in inside
        ],
    }


def _known(value: float) -> float | None:
    return float(value) if value == value else None


def _depth(modes: NaturalModes, depth: DepthSensitivity) -> dict[str, Any]:
    connections = modes.machine.flexible
    return {
        "depth": depth.depth,
        "chatter_frequency": depth.frequency,
        "method": depth.method,
        "without": depth.instead or None,
        "mode": modes.frequency[depth.mode],
        "amplitude": depth.amplitude,
        "sensitivities": [
            {"connection": c.name, "sensitivity": value} for c, value in zip(connections, depth.joints, strict=True)
        ],
        "bundles": [
            {"bundle": name, "sensitivity": depth.joints[rows].sum()} for name, rows in bundles(connections).items()
        ],
    }


def _table(modes: NaturalModes, energies: ModeEnergies, chosen: tuple[int, ...]) -> list[str]:
    rows = [
        (
            f"{modes.frequency[i]:.5g}",
            f"{100 * modes.damping_ratio[i]:.3g}",
            f"{modes.tool_peak[i] * 1e6:.3g}" if modes.machine.tool else "",
            largest(movers(modes, energies, i)),
            largest(holders(modes, energies, i)),
            largest(dissipaters(modes, energies, i), 1),
        )
        for i in chosen
    ]
    header = ("mode [Hz]", "damping [%]", "at the tool [um/N]", "what moves", "what bends", "what dissipates")
    return table(header, rows) if rows else []
