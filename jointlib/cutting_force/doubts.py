"""What is odd about coefficients that came out, and which slip in the file makes such."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from jointlib.cutting_force.cut import Cut
from jointlib.cutting_force.fit import CoefficientFit, ForceRecord, by_lines, by_means
from jointlib.cutting_force.tooth_force import COEFFICIENTS
from jointlib.cutting_force.uneven_fit import repeats, unlike, with_run_out
from jointlib.errors import InputError
from jointlib.measurement import Measurement

_DIFFER = 4.0
"""Standard errors from which on two fits are said to differ, and an edge to pull."""
_POOR = 4.0
"""χ² over degrees of freedom from which on the linear force is said not to hold."""
_CUT_BY_METALS = (50e6, 20e9)
"""N/m² of tangential force over the chip, wide of all metals: 300 to 6000 N/mm²."""
_USUAL = (300e6, 6e9)
_LISTED = 6
"""Flutes whose run-out is told one by one."""
_BETTER = 0.5
"""Share of what is left that another sense of milling must leave to be named."""
_OTHER = {"up": "down", "down": "up"}
_MOST_TEETH = 16
_HOLDS, _TELLS = 0.9, 0.5
"""Share of the power of the revolution's lines that those of the true number of teeth hold at least, and that the lines
of the file's number hold where it is not doubted."""


def refuse_teeth(m: Measurement, records: Sequence[ForceRecord]) -> None:
    """Refuse a number of teeth that the force does not repeat with, where another one is plain."""
    if (counted := heard_teeth(records)) != 0:
        raise InputError(
            f"{m.source}: the force repeats {counted} times a revolution of {records[0].cut.speed:.4g} rpm, not "
            f"{records[0].cut.teeth} times: is teeth {counted}, or the speed another one?"
        )


def refuse_sign(m: Measurement, fit: CoefficientFit, records: Sequence[ForceRecord]) -> None:
    """Refuse coefficients that no cut has, with the slip that makes them."""
    told = _named(fit)
    wrong = next((name for name in ("tangential", "normal") if told.get(name, 1.0) <= 0), None)
    if wrong is None:
        return
    sense = ", is mode (up, down) the other one" if records[0].cut.mode in ("up", "down") else ""
    raise InputError(
        f"{m.source}: {wrong} comes out as {1e-6 * told[wrong]:.4g} N/mm², expected more than 0: is it the "
        f'force on the workpiece (acts_on = "workpiece"), does a channel look the other way (direction){sense}, or x '
        "not along the feed?"
    )


def heard_teeth(records: Sequence[ForceRecord]) -> int:
    """How many teeth the lines of the revolution tell where that is another number than the file's; else 0."""
    lines = [r.turn for r in records if r.turn is not None and len(r.turn) > 2 * r.cut.teeth]
    if not lines or len({r.cut.teeth for r in records}) > 1:
        return 0
    n = min(len(line) for line in lines)
    power = np.sum([np.sum(np.abs(line[:n]) ** 2, axis=1) for line in lines], axis=0)
    total, given = float(np.sum(power[1:])), records[0].cut.teeth
    if np.sum(power[given::given]) > _TELLS * total:
        return 0
    others = [t for t in range(2, min(_MOST_TEETH, n - 1) + 1) if given % t]
    held = [t for t in others if np.sum(power[t::t]) > _HOLDS * total]
    return max(held, default=0)


def doubts(
    m: Measurement,
    records: Sequence[ForceRecord],
    means: CoefficientFit,
    lines: CoefficientFit | None,
    unheard: Sequence[str],
) -> list[str]:
    """Sentences on the fit that was taken, that to the lines where there is one, else to mean forces."""
    said, used = [], lines or means
    milled = records[0].cut.process == "milling"
    if len({round(r.cut.feed, 9) for r in records}) == 2:
        said.append("Two feeds: nothing tells whether the force grows straight with the feed; a third would.")
    if unheard:
        said.append(f"The teeth do not stand out of the noise in {', '.join(unheard)}: mean forces alone are used.")
    elif lines is None and milled:
        said.append("The lines of the teeth tell no angle of the spindle: mean forces alone are used.")
    sense = _of_sense(records, used) if milled else []
    said += sense or ([] if lines is None else _of_run_out(records, lines))
    if used.misfit > _POOR:
        said.append(
            f"The records miss the linear force by {used.misfit**0.5:.2g} times their scatter, and the errors are "
            "raised by that: immersion, helix or diameter may be others than the file says, the force may bend with "
            "the feed, the tool may vibrate, or the dynamometer resonate."
        )
    said += _of_size(used)
    if lines is not None:
        apart = (lines.value - means.value) / np.sqrt(np.diag(lines.covariance) + np.diag(means.covariance))
        for k in np.flatnonzero(np.abs(apart) > _DIFFER):
            said.append(
                f"{tuple(COEFFICIENTS)[lines.known[k]]}: mean forces alone say something else, by {abs(apart[k]):.2g} "
                "standard errors; mind the zero of the dynamometer and its bandwidth."
            )
    return said


