"""The files of a forced response: curves by drive, force and output, and the bands round them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from jointlib.errors import InputError

if TYPE_CHECKING:
    from ...compare.comparison import Comparison
    from ...forced_response.response import Response


def write_receptances(path: Path, results: Sequence[Response], points: int, axes: dict[str, str]) -> list[Path]:
    """The receptance of each drive, force and output in m/N, in a file of its own where there are several.

    A ``.csv`` has the lines that were computed, closer at the peaks, as far as there is a solution; a ``.frf`` has
    ``points`` lines of one step, as its readers expect. ``axes`` names the directions of the tool by their dofs.
    """
    from jointlib.io.atomic import write_text
    from jointlib.io.cutpro import write_cutpro

    written = []
    for result in results:
        for force, frf in zip(result.force, result.frfs, strict=True):
            for o, output in enumerate(result.outputs):
                pair = f"{axes[output]}{axes[result.drive]}" if len(results) > 1 else None
                target = named(path, result, force, output, pair)
                found = np.isfinite(frf.receptance[:, o, 0])
                if path.suffix == ".frf":
                    if not found.all():
                        raise InputError(
                            f"-o {path}: at {force:g} N there is no solution inside the valid range at "
                            f"{frf.frequency[~found][0]:g} Hz, and this format has no gaps; expected .csv or less force"
                        )
                    even = frf.on(np.linspace(frf.frequency[0], frf.frequency[-1], points))
                    write_cutpro(target, even.frequency, even.receptance[:, o, 0])
                else:
                    rows = zip(frf.frequency[found].tolist(), frf.receptance[found, o, 0].tolist(), strict=True)
                    text = "".join(f"{f:.12g},{H.real:.12e},{H.imag:.12e}\n" for f, H in rows)
                    write_text(target, f"frequency,real,imaginary\n{text}")
                written.append(target)
    return written


def write_bands(path: Path, result: Response, band: dict[str, Any] | None) -> list[Path]:
    """The bands of |G| in m/N beside the receptances, a ``…_band.csv`` for each force and output."""
    from jointlib.io.atomic import write_text

    written: list[Path] = []
    if band is None:
        return written
    for force, sizes in zip(result.force, band["size"], strict=True):
        for o, output in enumerate(result.outputs):
            target = named(path, result, force, output, None, "_band")
            rows = zip(band["frequency"].tolist(), *sizes[:, :, o].tolist(), strict=True)
            text = "".join(f"{f:.12g},{low:.12e},{middle:.12e},{high:.12e}\n" for f, low, middle, high in rows)
            write_text(target, f"frequency,low,median,high\n{text}")
            written.append(target)
    return written


def named(path: Path, result: Response, force: float, output: str, pair: str | None, more: str = "") -> Path:
    """The file of one force and output: ``x_yx_50N.csv`` holds y for a force of 50 N along x.

    The pair of directions stands there where there are two drives, the output alone where one drive has several, the
    force where there are several; whole newtons are written out.
    """
    several = f"_{output}" if len(result.outputs) > 1 else ""
    size = f"_{force:.0f}N" if force == round(force) else f"_{force:g}N"
    size = size if len(result.force) > 1 else ""
    return path.with_name(f"{path.stem}{f'_{pair}' if pair else several}{size}{more}{path.suffix}")


def draw(path: Path, results: Sequence[Response], plot: str, laid: Sequence[Comparison] = ()) -> list[Path]:
    """The receptances at the tool as a picture, with measured ones laid over them."""
    from jointlib.io.atomic import write, write_text

    from ...report.drawing import MEASURED
    from ...report.figures.receptance_figure import Curve
    from ...report.figures.response_figures import tool_figure

    measured = [
        (r.drive, r.response, Curve(r.frequency, r.receptance, f"measured, {r.force:g} N", MEASURED, ":"))
        for r in (comparison.record for comparison in laid)
    ]
    figure = tool_figure(results, plot, measured, png=path.suffix == ".png")
    if path.suffix == ".png":
        write(path, lambda file: file.write(figure.png))
    else:
        write_text(path, figure.svg)
    return [path]
