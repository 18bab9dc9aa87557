"""Laws whose gain follows one curve, read off a table: a fit asks for it thousands of times."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import ClassVar

import numpy as np
import scipy

from jointlib.arrays import Array, ArrayLike
from jointlib.harmonic import FirstHarmonic, broadcast, closed_form
from jointlib.joint import Joint
from jointlib.law import JointLaw, Motion
from jointlib.laws.bouc_wen import BoucWen
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.stribeck import Stribeck

_RATIO = np.geomspace(1e-4, 1e4, 321)


@dataclass(frozen=True, eq=False)
class Curve(JointLaw):
    """The first harmonic of a law from a curve; in time it is that law itself."""

    law: JointLaw
    harmonic: Callable[[Array, Array], tuple[Array, Array]]
    """(A, ω) to the gain in N/m and its derivative by A."""

    kind: ClassVar[str] = "curve"

    def __post_init__(self) -> None:
        for key in ("kind", "in_time", "passive", "linear", "states"):
            object.__setattr__(self, key, getattr(self.law, key))

    def initial_state(self, displacement: Array) -> Array:
        return self.law.initial_state(displacement)

    def step(self, motion: Motion, state: Array) -> tuple[Array, Array]:
        return self.law.step(motion, state)

    def jacobian(self, motion: Motion, state: Array) -> tuple[Array, Array]:
        return self.law.jacobian(motion, state)

    def kink_angles(self, amplitude: Array, omega: Array, bias: Array) -> Array:
        return self.law.kink_angles(amplitude, omega, bias)

    def first_harmonic(self, amplitude: ArrayLike, omega: ArrayLike = 1.0, bias: ArrayLike = 0.0) -> FirstHarmonic:
        """The gain about any mean: that of friction does not depend on it, and other laws are not tabulated."""
        A, w, _ = broadcast(amplitude, omega, bias)
        gain, slope = self.harmonic(A, w)
        return closed_form(gain, slope, 0.0, 0.0, A.shape)


def quick(joint: Joint) -> Joint:
    """The joint with its slow describing functions read off curves, within 1e-7; everything else untouched."""
    laws = tuple(_quick(law) for law in joint.laws)
    if all(a is b for a, b in zip(laws, joint.laws, strict=True)):
        return joint
    return Joint(laws, joint.name, joint.fixed, joint.validity, None, joint.provenance)


def _quick(law: JointLaw) -> JointLaw:
    if isinstance(law, Coulomb) and law.smoothing_velocity > 0:
        return Curve(law, _sliding(law.smoothing_velocity, ((law.slip_force, 0.0),)))
    if isinstance(law, Stribeck) and law.smoothing_velocity > 0:
        width = round(law.stribeck_velocity / law.smoothing_velocity, 9)
        parts = ((law.slip_force, 0.0), (law.static_force - law.slip_force, width))
        return Curve(law, _sliding(law.smoothing_velocity, parts))
    if isinstance(law, BoucWen) and not law.clearance:
        return Curve(law, _loop(law))
    return law


def _sliding(velocity: float, parts: tuple[tuple[float, float], ...]) -> Callable[[Array, Array], tuple[Array, Array]]:
    """Friction depends on the speed amplitude over the smoothing velocity alone: G = j (force/A) h(Aω/velocity)."""

    def harmonic(A: Array, w: Array) -> tuple[Array, Array]:
        gain, slope = np.zeros(A.shape), np.zeros(A.shape)
        for force, width in parts:
            x = A * w / velocity
            value, by_log = _read(_friction_curve(width), x)
            # The curve is G·velocity/(force ω): flat where the speed stays below the smoothing velocity.
            scale = force * w / velocity
            gain += scale * value
            slope += np.where(A > 0, scale * by_log / np.where(A > 0, A, 1.0), 0.0)
        return 1j * gain, 1j * slope  # type: ignore[return-value]

    return harmonic


def _loop(law: BoucWen) -> Callable[[Array, Array], tuple[Array, Array]]:
    """A loop depends on A over its length slip_force/stiffness alone."""
    length = law.slip_force / law.stiffness

    def harmonic(A: Array, w: Array) -> tuple[Array, Array]:
        value, by_log = _read(_loop_curve(law.exponent, law.shape), A / length)
        return law.stiffness * value, law.stiffness * np.where(A > 0, by_log / np.where(A > 0, A, 1.0), 0.0)

    return harmonic


def _read(curve: tuple[object, object, float], x: Array) -> tuple[Array, Array]:
    """A curve over ln x and its slope there; level below the table, falling as 1/x above it."""
    value, slope, _ = curve
    low, high = float(np.log(_RATIO[0])), float(np.log(_RATIO[-1]))
    u = np.log(np.maximum(x, 1e-300))
    inside = np.clip(u, low, high)
    fall = np.exp(np.minimum(high - u, 0.0))
    y = value(inside) * fall  # type: ignore[operator]
    d = np.where(u < low, 0.0, np.where(u > high, -y, slope(inside)))  # type: ignore[operator]
    return y, d


@cache
def _friction_curve(width: float) -> tuple[object, object, float]:
    law: JointLaw = Stribeck(0.0, 1.0, width, 1.0) if width else Coulomb(1.0, 1.0)
    return _tabulate(law, lambda found: found.gain.imag, lambda found: found.d_amplitude.imag)


@cache
def _loop_curve(exponent: float, shape: float) -> tuple[object, object, float]:
    law = BoucWen(1.0, 1.0, exponent, shape)
    return _tabulate(law, lambda found: found.gain, lambda found: found.d_amplitude)


def _tabulate(
    law: JointLaw, value: Callable[[FirstHarmonic], object], slope: Callable[[FirstHarmonic], object]
) -> tuple[object, object, float]:
    found = law.first_harmonic(_RATIO, 1.0)
    spline = scipy.interpolate.CubicHermiteSpline(np.log(_RATIO), value(found), slope(found) * _RATIO)  # type: ignore
    return spline, spline.derivative(), 0.0
