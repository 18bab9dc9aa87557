"""What ``jointlib lobes`` says beyond the chart: growth at a depth, limits over amplitude, bands, the simulated cut."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from jointlib.cli.output import working
from jointlib.errors import InputError


def grown(
    model: Any, speeds: Any, depth: Sequence[float], amplitude: Sequence[float], witness: bool
) -> tuple[list[Any], list[str]]:
    """|μ| at every amplitude, speed and depth; where it cannot be had and the cut is simulated anyway, why."""
    from machines.lobes.frozen_modes import multipliers

    try:
        return [multipliers(model, speeds, depth, A) for A in amplitude or (0.0,)] if depth else [], []
    except InputError as refused:
        if not witness:
            raise
        return [], [f"No multiplier: {refused}"]


def over_amplitude(
    model: Any, speed: Sequence[float], depth: Sequence[float], method: str | None
) -> tuple[dict[str, Any], list[str]]:
    """Limits over amplitude at the chosen speeds, where something in the machine or its cut depends on it."""
    from machines.lobes.threshold import amplitude_limits, depends_on_amplitude
    from machines.lobes.words import told, told_at

    if not depends_on_amplitude(model):
        return {}, []
    with working("computing limits over amplitude"):
        limits = amplitude_limits(model, speed, method=method)
        said = [sentence for i in range(len(speed)) for sentence in told(limits, i)]
        said += [told_at(limits, b, i) for i in range(len(speed)) for b in depth]
        cycles = [[limits.cycles(b, i) for b in depth] for i in range(len(speed))]
    rows: dict[str, Any] = {
        "safe_depth": limits.safe,
        "safe_amplitude": limits.safe_amplitude,
        "onset_depth": limits.onset,
        "largest_amplitude": limits.largest,
    }
    if depth:
        rows["cycles"] = [[[vars(c) for c in at] for at in row] for row in cycles]
    return {"over_amplitude": rows, "told": said}, said


def bands(model: Any, speeds: Any, amplitude: Sequence[float], samples: int) -> tuple[dict[str, Any], list[str]]:
    """Depths at 2.5, 50 and 97.5 % of the samples, [share][speed], or [amplitude][share][speed]."""
    from machines.lobes.uncertainty import SHARES, lobe_band

    with working(f"computing {samples} samples"):
        found = [lobe_band(model, speeds, A, samples) for A in amplitude or (0.0,)]
    depth = [band.quantiles for band in found]
    said = []
    for A, values in zip(amplitude or (0.0,), depth, strict=True):
        at = f" at a tool-point amplitude of {A * 1e6:g} um" if A else ""
        for n, (low, middle, high) in zip(speeds, values.T * 1e3, strict=True):
            said.append(
                f"{n:g} rpm{at}: {low:.4g} to {high:.4g} mm in 95 % of {samples} samples, median {middle:.4g} mm"
            )
    clipped = sum(band.clipped for band in found)
    if clipped:
        said.append(f"{clipped} sampled parameters lay outside their bounds and were set to them.")
    return {"share": SHARES, "depth": depth if amplitude else depth[0], "samples": samples, "clipped": clipped}, said


def witnessed(
    model: Any, speed: Sequence[float], depth: Sequence[float], amplitude: Sequence[float]
) -> tuple[list[list[dict[str, Any]]], list[str]]:
    """The cut simulated at every speed and depth, [speed][depth], and told."""
    from machines.lobes.witness import witness

    rows, said = [], []
    for n in speed:
        row = []
        for b in depth:
            with working(f"simulating {n:g} rpm and {b * 1e3:g} mm"):
                found = witness(model, n, b, sorted(amplitude) or None)
            said.append(str(found))
            names = ("start", "end", "rate", "grows", "lost_contact", "frequency", "duration")
            row.append({k: getattr(found, k) for k in names} | {"cycles": [vars(c) for c in found.cycles]})
        rows.append(row)
    return rows, said
