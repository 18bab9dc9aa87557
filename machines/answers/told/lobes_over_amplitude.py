"""What ``jointlib lobes`` says beyond the chart: limits over amplitude, bands, the simulated cut."""

from __future__ import annotations

import re
import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from jointlib.errors import CheckFailed, InputError
from jointlib.shown.progress import Progress, each

from ...deadline import OutOfTime, within

_FEW = (0.1, 0.3, 1.0)
_MANY = (0.001, 0.003, 0.01, 0.03, *np.linspace(0.06, 1.0, 24))
"""Tool amplitudes behind the zones of a picture over the largest, in milling, where each costs more, and in turning."""


def lenses(
    model: Any, chart: Any, depth: Sequence[float], budget: float, progress: Progress
) -> tuple[dict[str, Any], list[Any], list[str]]:
    """Every unstable interval of depth at the chosen speeds, at rest: as JSON, as they are, and told.

    They are looked for as deep as the deepest ``depth`` (m) at least, for as long as the ``budget`` (s). None at a
    speed at which they cannot be had, which is told.
    """
    from ...cutting.amplitude.unstable_depths import DEEPER, REACH, unstable_depths
    from ...cutting.amplitude.words import told_lenses
    from ...cutting.process.chart import BY_SPEED

    found, words, refusals = list[Any](), list[str](), dict[str, list[float]]()
    with progress.step("looking for stable cuts above the limits"), within(budget):
        for i in each("speeds", range(chart.speed.size), chart.speed.size):
            one = replace(chart, **{key: getattr(chart, key)[i : i + 1] for key in BY_SPEED})
            try:
                found += unstable_depths(model, one, np.fmax(REACH * one.depth, DEEPER * max(depth, default=0.0)))
                words += told_lenses(found[-1])
            except (CheckFailed, InputError) as refused:
                found.append(None)
                refusals.setdefault(_of_any_speed(str(refused), chart.speed[i]), []).append(chart.speed[i])
    for reason, speeds in refusals.items():
        *first, last = (f"{speed:g}" for speed in speeds)
        at = f"{', '.join(first)} and {last}" if first else last
        words.append(f"Stable cuts above the limits at {at} rpm are not known: {reason}")
    rows = [None if one is None else [vars(zone) for zone in one.intervals] for one in found]
    data = {"unstable": {"deepest": [None if one is None else one.deepest for one in found], "intervals": rows}}
    return ({}, [], words) if all(row is None for row in rows) else (data, found, words)


def _of_any_speed(refused: str, speed: float) -> str:
    """Why an answer was refused at a speed, in words that fit others that were refused for the same reason."""
    return re.sub(r" up to a depth of \S+ mm", "", refused.replace(f"at {speed:g} rpm ", ""))


def over_amplitude(
    model: Any,
    speed: Sequence[float],
    depth: Sequence[float],
    method: str | None,
    zones: Sequence[Any],
    growth: Any,
    budget: float,
    progress: Progress,
) -> tuple[dict[str, Any], list[str]]:
    """Limits over amplitude at the chosen speeds, where something in the machine or its cut depends on it.

    ``zones`` are the unstable depths at rest and ``growth`` the multipliers, [speed][depth], if known. With very many
    joints that depend on amplitude they are left out, and that is said, where they would take far more than the
    ``budget`` (s); where it ends before all amplitudes are known, what is known is told.
    """
    from ...cutting.amplitude.amplitude_limits import amplitude_limits, depends_on_amplitude
    from ...cutting.amplitude.sampled_amplitudes import amplitude_range
    from ...cutting.amplitude.words import LOWER_EDGE, told_so_far
    from ...cutting.forced.beside_cut import told_cuts
    from ...cutting.process.cutting import Cutting

    if not depends_on_amplitude(model):
        return {}, []
    unlike = Cutting(**(model.cutting or {})).unlike
    if unlike:
        left = f"Limits over amplitude are not followed with {unlike}; --amplitude gives the limit at one."
        return {"told": [left]}, [left]
    sizes = amplitude_range(Cutting(**(model.cutting or {})))
    if left := _too_long("Limits over amplitude", model, sizes, budget, progress):
        return {"told": [left]}, [left]
    try:
        with progress.step(f"computing limits over amplitude, in at most {budget:.3g} s"), within(budget):
            limits = amplitude_limits(model, speed, method=method)
    except OutOfTime as short:
        left = f"Limits over amplitude were left out, {budget:.3g} s being left of --budget: {short}."
        return {"told": [left]}, [left]
    if limits.whole:
        with progress.step("following vibrations over amplitude"):
            said, cycles = told_cuts(model, limits, depth, zones or None, growth)
    else:
        said, cycles = told_so_far(limits, budget), []
    said += [LOWER_EDGE] if any(one is not None and one.lenses for one in zones) else []
    rows: dict[str, Any] = {
        "safe_depth": limits.safe,
        "safe_amplitude": limits.safe_amplitude,
        "onset_depth": limits.onset,
        "largest_amplitude": limits.largest,
    }
    if depth and limits.whole:
        rows["cycles"] = [[[vars(c) for c in at] for at in row] for row in cycles]
    return {"over_amplitude": rows, "told": said}, said


