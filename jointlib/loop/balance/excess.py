"""Where the residual exceeds its noise: by equation, class of line and record; and its size in N."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.loop.balance.equations import EQUATIONS, Observed
from jointlib.loop.balance.spectra import Mask

CLASSES = ("below_500_Hz", "excited_band", "above_band", "between_lines")


def line_classes(o: Observed) -> dict[str, Mask]:
    """Masks over the lines of a record."""
    low = o.frequency < 500.0
    high = o.frequency > o.band[2] + 1e-9
    return {
        "below_500_Hz": low,
        "excited_band": o.on_period & ~low & ~high,
        "above_band": o.on_period & ~low & high,
        "between_lines": ~o.on_period & ~low,
    }


def localisation(records: Sequence[Observed], whitened: Sequence[ComplexArray]) -> dict[str, dict[str, Any]]:
    """e = Σ|r|² − n of each equation and class, beside the threshold 6√n + 0.04 n that noise stays under."""
    table: dict[str, dict[str, Any]] = {}
    for i, equation in enumerate(EQUATIONS):
        cells = {}
        for name in CLASSES:
            masks = [line_classes(o)[name] & o.valid[:, i] for o in records]
            n = int(sum(m.sum() for m in masks))
            if not n:
                continue
            total = float(sum(np.sum(np.abs(r[m, i]) ** 2) for r, m in zip(whitened, masks, strict=True)))
            cells[name] = {"excess": total - n, "threshold": 6 * np.sqrt(n) + 0.04 * n, "lines": n, "chi2": total / n}
        if cells:
            table[equation] = cells
    return table


def total_excess(table: Mapping[str, Mapping[str, Any]], equation: str | None = None) -> float:
    """E = Σ max(0, e − threshold), of one equation or of all."""
    return float(
        sum(
            max(0.0, cell["excess"] - cell["threshold"])
            for name, cells in table.items()
            if equation in (None, name)
            for cell in cells.values()
        )
    )


def sizes(records: Sequence[Observed], whitened: Sequence[ComplexArray]) -> dict[str, float]:
    """Root mean square of each residual over all records, its floor, the joint force, and χ².

    joint_N is √(2 Σ|r_J L_JJ|²)/N: the joint residual with what the noise in the other equations tells removed. On
    lines between those of the period where z is but noise it is counted as 0, and the measured force stands, less what
    a modulation of the joint makes of it there.
    """
    sums: dict[str, list[float]] = {k: [] for k in ("joint", "balance", "redundancy", "force")}
    floors: dict[str, list[float]] = {k: [] for k in ("joint", "balance", "redundancy")}
    for o, r in zip(records, whitened, strict=True):
        N = o.spectra.samples
        for i, equation in enumerate(EQUATIONS):
            still = o.valid[:, i] & ~o.informative if equation == "joint" else np.zeros(len(o.frequency), dtype=bool)
            diagonal = np.where(o.valid[:, i] & ~still, o.triangle[:, i, i].real, 0)
            there = o.joint_force[still] - force_of_modulation(o)[still]
            power = np.sum(np.abs(r[:, i] * diagonal) ** 2) + np.sum(np.abs(there) ** 2)
            noise = np.sum(diagonal**2) + np.sum(_force_noise(o)[still])
            sums[equation].append(float(2 * power) / N**2)
            floors[equation].append(float(2 * noise) / N**2)
        sums["force"].append(float(2 * np.sum(np.abs(o.joint_force[o.valid[:, 2]]) ** 2)) / N**2)
    rms = {k: float(np.sqrt(np.mean(v))) for k, v in sums.items()}
    floor = {k: float(np.sqrt(np.mean(v))) for k, v in floors.items()}
    n = sum(int(o.valid.sum()) for o in records)
    first = records[0].rig
    out = {
        "relative": rms["joint"] / rms["force"],
        "joint_N": rms["joint"],
        "joint_floor_N": floor["joint"],
        "joint_force_N": rms["force"],
        "chi2": float(sum(np.sum(np.abs(r) ** 2) for r in whitened)) / n,
    }
    if first.has_balance:
        out |= {"balance_N": rms["balance"], "balance_floor_N": floor["balance"]}
    if first.has_third:
        out |= {"redundancy_ms2": rms["redundancy"], "redundancy_floor_ms2": floor["redundancy"]}
    return out


def force_of_modulation(o: Observed) -> ComplexArray:
    """Joint force on lines that nothing drives from outside, where a modulation exerts E: ω² E/(ω² − μ D).

    The bodies give way to it, −ω² Z + μ (D Z + E) = 0 with μ = 1/m1 + 1/(m2 + m3), and D Z + E is what they feel.
    """
    if o.extra is None or o.rig.m1 is None:
        return np.zeros(len(o.frequency), dtype=complex)
    mu = sum(1 / m for m in o.rig.two_sides(o.omega))
    inertia = o.omega**2
    return np.asarray(inertia * o.extra / (inertia - mu * (o.stiffness + 1j * o.omega * o.damping)))


def _force_noise(o: Observed) -> Array:
    """Noise power of the measured joint force m2 a2 + m3 a3, one value a line."""
    return np.asarray(sum(np.abs(m) ** 2 * o.noise(a) for a, m in o.apparent_masses.items() if a != "a1"))


def per_class(table: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, float]]:
    """χ² of each equation and class."""
    return {equation: {k: cell["chi2"] for k, cell in cells.items()} for equation, cells in table.items()}


def largest_lines(
    records: Sequence[Observed], whitened: Sequence[ComplexArray], count: int = 5
) -> list[dict[str, Any]]:
    """The lines that stand out most from the noise."""
    found = []
    for o, r in zip(records, whitened, strict=True):
        for i, equation in enumerate(EQUATIONS):
            size = np.abs(r[:, i]) * o.valid[:, i]
            for l in np.argsort(-size, kind="stable")[:count]:
                amplitude = 2 * size[l] * float(o.triangle[l, i, i].real) / o.spectra.samples
                found.append((float(size[l]), equation, float(o.frequency[l]), float(amplitude), o.spectra.name))
    found.sort(key=lambda f: (-f[0], f[1], f[2]))
    return [
        {"equation": e, "frequency_Hz": f, "amplitude": a, "times_noise": s, "record": n}
        for s, e, f, a, n in found[:count]
        if s > 3
    ]
