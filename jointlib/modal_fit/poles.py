"""Poles by weighted least squares, the residues of every response being free."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.modal_fit.basis import Cut, Ends, modal
from jointlib.modal_fit.responses import Responses

_ROUNDS = 40
_DONE = 1e-6
_STEP = 0.5
"""Largest change of a logarithm in a round."""


@dataclass(frozen=True, eq=False)
class PoleFit:
    """Σ_r a_kr/(s² + 2δ_r s + ω_r²) with residual modes, at its least squares over all responses k.

    ``residues`` has a row per response: modes, then above, then below.
    """

    omega: Array
    decay: Array
    residues: Array
    misfit: float
    """Σ |error|²·2/σ²: one per real number where the deviations are right."""
    strength: Array
    """By how much the misfit grows without a mode while the poles of the others stay, (modes,)."""
    residue_error: Array
    """Of the residues of the modes while all poles stay, where the deviations are right, (responses, modes)."""
    covariance: Array
    """Of (ln ω, ln δ) where the deviations are right."""

    def value(self, s: ComplexArray, ends: Ends, cut: Cut | None = None) -> ComplexArray:
        """m/N, (responses, lines); ``cut`` as in `jointlib.modal_fit.basis.modal`."""
        return np.asarray(self.residues @ _columns(s, self.omega, self.decay, ends, cut).T)


def fit_poles(responses: Responses, omega: Array, decay: Array, ends: Ends, rounds: int = _ROUNDS) -> PoleFit:
    """Natural angular frequencies and decays (1/s) from first values, by variable projection.

    For given poles the residues are a linear least-squares problem of each response; the poles follow by
    Gauss-Newton steps on what it leaves, with the Jacobian of Kaufman (BIT 15, 1975), damped as by Marquardt.
    """
    log = np.log(np.concatenate([omega, decay]))
    m = len(omega)
    damping = 1e-3
    found = _projected(responses, np.exp(log[:m]), np.exp(log[m:]), ends, m > 0)
    for _ in range(rounds if m else 0):
        fit, normal, gradient = found
        while True:
            scaled = normal + damping * np.diag(np.diag(normal) + 1e-12 * np.max(np.diag(normal), initial=1e-300))
            step = -np.linalg.lstsq(scaled, gradient, rcond=1e-14)[0]
            step = np.clip(step, -_STEP, _STEP)
            tried = _projected(responses, np.exp(log[:m] + step[:m]), np.exp(log[m:] + step[m:]), ends, True)
            if tried[0].misfit <= fit.misfit or damping > 1e8:
                break
            damping *= 10
        gained = fit.misfit - tried[0].misfit
        if gained < 0:
            break
        log, found, damping = log + step, tried, damping / 5
        if gained < _DONE * max(1.0, fit.misfit / responses.count):
            break
    return found[0]


def _columns(s: ComplexArray, omega: Array, decay: Array, ends: Ends, cut: Cut | None) -> ComplexArray:
    w, d = (np.concatenate([own, [ends.above[i], ends.below[i]]]) for i, own in enumerate((omega, decay)))
    return modal(s, w, d, cut)


def _projected(
    responses: Responses, omega: Array, decay: Array, ends: Ends, slopes: bool
) -> tuple[PoleFit, Array, Array]:
    """The fit at these poles; JᵀJ and Jᵀe over the logarithms of ω and δ."""
    s, m = responses.s, len(omega)
    B = _columns(s, omega, decay, ends, responses.cut)
    own = (B[:, :m] if responses.cut is None else modal(s, omega, decay)) ** 2
    turned = np.concatenate([-2 * omega**2 * own, -2 * (decay * s[:, None]) * own], axis=1)
    size = np.linalg.norm(B, axis=0)
    stacked = _real(B / size)
    slope = _real(turned)
    residues = np.zeros((len(responses.pairs), m + 2))
    strength, errors = np.zeros(m), np.zeros((len(responses.pairs), m))
    normal, gradient, misfit = np.zeros((2 * m, 2 * m)), np.zeros(2 * m), 0.0
    for k, (value, deviation) in enumerate(zip(responses.value, responses.deviation, strict=True)):
        weight = np.tile(np.sqrt(2) / deviation, 2)
        y = np.concatenate([value.real, value.imag]) * weight
        Q, R = np.linalg.qr(stacked * weight[:, None])
        c, *_ = np.linalg.lstsq(R, Q.T @ y, rcond=1e-13)
        error = y - Q @ (Q.T @ y)
        residues[k] = c / size
        misfit += float(error @ error)
        inverse = np.linalg.pinv(R, rcond=1e-13)
        spread = np.maximum(np.sum(inverse[:m] ** 2, axis=1), 1e-300)
        strength += c[:m] ** 2 / spread
        errors[k] = np.sqrt(spread) / size[:m]
        if slopes:
            J = slope * (weight[:, None] * np.tile(residues[k, :m], 2))
            J -= Q @ (Q.T @ J)
            normal += J.T @ J
            gradient -= J.T @ error
    return PoleFit(omega, decay, residues, misfit, strength, errors, _inverse(normal)), normal, gradient


def _inverse(normal: Array) -> Array:
    root = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    return np.asarray(np.linalg.pinv(normal / np.outer(root, root), rcond=1e-13, hermitian=True) / np.outer(root, root))


def _real(columns: ComplexArray) -> Array:
    return np.concatenate([columns.real, columns.imag])