def bands(
    model: Any, charts: Sequence[Any], amplitude: Sequence[float], samples: int, progress: Progress
) -> tuple[dict[str, Any], list[str]]:
    """Depths at 2.5, 50 and 97.5 % of the samples, [share][speed], or [amplitude][share][speed]."""
    from ...uncertainty.lobe_bands import SHARES, lobe_band

    method, speeds = charts[0].method, charts[0].speed
    about = ""
    if method not in ("turning", "zero-order"):
        begun = time.perf_counter()
        lobe_band(model, speeds, amplitude[0] if amplitude else 0.0, 1, method=method)
        cost = (time.perf_counter() - begun) * samples * len(charts)
        about = f" by {method}, about {cost:.0f} s (zero-order is a fast preview)"
    with progress.step(f"computing {samples} samples{about}"):
        found = [lobe_band(model, speeds, A, samples, method=method) for A in amplitude or (0.0,)]
    depth = [band.quantiles for band in found]
    said = []
    for A, values in zip(amplitude or (0.0,), depth, strict=True):
        at = f" at a tool-point amplitude of {A * 1e6:g} um" if A else ""
        for n, (low, middle, high) in zip(speeds, values.T * 1e3, strict=True):
            said.append(
                f"{n:g} rpm{at}: {low:.4g} to {high:.4g} mm in 95 % of {samples} samples, median {middle:.4g} mm"
            )
    if method == "zero-order":
        said.append("The band is by zero order, a preview: it says how far the depths are uncertain.")
    clipped, failed = sum(band.clipped for band in found), sum(band.failed for band in found)
    if clipped:
        said.append(f"{clipped} sampled parameters lay outside their bounds and were set to them.")
    if failed:
        said.append(f"{failed} samples could not be computed and are left out of the band.")
    data = {"share": SHARES, "depth": depth if amplitude else depth[0], "samples": samples}
    return data | {"method": method, "clipped": clipped, "failed": failed}, said


def _too_long(what: str, model: Any, sizes: Any, budget: float, progress: Progress) -> str:
    """Why something at several amplitudes (m) is left out; empty where it is not.

    With very many joints that depend on amplitude not even a few may be reached in the ``budget`` (s).
    """
    from ...cutting.amplitude.amplitude_limits import FEWEST
    from ...cutting.amplitude.chattering_tool import seconds_of_chart
    from ...cutting.forced.forced_vibration import too_many
    from ...cutting.process.cutting import Cutting

    many = too_many(model)
    if not many:
        return ""
    if not budget:
        return f"{what} were left out: --budget leaves no time for {many} joints that depend on it."
    # The largest comes second, and is the dearest by far where joints slip.
    for size, enough in ((float(np.max(sizes)), budget), (float(np.median(sizes)), budget / FEWEST)):
        with progress.step(f"looking how long a chart at {size * 1e6:.3g} um takes"):
            needed = seconds_of_chart(model, Cutting(**(model.cutting or {})), size, enough)
        if needed > enough:
            return (
                f"{what} were left out: with {many} joints that depend on it {size * 1e6:.3g} um takes "
                f"{needed / 60:.2g} minutes or more, so that fewer than {FEWEST} of {len(sizes)} amplitudes are known "
                f"after the {budget:.3g} s that --budget leaves."
            )
    return ""


