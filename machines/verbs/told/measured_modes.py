"""Modes of measured frequency responses on the command line."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from jointlib.cli.output import table, working, wrote

if TYPE_CHECKING:
    from jointlib.modal_fit.fitted_modes import FittedModes


def told(
    files: Sequence[Path],
    output: Path | None,
    plot: Path | None,
    band: tuple[float, float] | None,
    condition: str | None,
    most: int | None,
    free: bool,
) -> tuple[dict[str, Any], list[str]]:
    """Fit, write, and what is printed as data and in words."""
    from jointlib.modal_fit.fit import fit_modes
    from jointlib.shown.pictures import write_picture

    from ...measured_modes.measured_responses import read_responses
    from ...measured_modes.modal_component import component_of, write_component

    with working("fitting modes"):
        fitted = fit_modes(read_responses(files, band, condition), most=most, free=free)
    said = [*fitted.notes, *_beyond(fitted)]
    written: list[Path] = []
    if output is not None:
        component_of(fitted, output.name)
    if plot is not None:
        write_picture(plot, fitted.plot())
        written.append(plot)
    if output is not None:
        written = [*write_component(output, fitted, files), *written]
    columns = (fitted.frequency, fitted.frequency_error, fitted.damping_ratio, fitted.damping_ratio_error)
    modes = list(zip(*columns, strict=True))
    data = {
        "modes": [
            {
                "frequency": float(f),
                "damping_ratio": float(ratio),
                "frequency_error": float(error),
                "damping_ratio_error": float(ratio_error),
            }
            for f, error, ratio, ratio_error in modes
        ],
        "fit_error": fitted.fit_error,
        "scatter": fitted.scatter,
        "proportional": fitted.is_proportional,
        "residual_modes": [] if fitted.shape_fit is None else (fitted.shape_fit.ends[:, 0] / (2 * np.pi)).tolist(),
        "sentence": fitted.finding(),
        "warnings": said,
        "file": None if output is None else str(output),
    }
    header = ("mode [Hz]", "± [Hz]", "damping [%]", "± [%]")
    rows = [(f"{f:.6g}", f"{e:.2g}", f"{100 * z:.4g}", f"{100 * ze:.2g}") for f, e, z, ze in modes]
    return data, [f"{fitted.finding()}.", *table(header, rows), *said, *(wrote(path) for path in written)]


def _beyond(fitted: FittedModes) -> list[str]:
    """What lies beyond the band, what the misfit says, in sentences."""
    said = []
    f = fitted.responses.frequency
    fit = fitted.shape_fit
    for (omega, _), shape in zip(fit.ends, fit.beyond.T, strict=True) if fit is not None else ():
        here = int(np.argmax(np.abs(shape)))
        name, at = fitted.responses.dofs[here], omega / (2 * np.pi)
        if at > f[-1]:
            size = 1e6 * shape[here] ** 2 / omega**2
            said.append(
                f"modes above the band add {size:.3g} um/N at {name}; they are written as one at {at:.4g} Hz, where "
                "nothing was measured."
            )
        else:
            free = "a free motion" if at == 0 else f"one at {at:.4g} Hz, where nothing was measured"
            said.append(
                f"below the band {name} moves like a mass of {1 / shape[here] ** 2:.3g} kg; that is written as {free}."
            )
    if fitted.scatter > 2:
        said.append(
            f"the modes miss {np.sqrt(fitted.scatter):.2g} times what the deviations of the lines allow: the "
            "structure is "
            "not linear, its responses do not belong together, or the deviations are too small; the errors are widened."
        )
    return said
