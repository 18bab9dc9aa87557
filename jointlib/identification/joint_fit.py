"""From measurements to a joint."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import replace

from jointlib.errors import InputError
from jointlib.identification.first_values import first_laws, size_of
from jointlib.identification.fit import Fit, law_fit, surface_fit
from jointlib.identification.origin import provenance, validity
from jointlib.identification.records import FitRecords, open_records
from jointlib.identification.result import FitError, Found, Identification
from jointlib.identification.scatter import explained, misses, overall
from jointlib.identification.second_start import SHARE
from jointlib.identification.strange import strange_mass, turned, yielding
from jointlib.joint import Joint
from jointlib.measurement import Measurement

SURFACES = ("chebyshev", "polynomial")
"""Kinds whose table is fitted as a whole, with its order."""


def identify(
    measurements: Sequence[Measurement],
    *,
    laws: Sequence[str] | None = None,
    start: Joint | None = None,
    order: tuple[int, int] | None = None,
    joint_file: str = "JOINT",
) -> Identification:
    """Fit a joint to the fit records of one or several tests; sealed and quiet records stay closed.

    A ball guide takes preload and kappa from static records if there are any; all else is fitted to rig or path
    records with those held.

    Parameters
    ----------
    measurements
        Static, rig and path tests; rig and path not together. Errors are reported in the same order.
    laws
        Kinds of the laws; first values are guessed from the data.
    start
        A joint that gives the laws, first values and what is ``fixed``; instead of ``laws``.
    order
        Orders in displacement and velocity of a chebyshev or polynomial surface; chosen on held-out data if None.
    joint_file
        Where the joint will stand, for the command in a message.
    """
    if (not laws) == (start is None):
        raise InputError("identify: expected either laws or a start joint, not both and not none")
    if not measurements:
        raise InputError("identify: no measurement, expected at least one")
    tests = tuple(open_records(m) for m in measurements)
    still = tuple(t for t in tests if t.measurement.kind == "static")
    moving = tuple(t for t in tests if t.measurement.kind != "static")
    if len({t.measurement.kind for t in moving}) > 1:
        raise InputError("identify: rig and path measurements together, expected one of the two")
    sources = [t.measurement.source for t in tests]
    if len(set(sources)) < len(sources):
        raise InputError(f"identify: {max(sources, key=sources.count)} is given twice, expected each measurement once")
    if len({t.unknowns for t in moving}) > 1:
        raise InputError("identify: paths with and without an unknown carriage together, expected one of the two")
    kinds = tuple(laws) if laws else tuple(law.kind for law in start.laws) if start else ()
    tables = [kind for kind in kinds if kind in SURFACES]
    if tables and len(kinds) > 1:
        raise InputError(f"identify: {tables[0]} with other laws, expected a surface alone: it would take up theirs")
    if order is not None and not tables:
        raise InputError(f"identify: order {order} but no surface among the laws, {' or '.join(SURFACES)} has one")
    if tables:
        fit = surface_fit(moving or still, tables[0], order, start)
    else:
        sizes = size_of([b for t in moving or still for b in t.balances])
        second = None if start else Joint(first_laws(kinds, sizes.scaled(SHARE)))
        fit = law_fit(start or Joint(first_laws(kinds, sizes)), still, moving, second)
    used = tuple(t for t in tests if t.measurement.source in fit.rms)
    messages = [remark for t in tests for remark in t.remarks()] + list(fit.messages)
    for test in tests:
        if test.measurement.source not in fit.rms:
            messages.append(f"{test.measurement.source.name}: not used, the other records tell these laws.")
    errors = tuple(_error(t, fit) for t in used)
    missed = [(t, e) for t, e in zip(used, errors, strict=True) if misses(e.rms, e.noise)]
    messages += [_missing(t, e, joint_file) for t, e in missed]
    joint = replace(
        fit.joint,
        covariance=fit.covariance,
        validity={**fit.joint.validity, **validity(used)},
        provenance={**provenance(used), "residuals": [_residual(e) for e in errors]},
    )
    paths = [t for t in used if t.measurement.kind == "path"]
    for test in paths:
        messages += strange_mass(test.measurement, *fit.unknowns["carriage"]) if "carriage" in fit.unknowns else []
        messages += yielding((b.target, b.rows(b.v)) for b in test.balances)
    messages += turned(joint)
    return Identification(
        joint=joint,
        parameters=_table(joint, fit, bool(missed)),
        errors=errors,
        static=fit.static,
        surfaces=tuple(s for t in moving for s in t.surfaces),
        orders=fit.orders,
        messages=tuple(dict.fromkeys(messages)),
    )


def _residual(error: FitError) -> str:
    """What the laws do not explain of a measurement, in words that go into the joint's file."""
    return f"{error.measurement}: {error.rms:.3g} {error.unit} rms, {100 * error.relative:.2g} % of the largest"


def _missing(test: FitRecords, error: FitError, joint_file: str) -> str:
    command = shlex.join(["jointlib", "trace", str(test.measurement.source), "--joint", joint_file, "-o", "traced"])
    return (
        f"{error.measurement}: {error.rms:.4g} {error.unit} are left where noise explains {error.noise:.3g} "
        f"{error.unit}, so the law or the band misses something and the standard errors are those of a law that does "
        f"not fit; `{command}` looks for what."
    )


def _table(joint: Joint, fit: Fit, missed: bool) -> dict[str, Found]:
    """Every parameter with its standard error where it was fitted, then the unknowns beside the joint."""
    units = joint.units
    still = {n for n in joint.parameters if n.endswith((".preload", ".kappa"))} if fit.static is not None else set()
    out = {}
    for name, value in joint.parameters.items():
        status = fit.status(name)
        error = fit.covariance.standard_error(name) if status == "fitted" else None
        out[name] = Found(value, units[name], error, status, missed and status == "fitted" and name not in still)
    for name, (value, error) in fit.unknowns.items():
        out[name] = Found(value, {"carriage": "kg", "offset": "N"}[name], error, "fitted")
    return out


def _error(test: FitRecords, fit: Fit) -> FitError:
    rms = fit.rms[test.measurement.source]
    total, noise = overall(test.balances, rms), explained(test, fit.joint)
    peak = max(b.peak for b in test.balances)
    by_record = {b.name: r for b, r in zip(test.balances, rms, strict=True)}
    name, kind = test.measurement.source.name, test.measurement.kind
    return FitError(name, kind, total, test.unit, total / peak, by_record, noise)
