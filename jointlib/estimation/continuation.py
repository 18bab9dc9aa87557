"""What windows and short blocks do to a frequency response, taken back by the modes that are seen.

A window e^(−σt) on force and motion makes of their Fourier transforms Laplace transforms on s = jω + σ, so that their
ratio is exactly H(jω + σ), if the structure is at rest when the window begins: every pole seems to decay by σ faster.
A block that ends t_c after the force, before the motion has died out, lacks the rest of it, e^((λ − s)·t_c) of every
mode. Modes that are fitted with both in their equations are those of the structure. The values on s = jω are not in
the data line by line: going there is an analytic continuation, for which a model is needed. Here the modes M of each
response are fitted to what was measured, and what changes between the two is added to the values:

    H(jω) ≈ Ĥ + M(jω) − M_cut(jω + σ)

What the modes miss, noise and further modes, stays as it was measured, on the shifted line.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.estimation.impact import Hits
from jointlib.estimation.result import EstimatedFRF
from jointlib.frf import Quantity
from jointlib.modal_fit.basis import Cut, Ends, modal
from jointlib.modal_fit.lscf import poles_by_order
from jointlib.modal_fit.poles import PoleFit, fit_poles
from jointlib.modal_fit.responses import Responses
from jointlib.modal_fit.selection import DOUBT, SHARE, chosen, scale
from jointlib.modal_fit.stabilisation import chart_of

_ORDER = 40
_UNKNOWN = 1e-3
"""Deviation over the largest value where one average tells none."""


def taken_off(frf: EstimatedFRF, hits: Hits) -> tuple[EstimatedFRF, str]:
    """The response on s = jω of one that was estimated on s = jω + σ from blocks of hits, and what was done in a
    sentence.

    The variance holds the errors of the modes; as those move many lines at once, errors of lines near a resonance are
    no longer independent of each other. Under a window even the errors of the measured lines are not: as many as err
    together stand in ``alike``.
    """
    s, shift = np.asarray(2j * np.pi * frf.frequency), hits.shift
    order = (Quantity.RECEPTANCE, Quantity.MOBILITY, Quantity.ACCELERANCE).index(frf.quantity)
    H = frf.value / (s + shift) ** order
    ending = Cut.after(hits.pulses, hits.at, hits.length, hits.step, np.asarray(s + shift), order)
    after = hits.length - ending.middle
    if frf.variance is not None:
        deviation = np.sqrt(frf.variance) / np.abs(s + shift) ** order
    else:
        deviation = np.full(len(H), _UNKNOWN * float(np.max(np.abs(H))))
    responses = Responses(frf.frequency, H[None], deviation[None], ((0, 0),), (frf.response,), shift, ending)
    if frf.drive != frf.response:  # the sign of a residue is free
        responses = replace(responses, pairs=((0, 1),), dofs=(frf.response, frf.drive))
    ends = Ends.of(frf.frequency)
    # Under the window neighbouring lines err together, so that many of them tell no more than few.
    alike = _lines_alike(shift * after) if frf.alike is None else frf.alike
    responses = replace(responses, deviation=np.sqrt(alike) * responses.deviation)
    chart = chart_of(poles_by_order(responses, min(_ORDER, len(H) // 3)))
    fit, ends = chosen(responses.doubted(DOUBT * SHARE), chart, ends)
    responses = responses.doubted(SHARE)
    fit = fit_poles(responses, fit.omega, fit.decay, ends)
    back = fit.value(s, ends)[0] - fit.value(responses.s, ends, ending)[0]
    per = s**order
    variance, radius = frf.variance, frf.radius
    if variance is not None and radius is not None:
        line = deviation**2
        own = _variance(responses, fit, s, line, alike) * np.abs(per) ** 2
        alike = np.maximum(_variance(responses, fit, s) * np.abs(per) ** 2 / own, 1.0)
        radius, variance = radius * np.sqrt(own / variance), own
    known = None if variance is None else np.broadcast_to(alike, len(H))
    added = replace(frf, value=(H + back) * per, variance=variance, radius=radius, alike=known)
    if not len(fit.omega):
        where = f"s = jω + {shift:.4g}/s" if shift else "blocks that end too early"
        return added, f"{frf.name}: no mode found, so nothing could be taken off: the values are those of {where}."
    slow = int(np.argmin(fit.decay))
    peak, left = fit.omega[slow] / (2 * np.pi), np.exp(-(fit.decay[slow] + shift) * after)
    did = f"the motion was cut off before it had died out ({left:.1%} of it at {peak:.5g} Hz)"
    if shift:
        did = (
            f"the exponential window added a decay of {shift:.4g}/s to every pole ({shift / fit.decay[slow]:.2g} times "
            f"what is there at {peak:.5g} Hz)"
        )
    many = f"the {len(fit.omega)} modes" if len(fit.omega) > 1 else "the one mode"
    return added, f"{frf.name}: {did}; it is taken off by {many} seen."


def _lines_alike(decades: float) -> float:
    """Lines that share one error under a window e^(−t/T) of so many T: L·Σw²/(Σw)², 1 without a window."""
    return float(max(1.0, decades / 2 / np.tanh(decades / 2))) if decades > 0 else 1.0


def _variance(
    responses: Responses, fit: PoleFit, s: ComplexArray, line: Array | None = None, alike: Array | float = 1.0
) -> Array:
    """E|error|² of Ĥ + M(jω) − M(jω + σ), where the parameters of M were fitted to Ĥ.

    With J and J' the derivatives of M on the shifted line and of the change, e the error of Ĥ with variance v and C the
    covariance of the parameters, the error is e + J'·C·Re(Jᴴ e·2/v), so its variance v + 2 Re(J'CJᴴ) + J'CJ'ᴴ.
    That is so where v is right. With ``line``, the variance of a line by itself, of which so many are ``alike``, the
    parameters err as q = line·alike/v of what C says, weighed by lines: line + 2q Re(J'CJᴴ) + J'C(JᴴqJ·2/v)CJ'ᴴ.
    """
    v = responses.deviation[0] ** 2 * scale(responses, fit)
    line = v if line is None else line
    q = line * alike / v
    J = _slopes(responses.s, fit, responses.cut)
    change = _slopes(s, fit, None) - J
    weighted = np.concatenate([J.real, J.imag]) * np.tile(np.sqrt(2 / v), 2)[:, None]
    size = np.maximum(np.linalg.norm(weighted, axis=0), 1e-300)
    C = np.linalg.pinv((weighted / size).T @ (weighted / size), rcond=1e-13, hermitian=True) / np.outer(size, size)
    seen = C @ (weighted.T @ (np.tile(q, 2)[:, None] * weighted)) @ C
    both = 2 * q * np.einsum("lp,pq,lq->l", change, C, J.conj()).real
    own = np.einsum("lp,pq,lq->l", change, seen, change.conj()).real
    return np.asarray(np.maximum(line + both + own, 0.1 * line))


def _slopes(s: ComplexArray, fit: PoleFit, cut: Cut | None) -> ComplexArray:
    """Derivatives of the modes by their residues, ln ω and ln δ, of those two as if nothing were cut off."""
    whole, b = modal(s, fit.omega, fit.decay), modal(s, fit.omega, fit.decay, cut)
    a = fit.residues[0, : len(fit.omega)]
    by_omega = -2 * fit.omega**2 * a * whole**2
    by_decay = -2 * fit.decay * s[:, None] * a * whole**2
    return np.asarray(np.concatenate([b, by_omega, by_decay], axis=1))
