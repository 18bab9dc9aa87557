"""The end of a spindle out of a measured assembly with a known blank."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from jointlib.answers.given import File, Quantity, Span, files_of, one, span
from jointlib.errors import InputError
from jointlib.io.atomic import to_write
from jointlib.shown.pictures import axes_of, draw_magnitude, name_curves
from jointlib.shown.progress import Progress, Silent
from jointlib.shown.result import Columns, Shown

from ..uncoupling.assembly import read_assembly
from ..uncoupling.spindle_end import SpindleEnd, uncoupled, write_spindle

_ENTRIES = {"deflection by force": (0, 0), "rotation by force": (1, 0), "rotation by moment": (1, 1)}
"""What a plane of the end tells; by reciprocity the second is the deflection by a moment too."""
_WORST = 0.9


@dataclass(frozen=True, eq=False, repr=False)
class Uncoupled(Shown):
    """The end of a spindle as a component, and how well its lines tell it."""

    end: SpindleEnd
    files: tuple[Path, ...]

    @property
    def file(self) -> Path:
        """The component file."""
        return self.files[0]

    def finding(self) -> str:
        """Which planes, on which lines, and how well the middle line and the worst tenth of them are known."""
        f, planes = self.end.frequency, " and ".join(plane.words[0] for plane in self.end.planes)
        weak = float(np.mean(self.end.weak))
        tells = "every line tells it" if not weak else f"{100 * (1 - weak):.3g} % of the lines tell it by themselves"
        known = ", ".join(
            f"{name} {100 * max(middle):.2g} ({100 * max(tenth):.2g}) %"
            for name, (middle, tenth) in (
                (name, zip(*(each[name] for each in self._errors.values()), strict=True)) for name in _ENTRIES
            )
        )
        return (
            f"end of the spindle along {planes}, {len(f)} lines from {f[0]:.5g} to {f[-1]:.5g} Hz; standard errors, "
            f"middle line (worst tenth of the lines): {known}; {tells}"
        )

    @property
    def _errors(self) -> dict[str, dict[str, tuple[float, float]]]:
        """By direction and entry the standard error over its size: of the middle line, and what a tenth exceeds."""
        found = {}
        for plane, end in zip(self.end.planes, self.end.ends, strict=True):
            share = {
                name: np.sqrt(np.maximum(end.variance[:, i, k], 0)) / np.abs(end.receptance[:, i, k])
                for name, (i, k) in _ENTRIES.items()
            }
            found[plane.words[0]] = {
                name: (float(np.median(each)), float(np.quantile(each, _WORST))) for name, each in share.items()
            }
        return found

    def columns(self) -> Columns:
        """A row per line: receptances of every plane with their standard errors."""
        found: dict[str, Any] = {"frequency": (self.end.frequency, "Hz"), "weak": (self.end.weak, "")}
        for plane, end in zip(self.end.planes, self.end.ends, strict=True):
            for i, k, unit in ((0, 0, "m/N"), (0, 1, "1/N"), (1, 1, "1/(N m)")):
                name = f"{plane.words[i]} per {'force' if k == 0 else 'moment'} on {plane.words[k]}"
                found[name] = end.receptance[:, i, k], unit
                found[f"error of {name}"] = np.sqrt(end.variance[:, i, k]), unit
        return found

    def plot(self, ax: Any = None) -> Any:
        """Deflection per force at the end in µm/N over frequency in Hz, a curve a plane, twice its error around it."""
        axes = axes_of(ax)
        for plane, end in zip(self.end.planes, self.end.ends, strict=True):
            H, error = end.receptance[:, 0, 0], 2 * np.sqrt(end.variance[:, 0, 0])
            draw_magnitude(axes, self.end.frequency, H, label=plane.words[0])
            low, high = np.maximum(np.abs(H) - error, 1e-3 * np.abs(H)), np.abs(H) + error
            axes.fill_between(self.end.frequency, low * 1e6, high * 1e6, alpha=0.2)
        axes.set(xlabel="frequency [Hz]", ylabel="|x/F| [µm/N]")
        name_curves(axes)
        return axes

    def as_json(self) -> dict[str, Any]:
        """What ``jointlib uncouple --json`` prints."""
        end = self.end
        return {
            "file": str(self.file),
            "weak": [list(band) for band in end.weak_bands],
            "dofs": list(end.dofs),
            "lines": len(end.frequency),
            "doubt": {p.words[0]: float(np.median(e.doubt)) for p, e in zip(end.planes, end.ends, strict=True)},
            "errors": {
                direction: {name.replace(" ", "_"): list(pair) for name, pair in each.items()}
                for direction, each in self._errors.items()
            },
            "sentence": self.finding(),
            "warnings": list(end.notes),
            "files": [str(path) for path in self.files],
        }

    def words(self) -> list[str]:
        """What ``jointlib uncouple`` prints."""
        return [f"{self.finding()}.", *self.end.notes]


def uncouple(
    measured: File | Iterable[File],
    *,
    remove: File | Iterable[File],
    output: File,
    at: str | None = None,
    band: Span | None = None,
    condition: str | None = None,
    overhang: Quantity | None = None,
    progress: Progress | None = None,
) -> Uncoupled:
    """The end of a spindle without the blank that it was measured with: ``jointlib uncouple``.

    Parameters
    ----------
    measured
        Measurement files of kind "frf" of an assembly; or, with as many in ``remove``, one of each assembly.
    remove
        Component file of the blank, or tool file without a joint: a beam whose stations are the measured places and
        the end in the spindle.
    output
        The component file to write, .toml.
    at
        Station of the blank that is coupled; default: the one at which nothing was measured.
    band
        The lines that are used, (low, high) in Hz or ``"lo:hi"``.
    condition
        Which one of several levels.
    overhang
        m or with its unit, from the tip of the assembly to the face of the spindle: a longer blank is refused.
    progress
        Told of every part that takes long.

    Raises
    ------
    InputError
        Where the responses do not tell an end, or the blank cannot be the one that was measured.
    """
    files, tools = files_of(measured), files_of(remove)
    target = to_write(output, "output", ".toml")
    if not files:
        raise InputError("uncouple: no file, expected measurements of kind 'frf'")
    if len(tools) not in (1, len(files)):
        raise InputError(
            f"--remove: {len(tools)} blanks for {len(files)} measurements, expected one for all, or one for each"
        )
    lines, reach = span(band, "--band"), one(overhang, "m", "--overhang", 0)
    groups = [(files, tools[0])] if len(tools) == 1 else [((f,), t) for f, t in zip(files, tools, strict=True)]
    with (progress or Silent()).step("uncoupling"):
        assemblies = [read_assembly(group, tool, at, lines and lines[:2], condition, reach) for group, tool in groups]
        found = uncoupled(assemblies)
    return Uncoupled(found, write_spindle(target, found, (*files, *tools)))
