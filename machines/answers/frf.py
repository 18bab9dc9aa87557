"""Forced response of a machine with the peaks of the tool, bands, and measured responses laid over it."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from jointlib.answers.given import File, Quantities, Span, files_of, several, span
from jointlib.errors import InputError
from jointlib.io.atomic import given_target
from jointlib.shown.pictures import axes_of
from jointlib.shown.progress import Progress, Silent
from jointlib.shown.result import Columns, Shown
from jointlib.system.memory import refuse_beyond

from ..files.opened import machine_of
from ..forced_response.each_drive import peak_rows, responses
from ..forced_response.response import Response
from ..forced_response.response_file import write_response
from ..forced_response.tool_peaks import tool_peaks
from ..model.machine import Machine
from ..road.open_joints import with_joints
from ..uncertainty.drawn_machines import refuse_certain, refuse_too_many
from .told.frf_files import draw, write_bands, write_receptances
from .told.frf_told import contact_lines, measured_lines, tool_lines

if TYPE_CHECKING:
    from ..compare.comparison import Comparison

Harmonics: TypeAlias = int | str | tuple[int, ...]
_EACH = 5000.0
"""Bytes of a line for every place, measured over the whole of the computation; pairs of them are taken in blocks."""


def _independent(machine: Machine) -> int:
    """Motions that the tool and the joints can have: of all contacts between two bodies, six."""
    sides = Counter(c.between for c in machine.connections if c.joint is not None)
    return len(machine.tool) + sum(min(count, 6) for count in sides.values())


@dataclass(frozen=True, eq=False, repr=False)
class ForcedResponses(Shown):
    """What ``jointlib frf`` finds: a response for each direction of the force."""

    machine: Machine
    """With its joints as they are used."""
    responses: tuple[Response, ...]
    measured: tuple[Comparison, ...]
    """Measured responses against it."""
    data: dict[str, Any]
    """What the verb prints as JSON: ``peaks``, ``tool_peaks``, ``band``, ``measured``, ``warnings`` …"""
    lines: tuple[str, ...]
    """What the verb prints in words."""
    files: tuple[Path, ...]

    def finding(self) -> str:
        """The most compliant peak of the tool, else what each response says."""
        peaks = [peak for each in self.responses for peak in tool_peaks(each)]
        if not peaks:
            return "; ".join(each.finding() for each in self.responses)
        most = max(peaks, key=lambda peak: peak.compliance)
        return (
            f"{most.output} is most compliant at {most.frequency:.5g} Hz: {most.compliance * 1e6:.4g} µm/N for "
            f"{most.force:g} N on {most.drive}; {len(peaks)} peak{'s' * (len(peaks) > 1)} of the tool"
        )

    def columns(self) -> Columns:
        """A row per peak of the tool; of a machine without one per peak of its joints."""
        peaks = [peak for each in self.responses for peak in tool_peaks(each)]
        if not peaks:
            return self.responses[0].columns()
        units = {"force": "N", "frequency": "Hz", "compliance": "m/N"}
        return {key: ([vars(peak)[key] for peak in peaks], units.get(key, "")) for key in vars(peaks[0])}

    def plot(self, ax: Any = None) -> Any:
        """The size of the receptances in µm/N over frequency in Hz, all branches."""
        axes = axes_of(ax)
        for each in self.responses:
            each.plot(axes)
        return axes


def frf(
    machine: Machine | File,
    *,
    force: Quantities = (),
    frequency: Span | None = None,
    drive: str | None = None,
    harmonics: str | int | Sequence[int] | None = None,
    samples: int | None = None,
    output: File | None = None,
    measured: File | Iterable[File] = (),
    contacts: bool = False,
    plot: str = "mag-phase",
    tool: str | None = None,
    progress: Progress | None = None,
) -> ForcedResponses:
    """Forced response at each force: every branch, with the peaks of the tool and of each joint: ``jointlib frf``.

    Parameters
    ----------
    machine
        A machine or its file.
    force
        Peak forces, N or with units; none are those of the file.
    frequency
        Lowest and highest frequency, and the number of lines if wanted: ``(1e3, 7e3)`` in Hz, ``"1 kHz:7 kHz:400"``;
        default: the range of the file.
    drive
        Degree of freedom that the force acts on; default: that of the file, else each of the tool.
    harmonics
        ``"auto"``, the default: further ones where they matter by more than 0.1 %; 1, the first alone, which is the
        default of ``samples``; or multiples such as ``(1, 3, 5)``.
    samples
        Band of the receptance from so many samples of what is uncertain, at least 40.
    output
        The file to write: .npz, every branch; .csv or .frf, receptances; .svg or .png, a picture.
    measured
        Measurement files of kind "frf" to lay over it.
    contacts
        Tell the peaks of every contact as well.
    plot
        What a picture shows: ``"mag-phase"``, ``"re-im"`` or ``"nyquist"``.
    tool
        Which of several named tools is in the machine.
    progress
        Told of every part that takes long.
    """
    wanted = _harmonics(harmonics or "auto")
    target = given_target(output, ".npz", ".csv", ".frf", ".svg", ".png")
    if samples and target is not None and target.suffix not in (".npz", ".csv"):
        raise InputError(f"-o {output}: this format has no room for a band, expected .npz or .csv with --samples")
    forces, lines_of, during = several(force, "N", "--force"), span(frequency, "--frequency"), progress or Silent()
    with during.step("coupling the machine"):
        model, remarks = with_joints(machine_of(machine, tool))
        band = None if lines_of is None else lines_of[:2]
        points = 600 if lines_of is None or lines_of[2] is None else lines_of[2]
        places = _independent(model)
        refuse_beyond(_EACH * points * (places + 1), f"--frequency: {points} lines of {places} joints and tool axes")
        if samples is not None:
            refuse_certain(model, cut=False)
            refuse_too_many(model, samples)
    drive = model.driven_dof(drive) if samples else drive
    asked = responses(model, drive, forces or None, band, during, points=points, harmonics=wanted, stability="auto")
    results = list(asked)
    further: dict[str, Any] = {}
    if samples:
        further["band"] = _band_of(model, results[0], points, samples, _harmonics(harmonics or "1"), during)
    axes = {dof: axis for axis, dof in model.tool.items()}
    laid, told = _laid_over(model, (*model.compare, *files_of(measured)))
    further |= told
    if target is None:
        written = []
    elif target.suffix == ".npz":
        written = write_response(target, results, further.get("band"))
    elif target.suffix in (".svg", ".png"):
        written = draw(target, results, plot, laid)
    else:
        written = write_receptances(target, results, points, axes)
        written += write_bands(target, results[0], further.get("band"))
    lines = tool_lines(results, axes)
    lines += contact_lines(results) if contacts else []
    lines += measured_lines(laid, told)
    for result in results:
        lines += [f"{f:g} N: {o.value}" for f, o in zip(result.force, result.outcomes, strict=True) if o.value]
    warnings = list(dict.fromkeys([*remarks, *(warning for result in results for warning in result.warnings)]))
    lines += [f"warning: {warning}" for warning in warnings]
    if samples and further["band"]["clipped"]:
        lines.append(f"{further['band']['clipped']} sampled parameters lay outside their bounds and were set to them.")
    names = [str(path) for path in written]
    data = peak_rows(results) | {"file": next(iter(names), None), "files": names, "warnings": warnings} | further
    return ForcedResponses(model, tuple(results), tuple(laid), data, tuple(lines), tuple(written))


def _laid_over(model: Machine, files: Sequence[Path]) -> tuple[list[Comparison], dict[str, Any]]:
    """Measured frequency responses against the machine, and what is told of them as JSON."""
    if not files:
        return [], {}
    from ..compare.over_measured import over_measured

    return over_measured(model, files)


def _band_of(
    model: Machine, result: Response, points: int, samples: int, harmonics: Harmonics, progress: Progress
) -> dict[str, Any]:
    """|G| (m/N) at 2.5, 50 and 97.5 % of the samples, ``size`` [force][share][line][output], on even lines (Hz)."""
    from ..uncertainty.lobe_bands import SHARES
    from ..uncertainty.response_band import response_band

    known = result.frfs[0].frequency
    lines = np.linspace(known[0], known[-1], points)
    begun = time.perf_counter()
    response_band(model, result.force, lines, result.drive, 1, harmonics=harmonics)
    cost = samples * (time.perf_counter() - begun)
    with progress.step(f"computing {samples} samples, about {cost:.0f} s"):
        band = response_band(model, result.force, lines, result.drive, samples, harmonics=harmonics)
    return {
        "share": SHARES,
        "frequency": lines,
        "size": np.swapaxes(band.quantiles, 0, 1),
        "outputs": result.outputs,
        "samples": samples,
        "clipped": band.clipped,
    }


def _harmonics(given: str | int | Sequence[int]) -> Harmonics:
    """1, "auto" or multiples, also in words; whether they are too many is for the solver to say."""
    if given == "auto" or (isinstance(given, int) and given > 0):
        return given
    parts = [str(part).strip() for part in (given.split(",") if isinstance(given, str) else np.ravel(given))]
    if not all(part.isascii() and part.isdigit() and len(part) < 10 and int(part) > 0 for part in parts):
        raise InputError(f"--harmonics: {given!r}, expected 1, auto or multiples such as 1,3,5")
    return tuple(int(part) for part in parts)
