"""Two of a kind side by side: machines, joints, measured frequency responses, runs, designs of a study."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jointlib.answers.given import File
from jointlib.errors import InputError
from jointlib.io.atomic import given_target, write, write_text
from jointlib.joint import Joint
from jointlib.shown.pictures import axes_of, draw_magnitude, literal, name_curves, shades
from jointlib.shown.progress import each
from jointlib.shown.result import Columns, Shown

from ..compare.side_by_side import Difference, differences, sentence, side, there
from ..compare.sides import Side
from ..model.machine import Machine
from ..report.figures.receptance_figure import Curve, Lobes, receptance_figure
from ..study.findings.design_sides import design_sides
from ..study.run import tools_asked
from ..study.study_file import read_study
from .study import identified


@dataclass(frozen=True, eq=False, repr=False)
class Differences(Shown):
    """What differs between the first and each of the others by more than its uncertainty."""

    sides: tuple[Side, ...]
    differences: tuple[Difference, ...]
    files: tuple[Path, ...]

    @property
    def remarks(self) -> list[str]:
        """What could not be compared, and why."""
        return [remark for one in self.sides for remark in one.remarks]

    @property
    def depths(self) -> list[str]:
        """How the lowest depths were found, a sentence, or one for each side where they were found differently."""
        ways = [(one.name, one.depths) for one in self.sides if one.depths]
        if len({way for _, way in ways}) == 1:
            return [f"Depths are by {ways[0][1]}."]
        return [f"The depth of {name} is by {way}." for name, way in ways]

    def finding(self) -> str:
        """The largest differences, or that there is none above the uncertainty."""
        base, *rest = self.sides
        return sentence(base, rest, self.differences)

    def columns(self) -> Columns:
        """A row per difference, each of its own unit."""
        names = ("what", "first", "other", "unit", "against")
        return {name: ([getattr(d, name) for d in self.differences], "") for name in names}

    def plot(self, ax: Any = None) -> Any:
        """The receptances of the sides over each other in µm/N over Hz; without any the numbers that differ."""
        axes = axes_of(ax)
        if not self.sides[0].curves:
            both = [d for d in self.differences if d.first == d.first and d.other == d.other and d.first]
            axes.barh([literal(d.what) for d in both], [100 * (d.other / d.first - 1) for d in both])
            axes.set(xlabel="other against the first [%]", ylabel="what differs")
            return axes
        for number, one in enumerate(self.sides):
            for name, curve in one.curves.items():
                look = {"linestyle": "--" if number else "-", "label": literal(f"{one.short}: {name}")}
                draw_magnitude(axes, curve.frequency, curve.receptance, **look)
        axes.set(xlabel="frequency [Hz]", ylabel="|x/F| [µm/N]")
        name_curves(axes)
        return axes


def compare(
    first: Machine | Joint | File,
    *others: Machine | Joint | File,
    results: File | None = None,
    designs: Sequence[int] = (),
    output: File | None = None,
    plot: str = "mag-phase",
    tool: str | None = None,
) -> Differences:
    """What differs between the first and each of the others: ``jointlib compare``.

    Parameters
    ----------
    first, others
        Machines or joints, or files of machines, joints or measured frequency responses, or folders of runs; of a study
        its file alone, with ``results``.
    results
        Of a study: the folder of its results.
    designs
        Of a study: which designs, by their number from 0 on; default: best and second.
    output
        The picture of their receptances to write, .svg or .png.
    plot
        What of them: ``"mag-phase"``, ``"re-im"`` or ``"nyquist"``.
    tool
        Of machines: which of several named tools is in each of them.
    """
    if designs and results is None:
        raise InputError("--designs: expected --results as well, the folder of 'jointlib study run'")
    if results is None and not others:
        raise InputError("compare: expected two files or folders, or a study file with --results")
    if results is not None and others:
        raise InputError("--results: expected a study file alone, its designs are compared")
    if results is not None and tool is not None:
        raise InputError("--tool: expected machines with several tools; a study has its tools in [conditions]")
    target = given_target(output, ".svg", ".png")
    if results is None:
        for path in (Path(one) for one in (first, *others) if not isinstance(one, Machine | Joint)):
            there(path)
        given = [one if isinstance(one, Machine | Joint) else Path(one) for one in (first, *others)]
        sides = [side(one, tool) for one in each("compared", given, len(given))]
    elif isinstance(first, Machine | Joint):
        raise InputError("--results: expected the file of a study with it")
    else:
        sides = _designs(Path(first), Path(results), tuple(designs))
    base, *rest = sides
    found = tuple(d for other in rest for d in differences(base, other))
    if target is not None and not base.curves:
        raise InputError(f"-o {output}: a {base.kind} has no receptance to draw, expected machines or measured FRFs")
    files = () if target is None else (_draw(target, sides, plot),)
    return Differences(tuple(sides), found, files)


def _designs(study: Path, results: Path, designs: tuple[int, ...]) -> list[Side]:
    """Designs of a study by number."""
    opened = read_study(study, tools_asked(results))
    if not (results / "study.json").is_file():
        raise InputError(f"--results: {results} holds no study, expected the folder of 'jointlib study run'")
    if len(set(designs)) < len(designs) or len(designs) == 1:
        raise InputError(f"--designs: {', '.join(map(str, designs))}, expected at least two different numbers")
    return list(design_sides(opened, results, designs, identified(opened)))


def _draw(path: Path, sides: Sequence[Side], plot: str) -> Path:
    """A panel for each receptance that the first side has, the sides over each other."""
    looks = list(zip(sides, shades(len(sides))[::-1], ["-", *["--"] * len(sides)], strict=False))
    panels = [
        (
            name,
            [
                Curve(own.frequency, own.receptance, one.short, colour, style)
                for one, colour, style in looks
                if (own := one.curves.get(name)) is not None
            ],
        )
        for name in sides[0].curves
    ]
    lobes = [
        Lobes(limits.speed, limits.depth, limits.chatter_frequency, one.short + limits.short_of, colour, style)
        for one, colour, style in looks
        if (limits := one.limits) is not None
    ]
    figure = receptance_figure(panels, plot, lobes=lobes, png=path.suffix == ".png")
    if path.suffix == ".png":
        write(path, lambda file: file.write(figure.png))
    else:
        write_text(path, figure.svg)
    return path
