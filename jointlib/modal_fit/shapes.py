"""Poles and shapes together by weighted least squares: what a component is made of, reciprocal by construction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.modal_fit.basis import modal
from jointlib.modal_fit.poles import PoleFit
from jointlib.modal_fit.responses import Responses

_ROUNDS = 60
_DONE = 1e-7
_STEP = 0.5
_DOUBT = 5.0
"""Standard errors up to which a residue at a driving point that is below zero may be above it."""


@dataclass(frozen=True, eq=False)
class ShapeFit:
    """H_oi(s) = Σ_r [g' + g''·(s + δ_r)/ω_dr]/(s² + 2δ_r s + ω_r²), g = ψ_or·ψ_ir, with residual modes beyond the band.

    Real ψ, of unit modal mass, are those of proportional damping. A complex ψ is scaled so that the residue at the pole
    −δ + jω_d is ψψᵀ/(2jω_d).

    Parameters
    ----------
    omega, decay
        ω and δ = ζω in 1/s, shape (modes,).
    shapes
        ψ in 1/√kg, shape (places, modes).
    beyond
        Shapes of the residual modes, (places, residual modes).
    ends
        Angular frequency and decay of those, a row each.
    covariance
        Of (ln ω, ln δ, Re ψ row by row, Im ψ if complex, beyond row by row).
    misfit
        Σ |error|²·2/σ².
    """

    omega: Array
    decay: Array
    shapes: ComplexArray
    beyond: Array
    ends: Array
    covariance: Array
    misfit: float
    is_complex: bool

    @property
    def parameters(self) -> int:
        """How many numbers were fitted."""
        return 2 * len(self.omega) + self.shapes.size * (2 if self.is_complex else 1) + self.beyond.size

    def value(self, s: ComplexArray, pairs: tuple[tuple[int, int], ...]) -> ComplexArray:
        """m/N, (pairs, lines)."""
        return _Model(s, self.omega, self.decay, self.ends).value(self.shapes, self.beyond, pairs)


class _Model:
    """The functions of s that are summed, and their derivatives by ln ω and ln δ."""

    def __init__(self, s: ComplexArray, omega: Array, decay: Array, ends: Array) -> None:
        self.b = modal(s, omega, decay)
        natural = np.sqrt(np.maximum(omega**2 - decay**2, 1e-6 * omega**2))
        self.turn = (s[:, None] + decay) / natural
        self.by_omega = -2 * omega**2 * self.b**2
        self.by_decay = -2 * decay * s[:, None] * self.b**2
        self.turn_by_omega = -self.turn * (omega / natural) ** 2
        self.turn_by_decay = decay / natural + self.turn * (decay / natural) ** 2
        self.residual = modal(s, ends[:, 0], ends[:, 1])

    def value(self, shapes: ComplexArray, beyond: Array, pairs: tuple[tuple[int, int], ...]) -> ComplexArray:
        out = []
        for o, i in pairs:
            g = shapes[o] * shapes[i]
            own = (self.b * (g.real + g.imag * self.turn)).sum(axis=1)
            out.append(own + self.residual @ (beyond[o] * beyond[i]))
        return np.array(out)


def first_shapes(responses: Responses, fit: PoleFit) -> tuple[Array, Array] | None:
    """Shapes from free residues, (places, modes), and (places, 2) for above and below; None without a driving point."""
    if not responses.driving:
        return None
    table = {pair: fit.residues[k] for k, pair in enumerate(responses.pairs)}
    out = np.zeros((len(responses.dofs), fit.residues.shape[1]))
    for r in range(out.shape[1]):
        own = {d: table[d, d][r] for d in responses.driving}
        if r < len(fit.omega):  # where noise made one negative, it is as large as its error
            least = {d: fit.residue_error[responses.pairs.index((d, d)), r] for d in own}
            own = {d: value if value > 0 or -value > _DOUBT * least[d] else least[d] for d, value in own.items()}
        start = max(own, key=lambda d: own[d])
        if own[start] <= 0:
            continue
        known = {start: float(np.sqrt(own[start]))}
        while True:
            found = {
                a: table[pair][r] / known[b]
                for pair in table
                for a, b in (pair, pair[::-1])
                if b in known and a not in known and abs(known[b]) > 1e-3 * max(map(abs, known.values()))
            }
            if not found:
                break
            known |= found
        for place, value in known.items():
            out[place, r] = value
    return out[:, :-2], out[:, -2:]


def fit_shapes(
    responses: Responses,
    omega: Array,
    decay: Array,
    shapes: ComplexArray,
    beyond: Array,
    ends: Array,
    is_complex: bool = False,
    rounds: int = _ROUNDS,
) -> ShapeFit:
    """Least squares over poles, shapes and residual modes from first values, by damped Gauss-Newton steps."""
    m, places = len(omega), len(responses.dofs)
    size = places * m

    def packed(omega: Array, decay: Array, shapes: ComplexArray, beyond: Array) -> Array:
        parts = [np.log(omega), np.log(decay), shapes.real.ravel()]
        return np.concatenate([*parts, *([shapes.imag.ravel()] if is_complex else []), beyond.ravel()])

    def unpacked(p: Array) -> tuple[Array, Array, ComplexArray, Array]:
        psi = p[2 * m : 2 * m + size].astype(complex)
        at = 2 * m + size
        if is_complex:
            psi = psi + 1j * p[at : at + size]
            at += size
        grown = np.clip(p[: 2 * m], -50, 50)
        return np.exp(grown[:m]), np.exp(grown[m:]), psi.reshape(places, m), p[at:].reshape(places, len(ends))

    p = packed(omega, decay, shapes, beyond)
    misfit, normal, gradient = _normal_equations(responses, *unpacked(p), ends, is_complex)
    damping = 1e-4
    for _ in range(rounds):
        while True:
            own = np.diag(normal)
            scaled = normal + np.diag(damping * own + 1e-14 * np.max(own, initial=1e-300))
            root = np.sqrt(np.diag(scaled))
            step = -np.linalg.lstsq(scaled / np.outer(root, root), gradient / root, rcond=1e-14)[0] / root
            step[: 2 * m] = np.clip(step[: 2 * m], -_STEP, _STEP)
            tried = _normal_equations(responses, *unpacked(p + step), ends, is_complex)
            if tried[0] <= misfit or damping > 1e8:
                break
            damping *= 10
        gained = misfit - tried[0]
        if gained < 0:
            break
        p, damping = p + step, damping / 5
        misfit, normal, gradient = tried
        if gained < _DONE * max(1.0, misfit):
            break
    root = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    covariance = np.linalg.pinv(normal / np.outer(root, root), rcond=1e-13, hermitian=True) / np.outer(root, root)
    found = unpacked(p)
    return ShapeFit(*found, ends, covariance, misfit, is_complex)


def needed_beyond(fit: ShapeFit) -> Array:
    """By how much the misfit would grow without each residual mode, as its covariance has it (Wald)."""
    places, extra = fit.beyond.shape
    start = len(fit.covariance) - places * extra
    out = np.zeros(extra)
    for k in range(extra):
        at = start + np.arange(places) * extra + k
        out[k] = fit.beyond[:, k] @ np.linalg.pinv(fit.covariance[np.ix_(at, at)], hermitian=True) @ fit.beyond[:, k]
    return out


def promised_by_complex(responses: Responses, fit: ShapeFit) -> float:
    """By how much the misfit would fall with complex shapes, from its slope and curvature at real ones."""
    _, normal, gradient = _normal_equations(
        responses, fit.omega, fit.decay, fit.shapes, fit.beyond, fit.ends, is_complex=True
    )
    root = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    step = np.linalg.lstsq(normal / np.outer(root, root), gradient / root, rcond=1e-10)[0]
    return float(step @ (gradient / root))


def _normal_equations(
    responses: Responses,
    omega: Array,
    decay: Array,
    shapes: ComplexArray,
    beyond: Array,
    ends: Array,
    is_complex: bool,
) -> tuple[float, Array, Array]:
    """Σ |error|², JᵀJ and Jᵀe, response by response: each touches the poles and the shapes at its two places."""
    model = _Model(responses.s, omega, decay, ends)
    m, (places, extra) = len(omega), beyond.shape
    size = places * m
    start = 2 * m + size * (2 if is_complex else 1)
    total = start + places * extra
    normal, gradient, misfit = np.zeros((total, total)), np.zeros(total), 0.0
    values = model.value(shapes, beyond, responses.pairs)
    for k, (o, i) in enumerate(responses.pairs):
        weight = np.sqrt(2) / responses.deviation[k]
        g = shapes[o] * shapes[i]
        by_real, by_imag = model.b, model.b * model.turn
        strength = g.real + g.imag * model.turn
        parts = [
            model.by_omega * strength + g.imag * model.b * model.turn_by_omega,
            model.by_decay * strength + g.imag * model.b * model.turn_by_decay,
        ]
        index = [np.arange(2 * m)]
        for here, other in ((o, i), (i, o)):
            psi = shapes[other]
            parts.append(by_real * psi.real + by_imag * psi.imag)
            index.append(2 * m + here * m + np.arange(m))
            if is_complex:
                parts.append(-by_real * psi.imag + by_imag * psi.real)
                index.append(2 * m + size + here * m + np.arange(m))
            parts.append(model.residual * beyond[other])
            index.append(start + here * extra + np.arange(extra))
        J = np.concatenate(parts, axis=1) * weight[:, None]
        J = np.concatenate([J.real, J.imag])
        error = (values[k] - responses.value[k]) * weight
        e = np.concatenate([error.real, error.imag])
        at = np.concatenate(index)
        own = J.T @ J
        np.add.at(normal, (at[:, None], at[None, :]), own)
        np.add.at(gradient, at, J.T @ e)
        misfit += float(e @ e)
    return misfit, normal, gradient
