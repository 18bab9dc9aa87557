"""Which parameter is told by which records."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError, Outcome
from jointlib.identification.estimate import Estimate, estimate
from jointlib.identification.first_values import held_at_default
from jointlib.identification.hertz_fit import HertzFit, fit_hertz
from jointlib.identification.records import FitRecords
from jointlib.identification.scatter import by_test, misses
from jointlib.identification.second_start import nearest_fit
from jointlib.identification.surface import HIGHEST, OrderTrial, fit_surface
from jointlib.joint import Covariance, Joint
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.loop.answer.refit import bounds_of

_UNTOLD = 0.3
"""Relative standard error above which shaken records do not tell a preload."""
_SMALL = 0.5
"""Share of the deflection at lift-off below which a guide hardly bends: u²/24, one percent of its force."""
_COLOURED = 0.3
"""Correlation of neighbouring residuals above which the points of a curve are not independent."""


@dataclass(frozen=True)
class Fit:
    """A joint with what was fitted of it."""

    joint: Joint
    covariance: Covariance
    rms: Mapping[Path, tuple[float, ...]]
    """Residual of every record by measurement file."""
    assumed: frozenset[str] = frozenset()
    unknowns: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """Value and standard error of what is not part of the joint."""
    static: HertzFit | None = None
    orders: tuple[OrderTrial, ...] = ()
    messages: tuple[str, ...] = ()

    def status(self, name: str) -> str:
        """fitted, fixed or assumed."""
        if name in self.covariance.names:
            return "fitted"
        return "assumed" if name in self.assumed else "fixed"


def law_fit(
    first: Joint, still: Sequence[FitRecords], moving: Sequence[FitRecords], second: Joint | None = None
) -> Fit:
    """Guide from the static records if there are any, the rest from the others with the guide held.

    ``second`` holds other first values to try where the noise does not explain what ``first`` leads to.
    """
    joint = replace(first, covariance=None)
    assumed = held_at_default(joint)
    guide = _guide(joint)
    messages = [
        f"{name} = {np.degrees(joint.parameters[name]):g} deg is assumed, no record tells it."
        for name in sorted(assumed)
        if joint.units[name] == "rad"
    ]
    static, rms, covariances = None, {}, []
    if guide is not None and still:
        static, joint = _from_static(joint, guide, still)
        covariance = static.covariance
        covariances.append(Covariance(tuple(f"{guide}.{n}" for n in covariance.names), covariance.matrix))
        messages += _static_messages(static, [t.measurement.source.name for t in still])
        rms = {t.measurement.source: _static_rms(static, t) for t in still}
    told = {f"{guide}.preload", f"{guide}.kappa"} if static is not None else set()
    free = [n for n in joint.parameters if n not in told | assumed | joint.fixed]
    tests = moving if moving else [] if static is not None else still
    if free and not tests:
        raise InputError(f"identify: {free[0]} has no data to fit, expected a rig or path measurement")
    unknowns: dict[str, tuple[float, float]] = {}
    if tests:
        found, held, remark = _resolved(joint, second, guide, tests, free)
        joint, assumed, messages = found.joint, assumed | held, messages + remark
        covariances.append(_part(found.covariance, [n for n in found.covariance.names if n in joint.parameters]))
        unknowns = {n: (v, found.covariance.standard_error(n)) for n, v in found.unknowns.items()}
        rms.update(_by_test(tests, found.rms))
        if static is not None and free:
            messages.append("Standard errors of the shaken or moved test do not contain those of the static fit.")
    return Fit(joint, _together(covariances), rms, assumed, unknowns, static, (), tuple(messages))


def _guide(joint: Joint) -> str | None:
    """Name of the ball guide; of several the first."""
    names = [n for n, law in zip(joint.part_names, joint.laws, strict=True) if law.kind == "hertz-guide"]
    return names[0] if names else None


def _from_static(joint: Joint, guide: str, still: Sequence[FitRecords]) -> tuple[HertzFit, Joint]:
    known = joint.parameters
    held = {n: known[f"{guide}.{n}"] if f"{guide}.{n}" in joint.fixed else None for n in ("preload", "kappa")}
    curve = [(b.z, b.target) for t in still for b in t.balances]
    fit = fit_hertz(
        np.concatenate([z for z, _ in curve]),
        np.concatenate([f for _, f in curve]),
        contact_angle=known[f"{guide}.contact_angle"],
        preload=held["preload"],
        kappa=held["kappa"],
    )
    return fit, joint.with_parameters({f"{guide}.preload": fit.law.preload, f"{guide}.kappa": fit.law.kappa})


def _static_rms(fit: HertzFit, test: FitRecords) -> tuple[float, ...]:
    residuals = [b.target - fit.law.force(b.z, np.zeros_like(b.z)) for b in test.balances]
    return tuple(float(np.sqrt(np.mean(r**2))) for r in residuals)


def _static_messages(fit: HertzFit, names: list[str]) -> list[str]:
    out = []
    listed = ", ".join(names)
    if not fit.resolved:
        out.append(f"{listed}: the curve is too straight to tell the preload; load it further past lift-off.")
    elif fit.correlation == fit.correlation:
        out.append(f"{listed}: preload and kappa are correlated by {fit.correlation:.4f}; use them as a pair.")
    residual = fit.load - fit.law.force(fit.deflection, np.zeros_like(fit.deflection))
    power = float(residual @ residual)
    if power and float(residual[1:] @ residual[:-1]) / power > _COLOURED:
        out.append(
            f"{listed}: neighbouring points err alike, so the law misses something and its errors are too small."
        )
    return out


def _resolved(
    joint: Joint, second: Joint | None, guide: str | None, tests: Sequence[FitRecords], free: list[str]
) -> tuple[Estimate, frozenset[str], list[str]]:
    """The fit; without the preload where the records do not tell it."""
    balances = tuple(b for t in tests for b in t.balances)
    found = nearest_fit(joint, second, tests, free)
    name = f"{guide}.preload"
    told = name not in free or found.covariance.standard_error(name) < _UNTOLD * found.joint.parameters[name]
    held: frozenset[str] = frozenset()
    remark: list[str] = []
    if not told:
        held, why = frozenset({name}), _untold(found, guide, tests)
        # The stiffness at rest is P0^(1/3)/kappa: the first values may be far from it at the held preload.
        found = estimate(joint, balances, [n for n in free if n != name], tests[0].unknowns)
        value = found.joint.parameters[name]
        remark = [f"{name}: {why}; {value:g} N is kept and kappa fitted to it."]
    if found.outcome is not Outcome.CONVERGED:
        remark.append("The fit did not settle; start it nearer, with fewer free parameters or from a start joint.")
    for other, value, low, high in zip(free, *_with_bounds(found.joint, joint, free), strict=True):
        if not low < value < high:
            remark.append(f"{other}: ended at the end of its range; the records do not ask for it.")
    if found.idle:
        fewer = "; a start joint (--start) with fewer elements leaves it out" if "[" in found.idle[0] else ""
        raise InputError(f"identify: {found.idle[0]} has no data to fit, no record depends on it{fewer}")
    return found, held, remark


def _untold(found: Estimate, guide: str | None, tests: Sequence[FitRecords]) -> str:
    """Why records do not tell the preload: how far they reach beside where the rows of the fit lift off."""
    law = found.joint.laws[found.joint.part_names.index(str(guide))]
    balances = [b for t in tests for b in t.balances]
    reach = max(float(np.ptp(b.z)) / 2 for b in balances)
    assert isinstance(law, HertzGuide)
    lift_off = law.lift_off_displacement
    far = f"the records reach {reach * 1e6:.2g} um, the rows lift off at about {lift_off * 1e6:.2g} um"
    for test, rms, noise in by_test(tests, found):
        if misses(rms, noise):
            # The lift-off of a law that does not fit says nothing.
            return (
                f"what the law leaves of {test.measurement.source.name}, {rms:.4g} N where noise explains {noise:.3g} "
                "N, hides it, whatever the amplitudes"
            )
    if reach < _SMALL * lift_off:
        return f"the amplitudes are too small to tell it ({far})"
    return f"the amplitudes would tell it ({far}), but {max(found.rms):.3g} N rms that the law leaves hide it"


def _with_bounds(found: Joint, first: Joint, names: list[str]) -> tuple[list[float], list[float], list[float]]:
    """Values and the open range inside which each counts as fitted, a millionth of the first value from its bounds."""
    values = [found.parameters[n] for n in names]
    margin = 1e-6 * np.abs([first.parameters[n] for n in names])
    lower, upper = bounds_of(first, names)
    return values, (lower + margin).tolist(), (upper - margin).tolist()


def surface_fit(
    tests: Sequence[FitRecords], kind: str, order: tuple[int, int] | None = None, start: Joint | None = None
) -> Fit:
    """A chebyshev or polynomial surface; ``start`` gives its orders."""
    if order is None and start is not None:
        rows, columns = np.shape(start.laws[0].coefficients)  # type: ignore[attr-defined]
        order = rows - 1, columns - 1
    balances = tuple(b for t in tests for b in t.balances)
    fit = fit_surface(balances, order, velocity=bool(tests[0].measurement.kind != "static"))
    law, matrix = (fit.law, fit.covariance) if kind == "chebyshev" else fit.polynomial()
    joint = Joint((law,)) if start is None else replace(start, laws=(law,), fixed=frozenset(), covariance=None)
    part = joint.part_names[0]
    table = np.shape(law.coefficients)
    names = tuple(f"{part}.coefficients[{i}][{j}]" for i in range(table[0]) for j in range(table[1]))
    errors = np.sqrt(np.diag(matrix))[len(names) :]
    beside = zip(tests[0].unknowns, fit.unknowns, errors, strict=True)
    unknowns = {name: (float(value), float(error)) for name, value, error in beside}
    messages = []
    if not fit.mean_seen:
        messages.append("The records do not hold the mean force; the joint at rest is set free of it.")
    if fit.trials and any(n - 1 == top for n, top in zip(table, HIGHEST, strict=True)):
        messages.append(f"The surface takes the largest order that was tried, {HIGHEST}: no smooth surface may fit.")
    covariance = Covariance(names, matrix[: len(names), : len(names)])
    return Fit(joint, covariance, _by_test(tests, fit.rms), frozenset(), unknowns, None, fit.trials, tuple(messages))


def _by_test(tests: Sequence[FitRecords], rms: tuple[float, ...]) -> dict[Path, tuple[float, ...]]:
    out, first = {}, 0
    for test in tests:
        last = first + len(test.balances)
        out[test.measurement.source] = rms[first:last]
        first = last
    return out


def _part(covariance: Covariance, names: list[str]) -> Covariance:
    index = [covariance.names.index(n) for n in names]
    matrix: Array = covariance.matrix[np.ix_(index, index)]
    return Covariance(tuple(names), matrix)


def _together(parts: Sequence[Covariance]) -> Covariance:
    """Block diagonal."""
    names = tuple(n for p in parts for n in p.names)
    matrix, first = np.zeros((len(names), len(names))), 0
    for part in parts:
        last = first + len(part.names)
        matrix[first:last, first:last] = part.matrix
        first = last
    return Covariance(names, matrix)