def zones_of(
    model: Any, charts: Sequence[Any], amplitude: Sequence[float], took: float, budget: float, progress: Progress
) -> tuple[Any, list[str]]:
    """Safe, bistable and finite chatter over amplitude for a picture: of the charts, else of a few amplitudes more.

    None where nothing depends on amplitude, or where they would take more than the ``budget`` (s), which is told;
    the charts there are ``took`` so many seconds.
    """
    from ...cutting.amplitude.amplitude_limits import amplitude_limits, depends_on_amplitude
    from ...cutting.amplitude.sampled_amplitudes import amplitude_range
    from ...cutting.amplitude.zones import Zones
    from ...cutting.process.cutting import Cutting

    if amplitude:
        return Zones.between(list(zip(amplitude, charts, strict=True))), []
    cutting = Cutting(**(model.cutting or {}))
    if not cutting.plain or not depends_on_amplitude(model):
        return None, []
    largest = amplitude_range(cutting)[-1]
    sizes = largest * np.array(_FEW if cutting.process == "milling" else _MANY)
    left = _too_long("Zones over amplitude", model, sizes, budget, progress)
    if not left and len(sizes) * took > budget:
        left = (
            f"Zones over amplitude were left out: {len(sizes)} charts that take {took:.0f} s each are more than the "
            f"{budget:.3g} s that --budget leaves."
        )
    if left:
        return None, [left]
    try:
        with progress.step(f"computing limits at {len(sizes)} amplitudes, in at most {budget:.3g} s"), within(budget):
            limits = amplitude_limits(model, charts[0].speed, sizes, rest=charts[0])
    except OutOfTime:
        return None, [f"Zones over amplitude were left out: not done in the {budget:.3g} s that --budget leaves."]
    some = f"Time was up after {budget:.3g} s: zones over amplitude are those of {len(limits.amplitude)} amplitudes."
    return Zones.of(limits), [] if limits.whole else [some]


def lenses_to(
    model: Any, chart: Any, deepest: float, budget: float, progress: Progress
) -> tuple[tuple[Any, ...], list[str]]:
    """The unstable depths of a chart at rest for a picture up to ``deepest`` in m, and told where some are missing.

    None where they cannot be had; those that are known where the ``budget`` (s) ends.
    """
    from ...cutting.amplitude.unstable_depths import closer_at_lenses

    with progress.step("looking for stable cuts above the limits"), within(budget):
        try:
            found = closer_at_lenses(model, chart, deepest)
        except (CheckFailed, InputError):
            return (), []
    some = len({one.speed for one in found} & set(chart.speed.tolist()))
    if some == chart.speed.size:
        return found, []
    return found, [
        f"Time was up: stable cuts above the limits were looked for at {some} of {chart.speed.size} speeds; the "
        "picture draws all depths above the others as unstable."
    ]


def witnessed(
    model: Any, speed: Sequence[float], depth: Sequence[float], amplitude: Sequence[float], progress: Progress
) -> tuple[list[list[dict[str, Any]]], list[str]]:
    """The cut simulated at every speed and depth, [speed][depth], and told."""
    from ...cutting.in_time.witness import witness

    rows, said = [], []
    for n in speed:
        row = []
        for b in depth:
            with progress.step(f"simulating {n:g} rpm and {b * 1e3:g} mm"):
                found = witness(model, n, b, sorted(amplitude) or None)
            said.append(str(found))
            names = ("start", "end", "rate", "grows", "lost_contact", "frequency", "duration")
            row.append({k: getattr(found, k) for k in names} | {"cycles": [vars(c) for c in found.cycles]})
        rows.append(row)
    if (model.cutting or {}).get("wear_land") is not None:
        said.append("In the simulated cut the flank damps linearly, by indentation · wear_land²/2 whatever the wave.")
    return rows, said
