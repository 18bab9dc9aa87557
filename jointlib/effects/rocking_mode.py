"""A mode of the rig that moves its bodies beside the joint."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.fault import Fault, RigRecord, Setting, Shape

_EXCITED = 1e-2
"""Lines within 40 dB of the largest of the driving force are excited."""

_WIDE, _BEYOND = 1.5, 1.7

_SAME = 0.95
"""Two resonances whose responses share this much are one: what is named must explain as much alone."""


class RockingMode(Fault):
    """a2 and a3 gain on_a2·H·P and on_a3·H·P, H = −ω²/(ω_r² − ω² + 2jζω_rω): the mode rides on the bodies.

    on_a2 and on_a3 in 1/kg hold mode shape and modal mass and have either sign, as the two sensors may sit on
    different sides of the node. A record that does not begin in steady state is taken to begin at rest.

    The bodies on the spring of the joint have a resonance themselves, that of a1 − a2. A mode that coincides with it,
    g = ζω_r, overlap 4 g g₀/((g + g₀)² + (ω_r − ω₀)²) ≥ 0.95, is no further one: by a2 ≈ (P − H₀ P)/Σm its column is
    nearly that of a wrong gain or mass.
    """

    family: ClassVar[str] = "rocking-mode"
    words: ClassVar[str] = "a rocking mode in the accelerations behind the joint (rocking-mode)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "gain": "Widen the band beyond the resonance, or measure at a second lever arm.",
        "delay": "Widen the band beyond the resonance, or measure at a second lever arm.",
    }
    on: ClassVar[str] = "rig"
    parameters: ClassVar[Mapping[str, str]] = {
        "frequency": "Hz",
        "damping_ratio": "1",
        "on_a2": "1/kg",
        "on_a3": "1/kg",
    }
    shape_parameters: ClassVar[frozenset[str]] = frozenset({"frequency", "damping_ratio"})
    experiment: ClassVar[str] = "Measure the driving force and a second acceleration behind the joint."

    def shapes(self, records: Sequence[RigRecord], site: str) -> tuple[Shape, ...]:
        """25 frequencies over the excited band and a few beyond, at 1 and 3 % damping.

        Through a narrow band only the flank of the mode is seen, whose foot may stand far outside it.
        """
        if not all(r.has("P") for r in records):
            return ()
        low, high = np.inf, 0.0
        for record in records:
            drive = np.abs(record.masked("P")) * (record.on_period & (record.frequency > 0))
            excited = record.frequency[drive > _EXCITED * drive.max()]
            if len(excited):
                low, high = min(low, float(excited[0])), max(high, float(excited[-1]))
        if high == 0:
            return ()
        wide = high > _WIDE * low
        inside = np.linspace(low, high, 25) if wide else np.geomspace(low / _BEYOND, high * _BEYOND, 25)
        beyond = np.geomspace(1.1, _BEYOND, 4) if wide else np.empty(0)
        grid = np.concatenate([low / beyond, inside, high * beyond])
        own = _of_the_joint(records)
        return tuple({"frequency": float(f), "damping_ratio": zeta, **own} for zeta in (0.01, 0.03) for f in grid)

    def columns(self, record: RigRecord, site: str, shape: Shape) -> ComplexArray:
        X = _response(record.omega, shape) * record.masked("P")
        return np.stack([record.on_channel(c, X) for c in ("a2", "a3") if record.has(c)])

    def correction(self, coefficients: Array, shape: Shape) -> Mapping[str, float] | None:
        if shape["frequency"] <= 0 or not 0 < shape["damping_ratio"] < 1 or _overlap(shape) >= _SAME:
            return None
        on_a3 = float(coefficients[1]) if len(coefficients) > 1 else 0.0
        mode = {name: shape[name] for name in ("frequency", "damping_ratio")}
        return {**mode, "on_a2": float(coefficients[0]), "on_a3": on_a3}

    def undo(
        self, channels: Mapping[str, Array], site: str, parameters: Mapping[str, float], setting: Setting
    ) -> Mapping[str, Array]:
        if "P" not in channels:
            raise InputError("correction rocking-mode: no channel P, expected the driving force that excites the mode")
        P = channels["P"]
        n = len(P) if setting.periodic else 2 * len(P)
        omega = 2 * np.pi * np.asarray(np.fft.rfftfreq(n, 1 / setting.sample_rate))
        ringing = np.fft.irfft(_response(omega, parameters) * np.fft.rfft(P, n), n)[: len(P)]
        moved = {c: channels[c] - parameters[f"on_{c}"] * ringing for c in ("a2", "a3") if c in channels}
        return {**channels, **moved}


def _response(omega: Array, shape: Shape) -> ComplexArray:
    """Acceleration of an oscillator of unit mass per force."""
    w = 2 * np.pi * shape["frequency"]
    return np.asarray(-(omega**2) / (w**2 - omega**2 + 2j * shape["damping_ratio"] * w * omega))


def _of_the_joint(records: Sequence[RigRecord]) -> Shape:
    """Resonance of the bodies on the joint, where the records show one.

    Least squares for ω₀², 2ζ₀ω₀ and c in (ω₀² − ω² + 2jζ₀ω₀ω)·A = −c ω² P, A = a1 − a2, each record over its rms of P.
    """
    rows, target = [], []
    for record in records:
        if not record.has("a1"):
            return {}
        A, P = record.masked("a1") - record.masked("a2"), record.masked("P")
        both = record.on_period & (A != 0) & (P != 0)
        A, P = (x[both] / max(np.linalg.norm(P), 1e-300) for x in (A, P))
        w = record.omega[both]
        rows.append(np.stack([A, 1j * w * A, w**2 * P], axis=1))
        target.append(w**2 * A)
    X, y = (np.concatenate([part.real, part.imag]) for part in (np.concatenate(rows), np.concatenate(target)))
    size = np.linalg.norm(X, axis=0)
    if not np.all(size > 0):
        return {}
    stiffness, damping, _ = np.linalg.lstsq(X / size, y, rcond=None)[0] / size
    if stiffness <= 0 or not 0 < damping < 2 * np.sqrt(stiffness):
        return {}
    return {
        "joint_frequency": float(np.sqrt(stiffness) / (2 * np.pi)),
        "joint_damping_ratio": float(damping / (2 * np.sqrt(stiffness))),
    }


def _overlap(shape: Shape) -> float:
    """|∫H₁H₂*|²/(∫|H₁|² ∫|H₂|²) of two narrow resonances: 1 where they coincide, 0 where they stand far apart."""
    if "joint_frequency" not in shape:
        return 0.0
    f, g = shape["frequency"], shape["frequency"] * shape["damping_ratio"]
    f0, g0 = shape["joint_frequency"], shape["joint_frequency"] * shape["joint_damping_ratio"]
    return float(4 * g * g0 / ((g + g0) ** 2 + (f - f0) ** 2))
