"""The rig simulated again under the measured force: a prediction, where the residual is only an equation error."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray
from jointlib.joint import Joint
from jointlib.loop.balance.equations import Observed
from jointlib.loop.balance.spectra import OVERSAMPLING
from jointlib.loop.balance.steady import steady_force

_TOLERANCE = 1e-5
_MOST_STEPS = 8
_HALVINGS = 6
_DIRECTIONS = 40
_INEXACT = 0.05
_DIFFERENCE = 1e-6

_Function: TypeAlias = Callable[[ComplexArray], ComplexArray]


def resimulated(o: Observed, joint: Joint) -> dict[str, float] | None:
    """Relative error of each acceleration under the measured force, rms over the lines of the joint equation.

    Two bodies free in space, m1 ü1 = P − f and (m2 + m3) ü2 = f, so z̈ = P/m1 − f (1/m1 + 1/(m2 + m3)); a3 rides with
    a2. None where there is no P, or where no periodic motion is found.
    """
    rig = o.rig
    if not rig.has_balance or rig.m1 is None:
        return None
    found = steady_motion(o, joint)
    if found is None:
        return None
    F, P = o.lines_of(found[1]), np.where(o.on_period, o.significant("P"), 0)
    use = o.on_period & o.valid[:, 2]
    driven, carried = rig.two_sides(o.omega)
    model = {"a1": (P - F) / driven, "a2": F / carried, "a3": F / carried}
    return {
        name: float(np.linalg.norm((A - o.channel(name))[use]) / np.linalg.norm(o.channel(name)[use]))
        for name, A in model.items()
        if name in o.spectra.channels
    }


def steady_motion(o: Observed, joint: Joint) -> tuple[Array, Array] | None:
    """Periodic z in m and joint force in N over an oversampled period under the measured force; None where not found.

    Harmonic balance: with D = k + jωc for the linear part of the joint
    and N for the rest, whose force is taken along the motion in time, every line of the period obeys
    Z = (P/m1 − N/μ)/(D/μ − ω²), 1/μ = 1/m1 + 1/(m2 + m3). Solved from the measured motion; the mean of z is the one
    at which the mean force vanishes, as nothing holds the rig.
    """
    joint = o.inputs.at(joint)
    n = OVERSAMPLING * o.spectra.period_samples
    step = 1 / (OVERSAMPLING * o.spectra.sample_rate)
    omega: Array = np.asarray(2 * np.pi * np.fft.rfftfreq(n, step), dtype=float)
    driven, carried = o.rig.two_sides(omega)
    inverse = 1 / driven + 1 / carried

    def force(Z: ComplexArray) -> ComplexArray:
        z, v = np.fft.irfft(Z, n), np.fft.irfft(1j * omega * Z, n)
        return np.asarray(np.fft.rfft(sum((steady_force(law, z, v, step) for law in joint.laws), np.zeros(n))))

    Z = _spread(o, o.Z, n)
    F = force(Z)
    k, c = o.linear_part(o.lines_of(np.fft.irfft(F, n)))
    D = k + 1j * omega * c
    compliance = 1 / (inverse * D - omega**2)
    further = 0 * Z if o.extra is None else _spread(o, o.extra, n)
    drive = _spread(o, o.significant("P"), n) / driven - inverse * further

    def step_to(Z: ComplexArray) -> ComplexArray:
        return np.asarray(compliance * (drive - inverse * (force(Z) - D * Z)))

    weight = np.maximum(omega**2, np.abs(inverse * k) * 1e-3)
    with np.errstate(all="ignore"):
        Z_found = _fixed_point(step_to, Z, weight)
    if Z_found is None:
        return None
    return np.fft.irfft(Z_found, n), np.fft.irfft(force(Z_found) + further, n)


def _fixed_point(g: _Function, Z: ComplexArray, weight: Array) -> ComplexArray | None:
    """Z = g(Z) by Newton's method, to a relative error of about 1e-5 in weight · Z; None where it does not settle.

    The linear system of each step is solved by GMRES from differences of g alone, and the step is halved until it
    brings the equation nearer.
    """
    x = Z * weight

    def lack(x: ComplexArray) -> ComplexArray:
        return g(x / weight) * weight - x

    missing = lack(x)
    for _ in range(_MOST_STEPS):
        size, off = float(np.linalg.norm(x + missing)), float(np.linalg.norm(missing))
        if not np.isfinite(off):
            return None
        if off <= _TOLERANCE * size:
            return np.asarray((x + missing) / weight)

        def slope(d: Array, x: ComplexArray = x, missing: ComplexArray = missing, size: float = size) -> Array:
            h = _DIFFERENCE * size / max(float(np.linalg.norm(d)), 1e-300)
            moved = lack(x + h * np.ascontiguousarray(d.ravel()).view(complex))
            return np.asarray((missing - moved) / h).view(float)

        system = scipy.sparse.linalg.LinearOperator((2 * len(x), 2 * len(x)), matvec=slope, dtype=float)
        solved, _ = scipy.sparse.linalg.gmres(
            system, missing.view(float), rtol=_INEXACT, restart=_DIRECTIONS, maxiter=1
        )
        step = solved.view(complex)
        for share in 0.5 ** np.arange(_HALVINGS):
            there = lack(x + share * step)
            if np.linalg.norm(there) < off:
                break
        else:
            return None
        x, missing = x + share * step, there
    return None


def _spread(o: Observed, X: ComplexArray, n: int) -> ComplexArray:
    """A spectrum of the record as the spectrum of one period at n instants, the mean left out."""
    spectrum = np.zeros(n // 2 + 1, dtype=complex)
    lines = X[o.on_period]
    spectrum[1 : len(lines) + 1] = lines * (n / o.spectra.samples)
    return spectrum


Model: TypeAlias = tuple[Sequence[Observed], Joint]
"""Records as a model sees them (its faults undone) and its joint."""


def compared(before: Model, after: Model) -> dict[str, dict[str, float | None]]:
    """Relative error per channel over the records, before and after."""
    table: dict[str, dict[str, float | None]] = {}
    for word, (records, joint) in (("before", before), ("after", after)):
        runs = [resimulated(o, joint) for o in records]
        for name in ("a1", "a2", "a3"):
            if name in records[0].spectra.channels and records[0].rig.has_balance:
                values = [r[name] for r in runs if r is not None]
                whole = len(values) == len(runs)
                table.setdefault(name, {})[word] = float(np.sqrt(np.mean(np.square(values)))) if whole else None
    return table
