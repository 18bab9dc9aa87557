"""Poles by least squares in the complex frequency domain: a matrix fraction in z, of one order after the other."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import ComplexArray
from jointlib.modal_fit.responses import Responses

_TURN = 1.2 * np.pi
"""Angle of z over the band: less than a full turn, so that its ends are no neighbours; more keeps high orders sound."""
_TIGHT = 1e-12


def poles_by_order(responses: Responses, highest: int) -> list[ComplexArray]:
    """Stable poles in 1/s with Im > 0 near the band, for orders 1 to ``highest``.

    H(ω) = N(z)·D(z)⁻¹ with z = exp(jϑ(ω − ω_1)/(ω_2 − ω_1)) and matrices D of the number of driven places where every
    place was driven from each of them (polyreference), numbers otherwise. N is eliminated, and D follows from linear
    normal equations with its lowest coefficient at unity (Guillaume, Verboven, Vanlanduit, Van der Auweraer, Peeters,
    IMAC XXI, 2003; for one column Guillaume et al. 1996).
    """
    omega = responses.s.imag
    span = max(omega[-1] - omega[0], _TIGHT)
    T = _TURN / span
    z = np.exp(1j * T * (omega - omega[0]))
    powers = z[:, None] ** np.arange(highest + 1)
    rows, ports = _rows(responses)
    size = highest + 1
    per_row = []
    for H, weight in rows:
        X = powers * weight[:, None]
        Y = -(X[:, :, None] * H[:, None, :]).reshape(len(z), size * ports)
        R = X.conj().T @ X
        R += _TIGHT * np.trace(R).real / size * np.eye(size)
        per_row.append((R, X.conj().T @ Y, Y.conj().T @ Y))
    found = []
    for order in range(1, highest + 1):
        n, width = order + 1, (order + 1) * ports
        M = np.zeros((width, width), dtype=complex)
        for R, S, Q in per_row:
            part = S[:n, :width]
            M += Q[:width, :width] - part.conj().T @ np.linalg.solve(R[:n, :n], part)
        try:
            alpha = -np.linalg.solve(M[ports:, ports:], M[ports:, :ports])
        except np.linalg.LinAlgError:
            found.append(np.zeros(0, dtype=complex))
            continue
        found.append(
            _poles(np.asarray(alpha.reshape(order, ports, ports), dtype=complex), T, omega[0], span) + responses.shift
        )
    return found


def _rows(responses: Responses) -> tuple[list[tuple[ComplexArray, ComplexArray]], int]:
    """What shares numerators, (lines, ports), with its weight 1/σ, and how many ports there are."""
    inputs, pairs = responses.inputs, list(responses.pairs)
    outputs = tuple(dict.fromkeys(o for o, _ in pairs))
    if len(inputs) > 1 and len(pairs) == len(set(pairs)) == len(inputs) * len(outputs):
        out = []
        for o in outputs:
            at = [pairs.index((o, i)) for i in inputs]
            weight = 1 / np.sqrt(np.mean(responses.deviation[at] ** 2, axis=0))
            out.append((responses.value[at].T, weight.astype(complex)))
        return out, len(inputs)
    each = zip(responses.value, responses.deviation, strict=True)
    return [(value[:, None], (1 / deviation).astype(complex)) for value, deviation in each], 1


def _poles(alpha: ComplexArray, T: float, first: float, span: float) -> ComplexArray:
    """Roots of det(1 + Σ α_j z^j), j from 1, as poles: those that decay, not far from the band.

    With w = 1/z it is det(w^n + Σ α_j w^(n−j)), whose roots are the eigenvalues of the block companion matrix.
    """
    order, ports, _ = alpha.shape
    companion = np.zeros((order * ports, order * ports), dtype=complex)
    companion[ports:, :-ports] = np.eye((order - 1) * ports)
    companion[:ports] = -np.concatenate([alpha[j].T for j in range(order)], axis=1)
    w = np.linalg.eigvals(companion)
    w = w[np.abs(w) > _TIGHT]
    turned = -np.log(w)
    gap = 2 * np.pi - _TURN  # angles beyond the band, half of them before it
    turned = np.where(turned.imag < -gap / 2, turned + 2j * np.pi, turned)
    turned = np.where(turned.imag > 2 * np.pi - gap / 2, turned - 2j * np.pi, turned)
    poles = turned / T + 1j * first
    near = (poles.imag > max(first - 0.05 * span, 0.0)) & (poles.imag < first + 1.05 * span)
    return np.asarray(poles[(poles.real < 0) & near])
