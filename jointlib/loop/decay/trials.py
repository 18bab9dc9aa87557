"""Each effect beside a joint, at its best: shapes tried as columns, the best of them fitted as a whole."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array
from jointlib.effect import JointEffect, Path, Scale
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.loop.decay.fitted import Fitted, fit
from jointlib.ringdown.evidence import Evidence, free_of
from jointlib.ringdown.free_gain import second_harmonic

SIGN = "its best size has a sign that it cannot have"
_STARTS = 3
_UNSEEN = 1e-9
"""Of the stiffness; a column below it does not show at first order."""
_SIZES = (0.15, -0.15)
"""Of the force of the spring, where an effect that shows at second order only begins."""
_VISIBLE, _MISSED = 5.0, 0.3
"""Deviations of a second harmonic that is visible, and the share of it below which it is not there."""
_PLAIN_TO_SEE, _LOST = 20.0, 3.0
"""Deviations above which a second harmonic could not be missed, and below which there is none."""
_PLAIN = 5e-3
"""Of the first harmonic, from which a second one wants an explanation."""


@dataclass(frozen=True)
class Trial:
    """An effect beside a joint; ``fitted`` is None where no physical one fits."""

    effect: JointEffect
    fitted: Fitted | None
    reason: str = ""
    harmonic: str = ""
    """What speaks against it in the second harmonic."""


def scale_of(evidence: Evidence, joint: Joint) -> Scale:
    """Size of the motion."""
    A = float(evidence.amplitudes[-1])
    omega = float(np.median(evidence.omegas))
    return Scale(A, A * omega / np.sqrt(2), evidence.modal_mass * omega**2)


def attempt(evidence: Evidence, base: Fitted, effect: JointEffect) -> Trial:
    """The best shape and size of an effect, with all parameters of the joint fitted beside it."""
    scale = scale_of(evidence, base.joint)
    starts, tried = list[tuple[float, Joint]](), False
    r, J = evidence.residual(base.joint), _jacobian(evidence, base.joint)
    for shape in effect.shapes(scale, base.joint):
        tried = True
        if not effect.reached(shape, scale):
            continue
        for joint, loss in _begun(evidence, base.joint, effect, shape, r, J, scale):
            starts.append((loss, joint))
    if not starts:
        return Trial(effect, None, SIGN if tried else "does not apply to this joint")
    best: Fitted | None = None
    for _, joint in sorted(starts, key=lambda one: one[0])[:_STARTS]:
        try:
            found = fit(evidence, joint, quick=True)
        except (InputError, ValueError, np.linalg.LinAlgError):
            continue
        if best is None or found.loss < best.loss:
            best = found
    if best is None:
        return Trial(effect, None, "no fit")
    best = fit(evidence, best.joint)
    return Trial(effect, best, harmonic=_second(evidence, best.joint))


def _begun(
    evidence: Evidence, joint: Joint, effect: JointEffect, shape: Mapping[str, float], r: Array, J: Array, scale: Scale
) -> list[tuple[Joint, float]]:
    """The joint with an effect of one shape, at the size that fits best to first order."""
    A = scale.displacement
    probe = Path(A * np.cos(np.linspace(0, 2 * np.pi, 9)), -A * np.sin(np.linspace(0, 2 * np.pi, 9)), 1.0)
    try:
        count = len(effect.columns(probe, shape, joint))
        unit = effect.apply(np.ones(count), shape, joint)
    except InputError:
        return []
    if unit is None or unit.laws[: len(joint.laws)] != joint.laws:
        unit = effect.apply(-np.ones(count), shape, joint)
        if unit is None or unit.laws[: len(joint.laws)] != joint.laws:
            return []
    added = Joint(unit.laws[len(joint.laws) :])
    gains = evidence.gains(added)
    sizes: list[float]
    if np.max(np.abs(gains)) < _UNSEEN * np.max(np.abs(added.force_along(np.array([A, -A]), np.zeros(2)))) / A + 1e-300:
        force = float(np.max(np.abs(added.force_along(np.array([A, -A]), np.zeros(2)))))
        sizes = [s * scale.stiffness * A / max(force, 1e-300) for s in _SIZES]
    else:
        column = np.concatenate(evidence.whiten(evidence.at_pieces(gains)))
        norm = float(np.linalg.norm(column))
        solved = np.linalg.lstsq(np.column_stack([J, column / norm]), r, rcond=1e-10)[0]
        sizes = [float(solved[-1]) / norm]
    out = []
    for size in sizes:
        made = effect.apply(np.full(count, size), shape, joint)
        if made is not None:
            left = evidence.residual(made)
            left = left - J @ np.linalg.lstsq(J, left, rcond=1e-10)[0]
            out.append((made, float(left @ left)))
    return out


def _jacobian(evidence: Evidence, joint: Joint) -> Array:
    """Columns by which the parameters of the joint change the residual, scaled to one."""
    here, columns = evidence.residual(joint), []
    for name in free_of(joint):
        value = joint.parameters[name]
        try:
            column = here - evidence.residual(joint.with_parameters({name: value * (1 + 1e-5) + 1e-12}))
        except InputError:
            continue
        size = float(np.linalg.norm(column))
        if size > 0:
            columns.append(column / size)
    return np.array(columns).T if columns else np.zeros((len(here), 1))


def _second(evidence: Evidence, joint: Joint) -> str:
    """What the second harmonic at the largest amplitudes says against a joint; empty where it fits or cannot tell."""
    if not evidence.alone or joint.states:
        return ""
    b = max(evidence.backbones, key=lambda b: float(b.amplitude[0]))
    some = slice(0, max(1, len(b) // 4))
    seen, error = b.second[some], b.second_error[some]
    told = np.isfinite(seen)
    if not np.any(told):
        return ""
    made = second_harmonic(joint, b.amplitude[some], b.omega[some], evidence.modal_mass)[told]
    seen, error = seen[told], error[told]
    if np.all(made > _PLAIN_TO_SEE * error) and np.all(seen < _LOST * error):
        own, has = 100 * np.median(made), 100 * np.median(seen)
        return f"would make a second harmonic of {own:.2g} %, the record has {has:.2g} %"
    if np.all(seen > _VISIBLE * error + _PLAIN) and float(np.median(made / seen)) < _MISSED:
        return f"does not make the second harmonic of {100 * np.median(seen):.2g} % that the record has"
    return ""
