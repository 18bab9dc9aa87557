"""The sections of a report, one per step of the road."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from jointlib.identification import Identification
from jointlib.identification.force_samples import RestoringForce
from jointlib.joint import Joint

from ..cutting.amplitude.pocket import Pocket
from ..cutting.amplitude.zones import Zones
from ..cutting.forced.forced_field import ForcedField
from ..cutting.process.chart import StabilityLobes
from ..cutting.process.cutting import Cutting
from ..harmonic_balance.linear_check import LinearCheck
from .figures.check_figure import check_figure
from .figures.joint_figures import gain, gain_over_frequency, static_fit, surface
from .figures.lobes_figure import lobes_figure, tools_figure
from .page import Figure, Section, Table
from .parameter_table import parameter_table
from .response_section import response_section as response_section
from .trace_section import trace_section as trace_section


def identification_section(found: Identification, simulated: bool) -> Section:
    """What the records say of the joint, before anything is doubted."""
    figures = []
    if found.static is not None:
        s = found.static
        figures.append(
            static_fit(Joint((s.law,)), s.deflection, s.load, s.preloads, s.rms_by_preload, float(s.law.preload))
        )
    if found.surfaces:
        figures.append(_surface(found.surfaces, found.joint))
    text = [
        "The records are simulated; nothing here was measured on a machine."
        if simulated
        else "The joint was fitted to the records."
    ]
    text += [f"{e.measurement}: {e.rms:.4g} {e.unit} rms, {100 * e.relative:.2f} % of the peak." for e in found.errors]
    said = [m for m in found.messages if not m.endswith("the records are simulated.")]
    return Section("The joint as identified", [*text, *said], figures, [parameter_table(found.joint, "First fit")])


def _surface(samples: Sequence[RestoringForce], joint: Joint) -> Figure:
    z, v, f = (np.concatenate([getattr(s, name) for s in samples]) for name in ("z", "v", "f"))
    return surface(z, v, f, joint, float(z @ f / (z @ z)))


def gain_section(name: str, joints: Mapping[str, Joint], frequency: float, band: tuple[float, float]) -> Section:
    """Describing functions of a joint as it was and as it is used, the last, over the band it is used in (Hz)."""
    used = list(joints.values())[-1]
    high = used.validity.get("amplitude", (0.0, 5e-6))[1]
    A = np.geomspace(high / 100, 1.5 * high, 160)
    figures = [gain(joints, A, frequency)]
    figures.append(gain_over_frequency(used, high * np.array([0.1, 0.3, 1.0]), band))
    text = [
        "The describing function is what the machine sees of the joint: at each amplitude an equivalent stiffness and "
        "damping."
    ]
    return Section(f"Describing function of {name}", text, figures, kind="Describing functions of the joints")


def check_section(check: LinearCheck) -> Section:
    """Receptance coupling against python-control."""
    verdict = "agree" if check.passed else "DO NOT AGREE"
    text = [
        f"With its joints linearised the coupled machine and a python-control model {verdict}: largest relative "
        f"difference in norm {check.max_relative_difference:.2g}, limit 1e-8."
    ]
    text += [f"Left out of both: {e}." for e in check.excluded]
    ours, theirs = check.coupled.receptance[:, 0, 0], check.control.receptance[:, 0, 0]
    return Section("Check against python-control", text, [check_figure(check.frequency, ours, theirs)])


def lobes_section(
    charts: Sequence[tuple[float, StabilityLobes]],
    cutting: Cutting,
    best: Pocket | None,
    forced: ForcedField | None = None,
) -> Section:
    """Stability lobes at several tool-point amplitudes, with the ``best`` pocket and the ``forced`` vibration."""
    rows = [
        (
            "vanishing" if A == 0 else f"{A * 1e6:g}",
            f"{c.minimum_depth * 1e3:.4g}",
            f"{c.minimum_frequency:.5g}",
            c.method,
        )
        for A, c in charts
    ]
    header = ("tool-point amplitude [µm]", "minimum depth [mm]", "chatter frequency [Hz]", "method")
    notes = sorted({*charts[0][1].notes, *(w for _, c in charts for w in c.warnings)})
    return Section(
        "Stability lobes",
        notes,
        [lobes_figure(charts, cutting, best, Zones.between(charts), forced=forced)],
        [Table(header, rows)],
    )


def tools_section(
    used: str | None,
    charts: Sequence[tuple[str, StabilityLobes]],
    header: tuple[str, ...],
    rows: Sequence[tuple[str, ...]],
    remarks: Sequence[str],
) -> Section:
    """What each of several tools cuts for small vibrations; the rest of the report is of the one ``used``."""
    text = [
        f"The machine file has several tools. This report is of {used}; `--tool` names another. Here they stand beside "
        "each other, for small vibrations."
    ]
    return Section("What each tool cuts", [*text, *remarks], [tools_figure(charts)], [Table(header, list(rows))])
