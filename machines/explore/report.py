"""The report of a setting: one page that needs no network."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib.metadata import version

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import CheckFailed
from jointlib.io.atomic import sha256

from ..cutting.amplitude.frozen_lobes import lobes_at_amplitude
from ..cutting.amplitude.pocket import limit_of, pocket
from ..cutting.process.chart import StabilityLobes
from ..model.named_files import documents_and_data
from ..report.drawing import AFTER, BEFORE, sheet
from ..report.page import Figure, Page, Section, Table
from ..report.sections import gain_section, lobes_section
from .built import Moment
from .controls import Control
from .curves import Curves

_SPEEDS = 100


def setting_page(
    moment: Moment, curves: Curves, controls: Sequence[Control], values: Mapping[str, float], options: str = ""
) -> Page:
    """The page of a moment; ``values`` are those that differ from the file.

    ``options`` are those of `jointlib explore` beside the machine.

    Lobes are by the method of `jointlib lobes`, at rest and at the chosen tool-point amplitude.
    """
    machine = moment.machine
    assert machine.source is not None
    charts: list[tuple[float, StabilityLobes]] = []
    sections = [_settings(controls, values), _receptance(curves, moment.amplitude), *_gains(moment, curves)]
    numbers = [("static compliance of the tool point", f"{moment.built.static_compliance * 1e6:.4g} µm/N")]
    with_tool = f" with the tool {machine.tool_name}" if machine.tool_name else ""
    finding = f"{machine.name}{with_tool} as set: {_changed(controls, values)}."
    if moment.cutting is not None and moment.cutting.speed is not None:
        speeds = moment.cutting.speeds(_SPEEDS)
        charts = [(A, _chart(replace(moment, amplitude=A), speeds)) for A in dict.fromkeys((0.0, moment.amplitude))]
        made = charts[0][1].method if len({chart.method for _, chart in charts}) == 1 else None
        lowest = min(chart.minimum_depth for _, chart in charts)
        limit = None if made is None else limit_of(machine, [A for A, _ in charts], made)
        best = pocket([chart for _, chart in charts], moment.cutting, limit)
        sections.append(lobes_section(charts, moment.cutting, best))
        if np.isfinite(lowest):
            numbers.append(("stable at every speed shown below", f"{lowest * 1e3:.4g} mm"))
        finding += "" if best is None else f" Recommended: {best.words()}."
    return Page(
        title=f"{machine.name}: a setting",
        finding=finding,
        numbers=numbers,
        sections=sections,
        inputs=[(str(file), sha256(file)) for file in sorted(documents_and_data(machine.source))],
        assumptions=["Joints are replaced by their describing functions: one harmonic of the relative motion."],
        warnings=list(dict.fromkeys(w for _, chart in charts for w in chart.warnings)),
        command=f"jointlib explore {machine.source}{f' {options}' if options else ''}",
        version=version("jointlib"),
    )


def _chart(moment: Moment, speeds: Array) -> StabilityLobes:
    """By the method of `jointlib lobes`; a preview with the reason where that one gives none."""
    try:
        moment.refuse_slow(float(np.min(speeds)))
        return lobes_at_amplitude(moment.machine, speeds, moment.amplitude)
    except CheckFailed as failed:
        chart = lobes_at_amplitude(moment.machine, speeds, moment.amplitude, "zero-order")
        return replace(chart, warnings=(*chart.warnings, str(failed)))


def _changed(controls: Sequence[Control], values: Mapping[str, float]) -> str:
    said = [f"{c.group} {c.label} {_number(c, values[c.key])}" for c in controls if c.key in values]
    return ", ".join(said) if said else "everything as in the file"


def _number(control: Control, value: float) -> str:
    return control.told(value) if control.choices else f"{value:.6g} {control.unit}".rstrip()


def _settings(controls: Sequence[Control], values: Mapping[str, float]) -> Section:
    rows = [
        (c.group, c.label, _number(c, c.value), _number(c, values[c.key]) if c.key in values else "") for c in controls
    ]
    return Section("The setting", (), (), [Table(("of", "what", "in the file", "here, where it differs"), rows)])


def _receptance(curves: Curves, amplitude: float) -> Section:
    with sheet(len(curves.receptance), width=5.2 * len(curves.receptance), height=3.8, squeeze=False) as paper:
        for axes, (axis, rest) in zip(paper.axes[0], curves.receptance_at_rest.items(), strict=True):
            axes.semilogy(curves.frequency, np.abs(rest) * 1e6, color=AFTER, label="vanishing")
            if amplitude:
                moving = np.abs(curves.receptance[axis]) * 1e6
                axes.semilogy(curves.frequency, moving, "--", color=BEFORE, label=f"{amplitude * 1e6:g} µm")
            axes.set(xlabel="frequency [Hz]", ylabel="|receptance| [µm/N]", title=f"Tool point, {axis}")
            axes.legend(title="tool-point amplitude")
    figure = Figure(paper.svg, "Direct receptance of the tool point with the joints as they are at the amplitude.")
    return Section("Receptance of the tool point", (), [figure])


def _gains(moment: Moment, curves: Curves) -> list[Section]:
    """Every nonlinear joint once; of a bundle one row stands for all."""
    joints = dict(zip((c.name for c in moment.machine.flexible), moment.built.assembly.joints, strict=True))
    band = float(curves.frequency[0]), float(curves.frequency[-1])
    return [gain_section(name, {"as set": joints[name]}, curves.gain_frequency, band) for name in curves.gains]
