"""Least-squares parameters of a joint from force balances, with errors that hold for unequal noise."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from jointlib.arrays import Array
from jointlib.errors import InputError, Outcome
from jointlib.identification.force_balance import ForceBalance, Groups, stacked_extra, stacked_groups
from jointlib.joint import Covariance, Joint
from jointlib.loop.answer.refit import Scaled


@dataclass(frozen=True)
class Estimate:
    """What a fit found; ``covariance`` covers the free parameters of the joint and the unknowns beside it."""

    joint: Joint
    unknowns: dict[str, float]
    covariance: Covariance
    rms: tuple[float, ...]
    """Root mean square residual of every balance, N."""
    idle: tuple[str, ...] = ()
    """Free parameters on which no record depends."""
    outcome: Outcome = Outcome.CONVERGED


def estimate(
    joint: Joint, balances: tuple[ForceBalance, ...], free: Sequence[str], unknowns: Sequence[str] = ()
) -> Estimate:
    """Fit the parameters named in ``free``; the linear ``unknowns`` are solved along at every step.

    The covariance is the sandwich B (Σ_g s_g s_gᵀ) B with B = (JᵀJ)⁻¹ and s_g = J_gᵀ r_g summed within a group of
    rows: spectral lines or stretches of time may be noisier than others, and noise within a stretch may be coloured.
    """
    extra = stacked_extra(balances)
    if extra.shape[1] != len(unknowns):
        raise InputError(f"identify: {extra.shape[1]} further columns for {len(unknowns)} unknowns")
    target = np.concatenate([b.target for b in balances])
    basis = np.linalg.qr(extra)[0] if extra.size else extra

    def residual(at: Joint) -> Array:
        r = target - forces_of(at, balances)
        return np.asarray(r - basis @ (basis.T @ r))

    moving = tuple(n for n in free if n not in joint.fixed)
    if len(target) <= len(moving) + len(unknowns):
        asked = len(moving) + len(unknowns)
        raise InputError(f"identify: {len(target)} rows for {asked} parameters, expected more data")
    fitted, outcome = _solve(joint, balances, residual, moving) if moving else (joint, Outcome.CONVERGED)
    raw = target - forces_of(fitted, balances)
    solved = np.linalg.lstsq(extra, raw, rcond=None)[0] if extra.size else np.empty(0)
    r = raw - extra @ solved
    steps = _steps(fitted, balances, moving)
    columns = [sensitivity(fitted, balances, name, steps[name]) for name in moving]
    J = np.column_stack([*columns, extra]) if columns else extra
    covariance = Covariance((*moving, *unknowns), sandwich(J, r, stacked_groups(balances)))
    cuts = np.cumsum([len(b.target) for b in balances])[:-1]
    rms = tuple(float(np.sqrt(np.mean(part**2))) for part in np.split(r, cuts))
    idle = tuple(name for name, column in zip(moving, columns, strict=True) if not np.any(column))
    return Estimate(fitted, dict(zip(unknowns, solved.tolist(), strict=True)), covariance, rms, idle, outcome)


def _solve(
    joint: Joint, balances: tuple[ForceBalance, ...], residual: Callable[[Joint], Array], names: tuple[str, ...]
) -> tuple[Joint, Outcome]:
    """Least squares within the bounds that the laws declare; forces with memory bend in steps and end sooner."""
    steps = _steps(joint, balances, names)
    scale = np.array([max(abs(joint.parameters[n]), 1e3 * steps[n]) for n in names])
    scaled = Scaled(joint, names, scale)
    basis_free = residual(joint)

    def rows(x: Array) -> Array:
        try:
            return residual(scaled.at(x))
        except InputError:
            return np.full_like(basis_free, 1e3 * max(float(np.max(np.abs(basis_free))), 1.0))

    def slopes(x: Array) -> Array:
        here = scaled.at(x)
        moved = [sensitivity(here, balances, n, 1e-5 * s) for n, s in zip(names, scale, strict=True)]
        columns = np.column_stack(moved) * scale
        return -_without_extra(columns, balances)

    tolerance = 1e-5 if joint.states else 1e-13
    solved = scipy.optimize.least_squares(
        rows,
        scaled.start,
        jac=slopes,
        bounds=scaled.bounds,
        x_scale="jac",
        xtol=tolerance,
        ftol=tolerance,
        gtol=1e-15,
        max_nfev=60,
    )
    return scaled.at(solved.x), Outcome.CONVERGED if solved.status > 0 else Outcome.STALLED


def forces_of(joint: Joint, balances: tuple[ForceBalance, ...]) -> Array:
    """Forces of a joint in the rows of all balances; those with memory walk records of one shape side by side."""
    remembering, memoryless = joint.parted(lambda law: bool(law.states))
    total = [b.of(memoryless) for b in balances]
    if remembering.laws:
        shapes = {(len(b.z), b.time_step, b.run_in) for b in balances}
        for shape in sorted(shapes):
            alike = [k for k, b in enumerate(balances) if (len(b.z), b.time_step, b.run_in) == shape]
            paths = [np.stack(x, axis=-1) for x in zip(*(balances[k].path() for k in alike), strict=True)]
            force = remembering.force_along(paths[0], paths[1], shape[1])[-shape[0] :]
            for column, k in enumerate(alike):
                total[k] = total[k] + balances[k].rows(force[:, column])
    return np.concatenate(total)


def _without_extra(columns: Array, balances: tuple[ForceBalance, ...]) -> Array:
    extra = stacked_extra(balances)
    if not extra.size:
        return columns
    basis = np.linalg.qr(extra)[0]
    return np.asarray(columns - basis @ (basis.T @ columns))


def _steps(joint: Joint, balances: tuple[ForceBalance, ...], names: tuple[str, ...]) -> dict[str, float]:
    """Difference step of each parameter: a share of its value, or what changes the force visibly where that is zero."""
    size = float(np.linalg.norm(np.concatenate([b.target for b in balances])))
    steps = {}
    for name in names:
        step = 1e-5 * abs(joint.parameters[name])
        probe = 1e-12
        while step == 0 and probe < 1e30:
            change = float(np.linalg.norm(sensitivity(joint, balances, name, probe))) * probe
            if change > 1e-7 * size:
                step = 1e-5 * size * probe / change
            probe *= 1e3
        steps[name] = step or 1e-9
    return steps


def sandwich(J: Array, r: Array, groups: Groups) -> Array:
    """Covariance of least-squares parameters of rows r with Jacobian J, noise shared within groups."""
    parameters = J.shape[1]
    if parameters == 0:
        return np.empty((0, 0))
    size = np.linalg.norm(J, axis=0)
    size = np.where(size > 0, size, 1.0)
    X = J / size
    bread = np.linalg.pinv(X.T @ X, rcond=1e-14, hermitian=True)
    count = int(groups.max()) + 1
    scores = np.zeros((count, parameters))
    np.add.at(scores, groups, X * r[:, None])
    small_sample = count / (count - parameters) if count > parameters else 1.0
    return np.asarray(small_sample * bread @ (scores.T @ scores) @ bread / np.outer(size, size))


def sensitivity(joint: Joint, balances: tuple[ForceBalance, ...], name: str, step: float) -> Array:
    """∂(rows)/∂parameter by central differences, one-sided where a bound is near."""
    value = joint.parameters[name]
    part = name.split(".", 1)[0]
    sides = []
    for h in (step, -step):
        try:
            moved = joint.with_parameters({name: value + h})
        except InputError:
            h, moved = 0.0, joint
        # Only the law that holds the parameter changes.
        sides.append((h, Joint((moved.laws[joint.part_names.index(part)],))))
    (up, above), (down, below) = sides
    if up == down:
        return np.zeros(sum(len(b.target) for b in balances))
    return (forces_of(above, balances) - forces_of(below, balances)) / (up - down)
