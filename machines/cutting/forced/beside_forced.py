"""Joints beside the forced motion of the cut: what they are to a chatter line while the teeth shake them.

A joint that moves as z_F(t) + A cos ωt, z_F repeating with the tooth and ω no multiple of the tooth frequency, answers
the line with the gain

    G(A, ω | z_F) = (2/A)·⟨f·e^(−jθ)⟩,   θ = ωt + ψ, the mean over a tooth period and over all phases ψ:

the two-tone describing function (Gelb and Vander Velde 1968: multiple-input describing functions); for A → 0 it is the
incremental one, without memory the mean of the tangent along z_F. A joint that the teeth make slip is softer to
the line than at rest, and damps it. What the joint does to the line at ω ± kω_T is left out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np
import scipy

from jointlib.arrays import Array, ArrayLike, ComplexArray
from jointlib.harmonic import FirstHarmonic, broadcast, closed_form
from jointlib.joint import Joint
from jointlib.law import JointLaw, Motion

from ...harmonic_balance.assembly import is_linear
from ...model.machine import Machine
from .forced_vibration import ForcedVibration

_SMALLEST, _LARGEST, _SIZES = 0.03, 20.0, 20
"""Amplitudes of the line over that of the forced motion, and how many are tabulated."""
_PER_TOOTH, _FEWEST = 4, 6
"""Frequencies tabulated per tooth frequency; at least as many in all."""
_BAND = 6.0
"""Tooth frequencies up to which gains are tabulated where the machine names no band."""
_PHASES = 12
_SAMPLES, _PER_WAVE = 128, 32
_SETTLING, _LOOKED_AT = 3, 3
"""Tooth periods that a joint with memory takes to forget its start, and those looked at."""
_STILL = 1e-12


@dataclass(frozen=True, eq=False)
class BesideForced(JointLaw):
    """A law that is shaken by the teeth, as a line of chatter sees it.

    Parameters
    ----------
    law
        All of the joint that is not linear.
    path
        Phasors of its forced displacement in m at 0, 1, 2 … tooth frequencies, the mean first.
    tooth
        Tooth frequency in rad/s.
    highest
        rad/s, up to where the gain is tabulated; beyond it that of the last frequency counts.
    """

    law: Joint
    path: ComplexArray
    tooth: float
    highest: float

    kind: ClassVar[str] = "beside-forced"
    in_time: ClassVar[bool] = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "states", self.law.states)

    def initial_state(self, displacement: Array) -> Array:
        return self.law.initial_state(displacement)

    def step(self, motion: Motion, state: Array) -> tuple[Array, Array]:
        return self.law.step(motion, state)

    def jacobian(self, motion: Motion, state: Array) -> tuple[Array, Array]:
        return self.law.jacobian(motion, state)

    @cached_property
    def size(self) -> float:
        """Amplitude of the forced motion in m."""
        return float(np.ptp(self._forced(np.linspace(0, 2 * np.pi, _SAMPLES))[0]) / 2)

    def first_harmonic(self, amplitude: ArrayLike, omega: ArrayLike = 1.0, bias: ArrayLike = 0.0) -> FirstHarmonic:
        """From a table over A and ω; where A is far above the forced motion, that of the law alone."""
        size, w, z0 = broadcast(amplitude, omega, bias)
        low, high = _SMALLEST * self.size, _LARGEST * self.size
        place = np.log(np.clip(size, low, high)), np.clip(w, 0.0, self.highest)
        real, imaginary = self._table
        gain = real(*place, grid=False) + 1j * imaginary(*place, grid=False)
        slope = real(*place, dx=1, grid=False) + 1j * imaginary(*place, dx=1, grid=False)
        found = closed_form(
            gain, np.where((size > low) & (size < high), slope / np.clip(size, low, high), 0.0), 0.0, 0.0, size.shape
        )
        far = size > high
        if not np.any(far):
            return found
        alone = self.law.first_harmonic(np.maximum(size, high), w, z0)
        return closed_form(
            np.where(far, alone.gain, found.gain),
            np.where(far, alone.d_amplitude, found.d_amplitude),
            np.where(far, alone.d_omega, 0.0),
            0.0,
            size.shape,
        )

    @cached_property
    def _table(self) -> tuple[scipy.interpolate.RectBivariateSpline, scipy.interpolate.RectBivariateSpline]:
        A = np.asarray(np.geomspace(_SMALLEST, _LARGEST, _SIZES) * self.size, dtype=float)
        count = max(_FEWEST, int(np.ceil(_PER_TOOTH * self.highest / self.tooth)))
        omega = np.asarray(self.highest * (np.arange(count) + 0.5) / (count - 0.5))
        G = self.gains(A[:, None], omega[None])
        return tuple(scipy.interpolate.RectBivariateSpline(np.log(A), omega, part) for part in (G.real, G.imag))  # type: ignore[return-value]

    def gains(self, amplitude: Array, omega: Array) -> ComplexArray:
        """G in N/m by stepping the law through the motion in all phases; A in m above 0 and ω in rad/s broadcast."""
        A, w = (part[..., None] for part in np.broadcast_arrays(amplitude, omega))
        phase = 2 * np.pi * np.arange(_PHASES) / _PHASES
        fastest = float(np.max(w)) / self.tooth
        count = max(_SAMPLES, int(np.ceil(_PER_WAVE * fastest)))
        angle = 2 * np.pi * np.arange(count) / count
        forced, rate = self._forced(angle)
        duration = 2 * np.pi / self.tooth / count
        total = np.zeros(np.broadcast_shapes(A.shape, phase.shape), dtype=complex)
        # All phases begin where the joint rests, so that a joint which never slips remembers none of them.
        state = self.law.initial_state(np.zeros(total.shape))
        settling, looked_at = (_SETTLING, _LOOKED_AT) if self.states else (0, 1)
        for period in range(settling + looked_at):
            for i in range(count):
                theta = w / self.tooth * (angle[i] + 2 * np.pi * period) + phase
                turn = np.exp(1j * theta)
                motion = Motion(forced[i] + A * turn.real, rate[i] - A * w * turn.imag, duration)
                force, state = self.law.step(motion, state)
                if period >= settling:
                    total += force * turn.conj()
        return np.asarray(2 * np.mean(total, axis=-1) / (count * looked_at) / A[..., 0])

    def _forced(self, angle: Array) -> tuple[Array, Array]:
        """The forced displacement and velocity at angles of the tooth."""
        k = np.arange(len(self.path))
        wave = np.exp(1j * angle[:, None] * k)
        return (wave @ self.path).real, (wave @ (1j * k * self.tooth * self.path)).real


def beside_forced(machine: Machine, forced: ForcedVibration, index: int = 0) -> Machine:
    """The machine as a line of chatter sees it in a cut, its nonlinear joints shaken as ``forced`` says.

    What depends on no amplitude stays as it is, and so does a joint that the teeth do not move.
    """
    assert machine.cutting is not None
    tooth = 2 * np.pi * int(machine.cutting["teeth"]) * float(forced.speed[index]) / 60
    band = _BAND * tooth if machine.frequency is None else 2 * np.pi * machine.frequency[1]
    highest = 1.2 * max(band, tooth)
    changed: dict[str, Joint] = {}
    for i, (name, joint) in enumerate(zip(forced.connections, machine.joints(), strict=True)):
        path = forced.joints[index, :, i]
        if is_linear(joint) or not np.max(np.abs(path[1:]), initial=0.0) > _STILL:
            continue
        steady = tuple(law for law in joint.laws if law.linear)
        bent = Joint(tuple(law for law in joint.laws if not law.linear), joint.name)
        shaken = BesideForced(bent, path, tooth, highest)
        changed[name] = replace(joint, laws=(*steady, shaken), covariance=None)
    return machine.with_joints(changed) if changed else machine
