"""Preload and contact constant of a ball guide from a static loading curve."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.joint import Covariance
from jointlib.laws.hertz_guide import HertzGuide

_FEWEST = 8
_PRELOADS = 161


@dataclass(frozen=True)
class HertzFit:
    """A static fit, the sweep it was chosen from, and how well the two parameters are known."""

    law: HertzGuide
    covariance: Covariance
    """Of ``preload`` and ``kappa``, as far as they were fitted; strongly correlated, so use them as a pair."""
    rms: float
    """Root mean square error of the load, N."""
    relative: float
    """That error as a share of the largest load."""
    preloads: Array
    """Swept preloads in N."""
    kappas: Array
    """Least-squares kappa at each, m/N^(2/3)."""
    rms_by_preload: Array
    """Root mean square error at each, N (fig. 5 of the paper)."""
    deflection: Array
    """m, as measured."""
    load: Array
    """N, as measured."""
    resolved: bool
    """False if the curve is too straight to tell the preload: the minimum lies at the end of the sweep."""

    @property
    def correlation(self) -> float:
        """Correlation of preload and kappa; nan where only one was fitted."""
        C = self.covariance.matrix
        return float(C[0, 1] / np.sqrt(C[0, 0] * C[1, 1])) if len(C) == 2 and C[0, 0] * C[1, 1] > 0 else float("nan")


def fit_hertz(
    deflection: Array,
    load: Array,
    *,
    contact_angle: float = np.pi / 4,
    preload: float | None = None,
    kappa: float | None = None,
) -> HertzFit:
    """Sweep the preload, take the least-squares kappa at each, and refine round the least error (eqs 5–9, figs 4, 5).

    Errors are in the load. The angle (rad) is an assumption: a loading curve determines P0 sin φ and d0/sin φ, two
    numbers for three unknowns. A ``preload`` or ``kappa`` that is given is held.

    Parameters
    ----------
    deflection, load
        Measured curve in m and N, both directions or one.
    contact_angle
        Assumed angle of the ball rows, rad.
    preload, kappa
        Values in N and m/N^(2/3) to hold.
    """
    z, f = np.asarray(deflection, dtype=float), np.asarray(load, dtype=float)
    _check(z, f)
    sine = float(np.sin(contact_angle))
    lift_off = float(np.max(np.abs(f))) / (4 * np.sqrt(2) * sine)
    sweep = np.geomspace(lift_off / 20, lift_off * 20, _PRELOADS) if preload is None else np.array([preload])
    if kappa is not None:
        slopes = sine / (kappa * np.cbrt(sweep) ** 2)
    else:
        slopes = _slopes(z, f, sweep, sine)
    errors = _errors(z, f, sweep, slopes, sine)
    best = int(np.argmin(errors))
    resolved = preload is not None or 0 < best < len(sweep) - 1
    P0 = sweep[best]
    if preload is None and resolved:
        P0 = _refined(z, f, sweep[best - 1 : best + 2], sine, kappa)
    at = np.array([P0])
    slope = sine / (kappa * np.cbrt(P0) ** 2) if kappa is not None else float(_slopes(z, f, at, sine)[0])
    law = HertzGuide(float(P0), float(sine / (slope * np.cbrt(P0) ** 2)), contact_angle)
    free = [n for n, held in (("preload", preload), ("kappa", kappa)) if held is None]
    residual = f - law.force(z, np.zeros_like(z))
    covariance = _covariance(law, z, residual, free)
    rms = float(np.sqrt(np.mean(residual**2)))
    return HertzFit(
        law=law,
        covariance=covariance,
        rms=rms,
        relative=rms / float(np.max(np.abs(f))),
        preloads=sweep,
        kappas=sine / (slopes * np.cbrt(sweep) ** 2),
        rms_by_preload=errors,
        deflection=z,
        load=f,
        resolved=bool(resolved),
    )


def _check(z: Array, f: Array) -> None:
    if len(z) < _FEWEST:
        raise InputError(f"static fit: {len(z)} points, expected at least {_FEWEST}")
    for name, value in (("deflection", z), ("load", f)):
        if not np.any(value):
            raise InputError(f"static fit: {name} is zero throughout, expected a loading curve")
    if z @ f <= 0:
        raise InputError("static fit: load and deflection have opposite signs, expected the load to push along z")


def _shape(u: Array) -> Array:
    return np.asarray(np.maximum(1 + u, 0) ** 1.5 - np.maximum(1 - u, 0) ** 1.5)


def _errors(z: Array, f: Array, preloads: Array, slopes: Array, sine: float) -> Array:
    """Root mean square load error for each preload with its slope u/z."""
    model = 2 * sine * preloads[:, None] * _shape(slopes[:, None] * z)
    return np.asarray(np.sqrt(np.mean((f - model) ** 2, axis=1)))


def _slopes(z: Array, f: Array, preloads: Array, sine: float) -> Array:
    """Least-squares u/z = sin φ/d0 at each preload, all preloads at once: Gauss–Newton in its logarithm."""
    scale = 2 * sine * preloads
    logarithm = np.log(float(f @ z / (z @ z)) / (3 * scale))
    for _ in range(100):
        slope = np.exp(logarithm)[:, None]
        u = slope * z
        r = f - scale[:, None] * _shape(u)
        J = scale[:, None] * 1.5 * (np.sqrt(np.maximum(1 + u, 0)) + np.sqrt(np.maximum(1 - u, 0))) * u
        change = np.clip(np.sum(J * r, axis=1) / np.sum(J * J, axis=1), -0.5, 0.5)
        logarithm = logarithm + change
        if np.max(np.abs(change)) < 1e-13:
            break
    return np.asarray(np.exp(logarithm))


def _refined(z: Array, f: Array, bracket: Array, sine: float, kappa: float | None) -> float:
    """Preload of least error between two neighbours of the best one."""

    def error(logarithm: float) -> float:
        P0 = np.array([np.exp(logarithm)])
        slope = sine / (kappa * np.cbrt(P0) ** 2) if kappa is not None else _slopes(z, f, P0, sine)
        return float(_errors(z, f, P0, slope, sine)[0])

    ends = float(np.log(bracket[0])), float(np.log(bracket[-1]))
    return float(
        np.exp(scipy.optimize.minimize_scalar(error, bounds=ends, method="bounded", options={"xatol": 1e-12}).x)
    )


def _covariance(law: HertzGuide, z: Array, residual: Array, free: list[str]) -> Covariance:
    """s² (JᵀJ)⁻¹ in the parameters that were fitted."""
    force, slope = law.force(z, np.zeros_like(z)), law.slopes(z, np.zeros_like(z))[0]
    # f = P0 h(u), u ∝ z/(kappa P0^(2/3)): derivatives follow from f and z ∂f/∂z.
    columns = {"preload": (force - 2 / 3 * z * slope) / law.preload, "kappa": -z * slope / law.kappa}
    if not free:
        return Covariance((), np.empty((0, 0)))
    J = np.column_stack([columns[name] for name in free])
    size = np.linalg.norm(J, axis=0)
    unit = np.linalg.inv((J / size).T @ (J / size))
    variance = float(residual @ residual) / max(1, len(z) - len(free))
    return Covariance(tuple(free), variance * unit / np.outer(size, size))
