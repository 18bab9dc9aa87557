"""The machine with the joint of one place changed, and what its parameters became."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib.metadata import version
from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.joint import Covariance, Joint
from jointlib.loop.answer.refit import bounds_of
from jointlib.loop.answer.report import Estimate

from ..model.machine import Machine
from .explanations.hypothesis import of_rotation
from .fit import Fitted
from .forward import with_joints
from .records import LevelFRF

_STEP = 1e-5


def parameters_of(fitted: Fitted, inflate: float) -> dict[str, Estimate]:
    """Parameters of the place's stiffest row that the fit moved, with 95 % intervals, and those of its rotations."""
    out = {}
    for named, row in _told_rows(fitted):
        joint = fitted.hypothesis.joints(fitted.u, exact=True)[row]
        connection, covariance = fitted.hypothesis.machine.flexible[row], _covariance(fitted, row, inflate)
        for name, lower, upper in zip(covariance.names, *bounds_of(joint, covariance.names), strict=True):
            value, error = joint.parameters[name], covariance.standard_error(name)
            # Within the range of the parameter: a smoothing velocity may be zero, as that of dry friction is.
            interval = (max(value - 1.96 * error, float(lower)), min(value + 1.96 * error, float(upper)))
            out[named(name)] = Estimate(value, connection.own_unit(joint.units[name]), error, interval)
    return out


def _told_rows(fitted: Fitted) -> list[tuple[Callable[[str], str], int]]:
    """The rows that stand for a place, its stiffest and a rotation beside deflections, and how they are named."""
    place = fitted.hypothesis.place
    stiffest = place.rows[int(np.argmax(place.share))]
    return [(str, stiffest), *((of_rotation, row) for row in place.turned[:1])]


def shifts_of(fitted: Fitted) -> dict[str, float]:
    """How far each own parameter moves, in its standard deviations, where the joint had them."""
    row = fitted.hypothesis.place.rows[int(np.argmax(fitted.hypothesis.place.share))]
    given = fitted.hypothesis.machine.joints()[row]
    if given.covariance is None:
        return {}
    now = fitted.hypothesis.joints(fitted.u, exact=True)[row].parameters
    out = {}
    for name in given.covariance.names:
        error = given.covariance.standard_error(name)
        if error > 0 and name in now:
            out[name] = (now[name] - given.parameters[name]) / error
    return out


def mended(
    machine: Machine,
    fitted: Fitted,
    inflate: float,
    records: Sequence[LevelFRF],
    sealed: Sequence[LevelFRF] = (),
) -> Machine:
    """The machine with the fitted joints, their covariance and where it comes from."""
    joints = list(fitted.hypothesis.joints(fitted.u, exact=True))
    used = [seal(r) for r in records]
    made: dict[int, Joint] = {}
    for row in fitted.hypothesis.place.rows:
        joint = joints[row]
        if id(joint) not in made:
            before = machine.joints()[row].provenance
            provenance: dict[str, Any] = {**before, "traced": used, "version": version("jointlib")}
            if sealed:
                provenance["seal_opened"] = [*before.get("seal_opened", []), *(seal(r) for r in sealed)]
            made[id(joint)] = replace(joint, covariance=_covariance(fitted, row, inflate), provenance=provenance)
        joints[row] = made[id(joint)]
    return with_joints(machine, joints)


def seal(record: LevelFRF) -> str:
    """A record as joints remember it."""
    return f"{record.name} sha256:{record.sha256}"


def spent(machine: Machine, frfs: Sequence[LevelFRF]) -> tuple[str, ...]:
    """A sentence for every sealed record that an earlier trace of a joint of this machine has opened."""
    known = {s for joint in machine.joints() for s in joint.provenance.get("seal_opened", [])}
    return tuple(
        f"The seal of {r.name} was opened in an earlier trace; it is spent."
        for r in frfs
        if r.sealed and seal(r) in known
    )


def _covariance(fitted: Fitted, row: int, inflate: float) -> Covariance:
    """Of the parameters of one row that the coordinates move."""
    hypothesis = fitted.hypothesis

    def values(u: Array) -> dict[str, float]:
        return hypothesis.joints(u, exact=True)[row].parameters

    here = values(fitted.u)
    slopes = []
    for i in range(len(fitted.u)):
        up, down = (fitted.u + s * _STEP * np.eye(len(fitted.u))[i] for s in (1.0, -1.0))
        more, less = values(up), values(down)
        slopes.append([(more[k] - less[k]) / (2 * _STEP) for k in here])
    D = np.array(slopes).reshape(len(fitted.u), len(here)).T
    moved = np.any(D != 0, axis=1)
    names = tuple(k for k, m in zip(here, moved, strict=True) if m)
    return Covariance(names, D[moved] @ fitted.covariance(inflate) @ D[moved].T)
