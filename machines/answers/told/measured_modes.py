"""What is told of the modes of measured frequency responses."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from jointlib.shown.text import table

if TYPE_CHECKING:
    from jointlib.modal_fit.fitted_modes import FittedModes

    from ..modes import MeasuredModes


def measured_as_json(found: MeasuredModes) -> dict[str, Any]:
    """What is printed as JSON."""
    fitted = found.fitted
    columns = (fitted.frequency, fitted.damping_ratio, fitted.frequency_error, fitted.damping_ratio_error)
    names = ("frequency", "damping_ratio", "frequency_error", "damping_ratio_error")
    return {
        "modes": [dict(zip(names, map(float, mode), strict=True)) for mode in zip(*columns, strict=True)],
        "fit_error": fitted.fit_error,
        "scatter": fitted.scatter,
        "proportional": fitted.is_proportional,
        "residual_modes": [] if fitted.shape_fit is None else (fitted.shape_fit.ends[:, 0] / (2 * np.pi)).tolist(),
        "sentence": fitted.finding(),
        "warnings": found.warnings,
        "file": next((str(file) for file in found.files if file.suffix == ".toml"), None),
    }


def measured_in_words(found: MeasuredModes) -> list[str]:
    """What is printed in words."""
    fitted = found.fitted
    header = ("mode [Hz]", "± [Hz]", "damping [%]", "± [%]")
    columns = (fitted.frequency, fitted.frequency_error, fitted.damping_ratio, fitted.damping_ratio_error)
    rows = [(f"{f:.6g}", f"{e:.2g}", f"{100 * z:.4g}", f"{100 * ze:.2g}") for f, e, z, ze in zip(*columns, strict=True)]
    return [f"{fitted.finding()}.", *table(header, rows), *found.warnings]


def beyond(fitted: FittedModes, computed: bool = False) -> list[str]:
    """What lies beyond the band, what the misfit says, in sentences; ``computed`` responses were not measured."""
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
        why = (
            "modes lie closer together than the lines tell apart, or a part is no sum of modes"
            if computed
            else "the structure is not linear, its responses do not belong together, or the deviations are too small"
        )
        said.append(
            f"the modes miss {np.sqrt(fitted.scatter):.2g} times what the deviations of the lines allow: {why}; the "
            "errors are widened."
        )
    return said
