"""The rig simulated again under the measured force: a prediction, where the residual is only an equation error."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.joint import Joint
from jointlib.law import Motion
from jointlib.loop.equations import Observed
from jointlib.loop.steady import periodic_sweep

_STEPS_PER_CYCLE = 25.0
_SEGMENTS = 64


def resimulated(o: Observed, joint: Joint) -> dict[str, float] | None:
    """Relative error of each acceleration under the measured force, rms over the lines of the joint equation.

    Two bodies free in space, m1 ü1 = P − f and (m2 + m3) ü2 = f, so z̈ = P/m1 − f (1/m1 + 1/(m2 + m3)); a3 rides with
    a2. Classical Runge–Kutta with at least 25 steps a cycle of the highest excited line, the periodic steady state
    from segments started at the measured motion. None where there is no P, or where it does not settle to a period.
    """
    rig = o.rig
    if not rig.has_balance or rig.m1 is None:
        return None
    found = _steady_motion(o, joint, rig.m1, rig.passive_mass)
    if found is None:
        return None
    force, drive = found
    F, P = _on_lines(o, force), _on_lines(o, drive)
    use = o.on_period & o.valid[:, 2]
    model = {"a1": (P - F) / rig.m1, "a2": F / rig.passive_mass, "a3": F / rig.passive_mass}
    return {
        name: float(np.linalg.norm((A - o.channel(name))[use]) / np.linalg.norm(o.channel(name)[use]))
        for name, A in model.items()
        if name in o.spectra.channels
    }


def _steady_motion(o: Observed, joint: Joint, m1: float, m2: float) -> tuple[Array, Array] | None:
    period = o.spectra.period_samples
    finer = int(np.ceil(_STEPS_PER_CYCLE * o.band[2] / o.spectra.sample_rate))
    T = finer * period
    K = max(k for k in range(1, _SEGMENTS + 1) if T % k == 0)
    dt = 1 / (finer * o.spectra.sample_rate)
    P = _on_period(o, o.significant("P"), 2 * T)
    z0, v0 = _on_period(o, o.Z, T), _on_period(o, 1j * o.omega * o.Z, T)
    inverse = 1 / m1 + 1 / m2
    # Instants of a segment are columns; the drive is needed at the ends and the middle of each step.
    at = np.arange(K)[:, None] * (T // K) + np.arange(T // K)[None, :]
    drive = P / m1

    def advance(i: int, state: Array) -> tuple[Array, Array]:
        z, v, inner = state[:, 0], state[:, 1], state[:, 2:]
        j = 2 * at[:, i]
        begin, middle, end = drive[j], drive[j + 1], drive[(j + 2) % (2 * T)]

        def rate(dz: Array, dv: Array, push: Array, share: float) -> Array:
            force, _ = joint.step(Motion(z + dz, v + dv, share * dt), inner)
            return push - inverse * force

        k1 = rate(0 * z, 0 * v, begin, 0.0)
        k2 = rate(dt / 2 * v, dt / 2 * k1, middle, 0.5)
        k3 = rate(dt / 2 * v + dt**2 / 4 * k1, dt / 2 * k2, middle, 0.5)
        k4 = rate(dt * v + dt**2 / 2 * k2, dt * k3, end, 1.0)
        z_new = z + dt * v + dt**2 / 6 * (k1 + k2 + k3)
        v_new = v + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        force, inner_new = joint.step(Motion(z_new, v_new, dt), inner)
        return force, np.concatenate([z_new[:, None], v_new[:, None], inner_new], axis=-1)

    first = np.arange(K) * (T // K)
    inner = joint.initial_state(z0[first])
    start = np.concatenate([z0[first, None], v0[first, None], inner], axis=-1)
    with np.errstate(all="ignore"):
        force, settled = periodic_sweep(advance, start, T // K, 1e-5, 4 * K)
    if not settled or not np.all(np.isfinite(force)):
        return None
    # Output i stands at the end of step i, that is one step later on the clock of the drive.
    return np.roll(np.moveaxis(force, 0, 1).reshape(T), 1), P


def _on_period(o: Observed, X: ComplexArray, n: int) -> Array:
    """Averaged period of a spectrum, at n instants."""
    spectrum = np.zeros(n // 2 + 1, dtype=complex)
    lines = X[o.on_period]
    spectrum[1 : len(lines) + 1] = lines * (n / o.spectra.samples)
    return np.asarray(np.fft.irfft(spectrum, n))


def _on_lines(o: Observed, x: Array) -> ComplexArray:
    out = np.zeros(len(o.frequency), dtype=complex)
    count = int(o.on_period.sum())
    out[o.on_period] = np.fft.rfft(x)[1 : count + 1] * (o.spectra.samples / len(x))
    return out


def compared(records: Sequence[Observed], before: Joint, after: Joint) -> dict[str, dict[str, float | None]]:
    """Relative error per channel over the records, with the joint before and after."""
    table: dict[str, dict[str, float | None]] = {}
    for word, joint in (("before", before), ("after", after)):
        runs = [resimulated(o, joint) for o in records]
        for name in ("a1", "a2", "a3"):
            if name in records[0].spectra.channels and records[0].rig.has_balance:
                values = [r[name] for r in runs if r is not None]
                whole = len(values) == len(runs)
                table.setdefault(name, {})[word] = float(np.sqrt(np.mean(np.square(values)))) if whole else None
    return table
