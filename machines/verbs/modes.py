"""Natural modes of a machine: what moves, which joint holds the energy, what stiffness gives."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from jointlib.cli.arguments import (
    FrequencyRange,
    Target,
    Verb,
    input_file,
    json_option,
    refuse_tool,
    tool_option,
)
from jointlib.cli.output import emit, table, working
from jointlib.errors import InputError

from .quantities import AMPLITUDE

if TYPE_CHECKING:
    from ..modes.depth_sensitivity import DepthSensitivity
    from ..modes.mode_energy import ModeEnergies
    from ..modes.natural_modes import NaturalModes


@click.command("modes", cls=Verb)
@input_file("files", metavar="MACHINE | MEASUREMENT...", nargs=-1, required=True)
@click.option(
    "--amplitude",
    type=AMPLITUDE,
    help="Of a machine: tool-point amplitude of the joints; default: at rest.",
)
@click.option("--all", "every", is_flag=True, help="Of a machine: every mode, not only the first and those it feels.")
@click.option("-o", "output", type=Target(".toml"), help="Of measurements: the component file to write.")
@click.option("--plot", type=Target(".svg", ".png"), help="Of measurements: stabilisation chart, fit over measured.")
@click.option("--band", type=FrequencyRange(), help="Of measurements: lo:hi, the lines that are fitted.")
@click.option("--condition", help="Of measurements: which one of several levels.")
@click.option("--most", type=click.IntRange(1), help="Of measurements: at most so many modes, the strongest.")
@click.option("--free", is_flag=True, help="Of measurements: of a body that nothing holds.")
@tool_option
@json_option
def command(
    files: tuple[Path, ...],
    amplitude: float | None,
    every: bool,
    output: Path | None,
    plot: Path | None,
    band: tuple[float, float, int | None] | None,
    condition: str | None,
    most: int | None,
    free: bool,
    changes: dict[str, str],
    as_json: bool,
) -> None:
    """Modes of a MACHINE: frequency, damping, which part moves, which joint holds the energy; or of measured FRFs.

    Of MEASUREMENTs of kind "frf" frequency, damping and shapes with their errors, as a component file for machines.

    \b
    Examples:
      jointlib modes machines/library/lathe.toml
      jointlib modes machines/library/three_joints/tip.measurement.toml --condition "8 N" -o tip.component.toml
    """
    of_measurements = {"-o": output, "--plot": plot, "--band": band, "--condition": condition, "--most": most}
    if _measured(files):
        for name, given in (("--amplitude", amplitude is not None), ("--all", every)):
            if given:
                raise InputError(f"{name}: given with measurements, expected with a machine alone")
        refuse_tool(files[0], changes)
        from .told.measured_modes import told

        lines = None if band is None else band[:2]
        emit(as_json, *told(files, output, plot, lines, condition, most, free))
        return
    for name, value in (*of_measurements.items(), ("--free", free or None)):
        if value is not None:
            raise InputError(f"{name}: given with {files[0]}, expected with measurements of kind 'frf' alone")
    if len(files) > 1:
        raise InputError(f"{files[1]}: a second machine, expected one, or several measurements of kind 'frf'")
    _of_machine(files[0], amplitude or 0.0, every, changes, as_json)


def _of_machine(file: Path, amplitude: float, every: bool, changes: dict[str, str], as_json: bool) -> None:
    import numpy as np

    from .. import natural_modes, read_machine
    from ..modes.depth_sensitivity import depth_sensitivity
    from ..modes.mode_energy import mode_energies
    from ..modes.mode_words import leading, shown_modes, warnings
    from ..modes.static_compliance import static_compliance
    from ..road.open_joints import with_joints

    with working("computing modes"):
        machine, remarks = with_joints(read_machine(file, changes))
        modes = natural_modes(machine, amplitude)
        energies, compliance = mode_energies(modes), static_compliance(modes)
        depth = depth_sensitivity(modes) if machine.cutting is not None and machine.tool else None
    sentences = leading(modes, energies, depth)
    chosen = np.arange(len(modes.pole)) if every else shown_modes(modes)
    said = [*warnings(modes, compliance), *(depth.warnings if depth is not None else ()), *remarks]
    data = {
        "modes": [_mode(modes, energies, int(i)) for i in chosen],
        "count": len(modes.pole),
        "free": modes.free.shape[1],
        "decay": modes.decay,
        "static_compliance": compliance,
        "amplitude": amplitude,
        "depth": None if depth is None else _depth(modes, depth),
        "sentence": sentences[0],
        "warnings": said,
    }
    lines = [*sentences, *_table(modes, energies, [int(i) for i in chosen])]
    rest = len(modes.pole) - len(chosen)
    lines += ["(part): by its own elasticity or damping, not by a joint."] if len(chosen) else []
    lines += [f"{rest} further modes up to {modes.frequency[-1]:.4g} Hz (--all)."] if rest else []
    free = modes.free.shape[1]
    lines += [f"{free} free motion{'s' if free > 1 else ''}, which nothing holds."] if free else []
    lines += [
        f"static compliance of the tool in {axis}: {value * 1e6:.4g} um/N ({1e-6 / value:.4g} N/um)"
        for axis, value in compliance.items()
        if value
    ]
    emit(as_json, data, [*lines, *said])


def _measured(files: tuple[Path, ...]) -> bool:
    """Whether the first file is a measurement; what is wrong with a file is said where it is read."""
    import tomllib

    try:
        return tomllib.loads(files[0].read_text("utf-8-sig")).get("schema") == "jointlib/measurement/1"
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError):
        return False


def _mode(modes: NaturalModes, energies: ModeEnergies, i: int) -> dict[str, Any]:
    from ..modes.mode_energy import bundles

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
    from ..modes.mode_energy import bundles

    connections = modes.machine.flexible
    return {
        "depth": depth.depth,
        "chatter_frequency": depth.frequency,
        "method": depth.method,
        "mode": modes.frequency[depth.mode],
        "amplitude": depth.amplitude,
        "sensitivities": [
            {"connection": c.name, "sensitivity": value} for c, value in zip(connections, depth.joints, strict=True)
        ],
        "bundles": [
            {"bundle": name, "sensitivity": depth.joints[rows].sum()} for name, rows in bundles(connections).items()
        ],
    }


def _table(modes: NaturalModes, energies: ModeEnergies, chosen: list[int]) -> list[str]:
    from ..modes.mode_words import dissipaters, holders, largest, movers

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
