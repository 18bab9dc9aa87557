"""Charts as numbers: their speeds, their promised keys, and their file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.io.atomic import write_npz


def default_speeds(machine: Any, count: int = 200) -> Any:
    """Evenly spaced speeds over the range of the machine file."""
    if machine.cutting is None:
        raise InputError(f"{machine.where}: no [cutting], lobes need a cutting operation")
    if machine.cutting.get("speed") is None:
        raise InputError(f"{machine.where}: [cutting] has no speed, expected one or --speed")
    low, high = machine.cutting["speed"]
    return np.linspace(low, high, count)


def chart_data(charts: Sequence[Any], speeds: Any, amplitude: Sequence[float]) -> dict[str, Any]:
    """The promised keys; the axis of an option that was not given is left out."""

    def shaped(values: Sequence[Any]) -> Any:
        return list(values) if amplitude else values[0]

    kinds = [[str(k) or None for k in c.kind] for c in charts]
    lobes = [[int(k) if k >= 0 else None for k in c.lobe] for c in charts]
    return {
        "speed": speeds,
        "depth": shaped([c.depth for c in charts]),
        "chatter_frequency": shaped([c.chatter_frequency for c in charts]),
        "kind": shaped(kinds),
        "lobe": shaped(lobes),
        "minimum_depth": shaped([c.minimum_depth for c in charts]),
        "method": charts[0].method,
        "notes": list(charts[0].notes),
        "warnings": sorted({w for c in charts for w in c.warnings}),
        **({"amplitude": list(amplitude)} if amplitude else {}),
    }


def write_lobes(
    path: Path, charts: Sequence[Any], speeds: Any, amplitude: Sequence[float], more: dict[str, Any] | None = None
) -> None:
    """``speed`` (rpm), ``amplitude`` (m), and depth (m), chatter_frequency (Hz), lobe as [amplitude, speed]."""
    fields = ("depth", "chatter_frequency", "lobe", "kind", "minimum_depth")
    arrays = {name: np.array([getattr(c, name) for c in charts]) for name in fields}
    write_npz(path, {"speed": speeds, "amplitude": np.array(amplitude), **arrays, **(more or {})})


def on_common_speeds(charts: Mapping[str, Sequence[Any]]) -> tuple[Array, dict[str, Array]]:
    """The depths of several tools, whose charts may have speeds of their own, on the speeds (rpm) of all of them.

    ``charts`` are by name of the tool, one an amplitude, None where there is none. Returns the speeds, ascending, and
    by name the depths in m as [amplitude, speed], NaN where that tool was not computed and ∞ where any depth is stable.
    """
    known = [np.ravel(chart.speed) for several in charts.values() for chart in several if chart is not None]
    speeds = np.unique(np.concatenate([np.zeros(0), *known]))
    depths = {name: np.full((len(several), len(speeds)), np.nan) for name, several in charts.items()}
    for name, several in charts.items():
        for row, chart in zip(depths[name], several, strict=True):
            if chart is not None:
                row[np.searchsorted(speeds, np.ravel(chart.speed))] = np.ravel(chart.depth)
    return speeds, depths
