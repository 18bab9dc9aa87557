"""Modes of measured frequency responses: from a stabilisation chart to shapes with standard errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.modal_fit.basis import Ends
from jointlib.modal_fit.fitted_modes import FittedModes
from jointlib.modal_fit.lscf import poles_by_order
from jointlib.modal_fit.poles import PoleFit, fit_poles
from jointlib.modal_fit.responses import Responses
from jointlib.modal_fit.selection import DOUBT, SHARE, chosen, scale, threshold
from jointlib.modal_fit.shapes import ShapeFit, first_shapes, fit_shapes, needed_beyond, promised_by_complex
from jointlib.modal_fit.stabilisation import Chart, chart_of

HIGHEST = 40
"""Model order up to which the chart goes."""
_COMPLEX = 0.02
"""Imaginary over real part of a shape below which it counts as real."""


def fit_modes(
    responses: Responses, highest: int = HIGHEST, most: int | None = None, free: bool = False, share: float = SHARE
) -> FittedModes:
    """Modes of measured receptances.

    Poles come from a stabilisation chart of matrix fractions up to the order ``highest``. All that are stable in it are
    refined together with their residues, weighed by the deviation of every line; one is kept only if without it the
    misfit would grow by more than chance explains, and where the chart missed one it is added by the same rule. Then
    poles and shapes are fitted at once, real ones unless complex ones are needed as clearly.

    Parameters
    ----------
    most
        Largest number of modes.
    free
        What lies below the band is the motion of a free body, not modes that lie lower.
    share
        Of |H|, which no deviation is taken to be below: errors that neighbouring lines have in common, as of noise in a
        short force window, are not averaged by many lines. Such an error that turns over a half-power width moves the
        frequency by share·ζ·f and the damping by share·ζ, which the standard errors hold. What is a mode is decided at
        five times as much.
    """
    if len(responses.frequency) < 8:
        raise InputError(f"modes: {len(responses.frequency)} lines, expected at least 8")
    known, doubted = responses.doubted(share), responses.doubted(DOUBT * share)
    ends = Ends.of(responses.frequency, free)
    order = max(2, min(highest, len(responses.frequency) // 3))
    chart = chart_of(poles_by_order(known, order))
    poles, ends = chosen(doubted, chart, ends, most)
    notes: list[str] = []
    shaped = _shaped(doubted, poles, ends, notes)
    if shaped is not None:
        shaped = fit_shapes(
            known, shaped.omega, shaped.decay, shaped.shapes, shaped.beyond, shaped.ends, shaped.is_complex
        )
        return _result(known, chart, shaped, notes, share)
    notes.append(
        "no driving point among the responses, so the size of the shapes is not known; expected a response at a place "
        "to a force on it"
    )
    return _poles_alone(known, chart, fit_poles(known, poles.omega, poles.decay, ends), ends, notes, share)


def _shaped(responses: Responses, poles: PoleFit, ends: Ends, notes: list[str]) -> ShapeFit | None:
    """Real shapes, with a second mode at a pole where its residues ask for two; complex ones where they are needed."""
    first = first_shapes(responses, poles)
    if first is None:
        return None
    shapes, beyond = first
    alive = np.any(shapes != 0, axis=0)
    table, columns = [], []
    for column, end in ((0, ends.above), (1, ends.below)):
        if np.any(beyond[:, column]):
            for driven in range(len(responses.inputs)):
                table.append(end)
                columns.append(beyond[:, column] if driven == 0 else _seed(beyond[:, column], driven))
    rest = np.array(columns).T if columns else np.zeros((len(responses.dofs), 0))
    beyond_ends = np.array(table).reshape(-1, 2)
    fit = fit_shapes(
        responses, poles.omega[alive], poles.decay[alive], shapes[:, alive].astype(complex), rest, beyond_ends
    )
    if len(responses.inputs) > 1:
        fit = _with_repeated(responses, fit)
    fit = _without_beyond(responses, fit)
    limit = fit.shapes.size * np.log(responses.count)
    if promised_by_complex(responses, fit) < _spread(responses, fit) * limit:
        return fit
    tried = fit_shapes(responses, fit.omega, fit.decay, fit.shapes, fit.beyond, fit.ends, is_complex=True)
    turned = np.max(np.abs(tried.shapes.imag), axis=0) > _COMPLEX * np.max(np.abs(tried.shapes.real), axis=0)
    if np.any(turned) and fit.misfit - tried.misfit > _spread(responses, tried) * limit:
        notes.append("damping is not proportional: the shapes are complex.")
        return tried
    return fit


def _seed(shape: Array, k: int) -> Array:
    """Another first value than the one before: of alternating signs."""
    return np.asarray(0.3 * shape * (-1.0) ** (np.arange(len(shape)) // k))


def _spread(responses: Responses, fit: ShapeFit) -> float:
    return max(1.0, fit.misfit / max(responses.count - fit.parameters, 1))


def _with_repeated(responses: Responses, fit: ShapeFit) -> ShapeFit:
    """A second mode at a pole where the responses to several forces cannot be had from one."""
    for k in range(len(fit.omega)):
        error = responses.value - fit.value(responses.s, responses.pairs)
        power = np.abs(error / responses.deviation) ** 2
        width = max(fit.decay[k] / (2 * np.pi), 2 * float(np.min(np.diff(responses.frequency))))
        near = np.abs(responses.frequency - fit.omega[k] / (2 * np.pi)) < 2 * width
        if not np.any(near) or np.mean(power[:, near]) < 2 * max(1.0, float(np.median(power))):
            continue
        best = fit
        for o, _i in ((o, i) for o, i in responses.pairs if o == i):
            psi = np.zeros(len(responses.dofs), dtype=complex)
            psi[o] = 0.5 * np.max(np.abs(fit.shapes[:, k]))
            tried = fit_shapes(
                responses,
                np.append(fit.omega, fit.omega[k] * 1.0005),
                np.append(fit.decay, fit.decay[k]),
                np.column_stack([fit.shapes, psi]),
                fit.beyond,
                fit.ends,
            )
            best = min(best, tried, key=lambda one: one.misfit)
        if fit.misfit - best.misfit > threshold(responses, len(responses.dofs)) * _spread(responses, best):
            order = np.argsort(best.omega)
            fit = fit_shapes(
                responses, best.omega[order], best.decay[order], best.shapes[:, order], best.beyond, best.ends
            )
    return fit


def _without_beyond(responses: Responses, fit: ShapeFit) -> ShapeFit:
    """Residual modes that explain no more than chance are left out."""
    limit = threshold(responses) * _spread(responses, fit)
    needed = needed_beyond(fit) > limit
    if np.all(needed):
        return fit
    return fit_shapes(responses, fit.omega, fit.decay, fit.shapes, fit.beyond[:, needed], fit.ends[needed])


def _result(responses: Responses, chart: Chart, fit: ShapeFit, notes: list[str], share: float) -> FittedModes:
    order = np.argsort(fit.omega)
    m, places = len(order), len(responses.dofs)
    spread = _spread(responses, fit)
    C = fit.covariance * spread
    own = np.sqrt(np.maximum(np.diag(C), 0.0))
    cross = C[np.arange(m), m + np.arange(m)]
    zeta = fit.decay / fit.omega
    zeta_error = zeta * np.sqrt(np.maximum(own[:m] ** 2 + own[m : 2 * m] ** 2 - 2 * cross, 0.0))
    shapes_error = own[2 * m : 2 * m + places * m].reshape(places, m)
    frequency = fit.omega / (2 * np.pi)
    fitted = fit.value(responses.s, responses.pairs)
    psi = fit.shapes
    residues = np.array([psi[o] * psi[i] for o, i in responses.pairs]).reshape(len(responses.pairs), m)
    columns = np.concatenate([order, m + order, *(2 * m + p * m + order for p in range(places))])
    if fit.is_complex:
        columns = np.concatenate([columns, *(2 * m + places * m + p * m + order for p in range(places))])
    columns = np.concatenate([columns, np.arange(len(columns), len(C))])
    fit = replace(
        fit,
        omega=fit.omega[order],
        decay=fit.decay[order],
        shapes=psi[:, order],
        covariance=C[np.ix_(columns, columns)],
    )
    return FittedModes(
        responses,
        chart,
        frequency[order],
        zeta[order],
        np.hypot(frequency * own[:m], share * zeta * frequency)[order],
        np.hypot(zeta_error, share * zeta)[order],
        residues[:, order],
        fitted,
        _missed(responses, fitted),
        spread,
        fit,
        shapes_error[:, order],
        tuple(notes),
    )


def _poles_alone(
    responses: Responses, chart: Chart, poles: PoleFit, ends: Ends, notes: list[str], share: float
) -> FittedModes:
    m = len(poles.omega)
    fitted = poles.value(responses.s, ends)
    own = np.sqrt(np.maximum(np.diag(poles.covariance), 0.0) * scale(responses, poles))
    cross = poles.covariance[np.arange(m), m + np.arange(m)] * scale(responses, poles)
    zeta, frequency = poles.decay / poles.omega, poles.omega / (2 * np.pi)
    error = zeta * np.sqrt(np.maximum(own[:m] ** 2 + own[m:] ** 2 - 2 * cross, 0.0))
    residues = poles.residues[:, :m].astype(complex)
    missed, spread = _missed(responses, fitted), scale(responses, poles)
    return FittedModes(
        responses,
        chart,
        frequency,
        zeta,
        np.hypot(frequency * own[:m], share * zeta * frequency),
        np.hypot(error, share * zeta),
        residues,
        fitted,
        missed,
        spread,
        None,
        None,
        tuple(notes),
    )


def _missed(responses: Responses, fitted: ComplexArray) -> float:
    weight = 1 / responses.deviation**2
    missed = np.sum(weight * np.abs(fitted - responses.value) ** 2)
    return float(np.sqrt(missed / max(float(np.sum(weight * np.abs(responses.value) ** 2)), 1e-300)))