def _named(fit: CoefficientFit) -> dict[str, float]:
    names = tuple(COEFFICIENTS)
    return {names[k]: float(value) for k, value in zip(fit.known, fit.value, strict=True)}


def _of_run_out(records: Sequence[ForceRecord], fit: CoefficientFit) -> list[str]:
    """What was taken out of the coefficients, or what stands between the lines of the teeth and is no run-out."""
    if fit.run_out:
        out = [1e6 * r for r in fit.run_out]
        each = ", ".join(f"{r:+.3g}" for r in out)
        told = f"{each} um" if len(out) <= _LISTED else f"{min(out):+.3g} to {max(out):+.3g} um"
        return [
            f"Run-out: the flutes stand out by {told} from their mean, in the order in which they cut, each ± "
            f"{1e6 * max(fit.run_out_error):.1g} um; the coefficients are without it."
        ]
    if not any(repeats(record) for record in records):
        return []
    return [
        f"The force differs from tooth to tooth by {unlike(records):.3g} N rms, which run-out of even teeth does not "
        "explain: mind pitch and wear; the coefficients are those of a mean tooth."
    ]


def _of_size(fit: CoefficientFit) -> list[str]:
    found, (low, high) = _named(fit).get("tangential", _USUAL[0]), _CUT_BY_METALS
    if low <= found <= high:
        return []
    factor = next((f for f in (1e3, 1e-3) if _USUAL[0] <= found * f <= _USUAL[1]), None)
    slip = f"; {factor:g} times that would be usual" if factor else ""
    usual = f"{1e-6 * _USUAL[0]:g} to {1e-6 * _USUAL[1]:g}"
    return [
        f"tangential {1e-6 * found:.3g} N/mm² is not that of a metal, {usual}{slip}: unless it is wood or foam, mind "
        "the unit of the channels (N or kN), the depth and the feed a tooth."
    ]


def _of_sense(records: Sequence[ForceRecord], fit: CoefficientFit) -> list[str]:
    """Edges that pull and forces that fit badly, as those of the other sense of milling do."""
    error = np.sqrt(np.diag(fit.covariance))
    pulls = [
        f"{tuple(COEFFICIENTS)[k]} {1e-3 * fit.value[i]:.3g} ± {1e-3 * error[i]:.1g} N/mm"
        for i, k in enumerate(fit.known)
        if k in (3, 4) and fit.value[i] < -_DIFFER / 2 * error[i]
    ]
    bad = fit.misfit > _POOR and fit.method == "instantaneous"
    other = _other_way(records) if pulls or bad else None
    rms, left = (float(np.sqrt(np.mean(np.square(of.left)))) if of else np.inf for of in (fit, other))
    if left < _BETTER * rms:
        said, told = f"; an edge pulls ({pulls[0]})" if pulls else "", records[0].cut.mode
        mode = _OTHER[told]
        return [
            f"As {mode}-milling the records leave {left:.3g} N rms, as {told}-milling {rms:.3g} N{said}: is it "
            f'mode = "{mode}", or does an axis look the other way?'
        ]
    if pulls:
        return [
            f"An edge pulls ({', '.join(pulls)}), expected a force against the tool: are mode (up, down), the "
            "directions of the axes, their signs and the zero right?"
        ]
    return []


def _other_way(records: Sequence[ForceRecord]) -> CoefficientFit | None:
    """The fit with the other sense of milling; None where none can be made or it is none of a cut."""
    cuts: list[Cut] = [r.cut for r in records]
    if any(cut.mode not in _OTHER for cut in cuts):
        return None
    turned = [
        replace(r, cut=replace(cut, mode=_OTHER[cut.mode]), run_out=()) for r, cut in zip(records, cuts, strict=True)
    ]
    try:
        lines = by_lines(turned, by_means(turned))
    except InputError:
        return None
    found = None if lines is None else with_run_out(turned, lines) or lines
    told = {} if found is None else _named(found)
    return found if min(told.get("tangential", 0.0), told.get("normal", 1.0)) > 0 else None
