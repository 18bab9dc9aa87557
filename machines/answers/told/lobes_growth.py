"""What ``jointlib lobes`` says of the growth of a vibration at a speed and depth."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from jointlib.errors import CheckFailed, InputError
from jointlib.shown.progress import each
from jointlib.shown.text import table


def grown(
    model: Any, speeds: Any, depth: Sequence[float], amplitude: Sequence[float], witness: bool
) -> tuple[list[Any], list[str]]:
    """|μ| at every amplitude, speed and depth, nan and why where it cannot be had, or the cut is simulated anyway."""
    from ...cutting.amplitude.frozen_modes import multipliers

    if not depth:
        return [], []
    try:
        return [multipliers(model, speeds, depth, A) for A in amplitude or (0.0,)], []
    except CheckFailed:
        return _one_by_one(model, speeds, depth, amplitude)
    except InputError as refused:
        if not witness:
            raise
        return [], [f"No multiplier: {refused}"]


def _one_by_one(
    model: Any, speeds: Any, depth: Sequence[float], amplitude: Sequence[float]
) -> tuple[list[Any], list[str]]:
    """`grown` where some point fails: every other one is told all the same."""
    from ...cutting.amplitude.frozen_modes import multipliers

    found, said = np.full((len(amplitude) or 1, len(speeds), len(depth)), np.nan), list[str]()
    for at in each("multipliers", np.ndindex(*found.shape), found.size):
        A, n, b = (amplitude or (0.0,))[at[0]], float(speeds[at[1]]), depth[at[2]]
        try:
            found[at] = multipliers(model, n, b, A)[0, 0]
        except CheckFailed as failed:
            where = f"{n:g} rpm and {b * 1e3:g} mm" + (f", {A * 1e6:g} um" if A else "")
            said.append(f"No multiplier at {where}: {failed}")
    return list(found) if np.any(np.isfinite(found)) else [], said


def growth_tables(growth: Sequence[Any], speeds: Any, depth: Sequence[float], amplitude: Sequence[float]) -> list[str]:
    """|μ| at speeds (rpm) and depths (m), a table an amplitude (m)."""
    header, lines = ("speed [rpm]", *(f"|μ| at {w * 1e3:g} mm" for w in depth)), list[str]()
    for A, of_size in zip(amplitude or (0.0,), growth, strict=True):
        rows = [
            (f"{n:g}", *("–" if np.isnan(v) else f"{v:.6g}" for v in row))
            for n, row in zip(speeds, of_size, strict=True)
        ]
        lines += [f"at a tool-point amplitude of {A * 1e6:g} um:"] if A else []
        lines += table(header, rows)
    return lines
