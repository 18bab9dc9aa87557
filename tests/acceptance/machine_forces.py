"""Forces in the joints of a machine, by formulas of their own: those that are declared, and those that are hidden.

A term is a force f(z, v, state) of one relative displacement, on arrays (columns,); its state (parts, columns) is
carried on once a step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from effects import hertz_force, limited, rounded
from numpy.typing import NDArray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Force = Callable[[Array, Array], Array]
_POINTS, _FEW = 256, 96


@dataclass(frozen=True)
class Term:
    """A force without memory, or sliders in parallel."""

    smooth: Force | None = None
    springs: Array = field(default_factory=lambda: np.zeros(0))
    """N/m, one per slider."""
    slips: Array = field(default_factory=lambda: np.zeros(0))
    """N, one per slider."""

    def force(self, z: Array, v: Array, at: Array) -> Array:
        """N; ``at`` is where the sliders stand, (sliders, columns)."""
        if self.smooth is not None:
            return self.smooth(z, v)
        stuck = self.springs[:, None] * (z - at)
        return np.asarray(np.sum(np.clip(stuck, -self.slips[:, None], self.slips[:, None]), axis=0))

    def carried(self, z: Array, at: Array) -> Array:
        """Where the sliders stand once z is reached."""
        if self.smooth is not None:
            return at
        reach = (self.slips / self.springs)[:, None]
        return np.asarray(np.clip(at, z - reach, z + reach))


def first_harmonic(terms: tuple[Term, ...], amplitude: Array, omega: Array) -> ComplexArray:
    """G in N/m of a motion A cos ωt, by the rectangle rule; sliders go round once before."""
    A = np.maximum(amplitude, 1e-15)
    angle = 2 * np.pi * np.arange(_POINTS) / _POINTS
    total: ComplexArray = np.zeros(len(A), dtype=complex)
    for term in terms:
        if term.smooth is not None:
            z, v = A[:, None] * np.cos(angle), -(A * omega)[:, None] * np.sin(angle)
            total += 2 / _POINTS * term.smooth(z, v) @ np.exp(-1j * angle)
            continue
        at = np.zeros((len(term.springs), len(A)))
        for turn in range(2):
            for a in 2 * np.pi * np.arange(_FEW) / _FEW:
                z = A * np.cos(a)
                if turn:
                    total += 2 / _FEW * term.force(z, z, at) * np.exp(-1j * a)
                at = term.carried(z, at)
    return total / A


def cubic(stiffness3: float) -> Term:
    return Term(lambda z, v: stiffness3 * z**3)


def guide(preload: float, kappa: float) -> Term:
    """Two rows of preloaded balls at 45 degrees."""
    return Term(lambda z, v: hertz_force(z, preload, kappa, np.pi / 4))


def friction(slip_force: float, corner: float) -> Term:
    return Term(lambda z, v: slip_force * np.tanh(v / corner))


# What is hidden: ``size`` in N at the largest motion z_max, v_max of the joint.


def hidden_cubic(size: float, z: float, v: float, rng: np.random.Generator) -> Term:
    """An odd spring that hardens (or softens, size below 0) with a fifth power beside the third."""
    fifth = rng.uniform(0.05, 0.15)
    return Term(lambda x, w: size * ((x / z) ** 3 + fifth * (x / z) ** 5))


def hidden_coulomb(size: float, z: float, v: float, rng: np.random.Generator) -> Term:
    corner = v * rng.uniform(0.03, 0.08)
    return Term(lambda x, w: size * w / np.hypot(w, corner))


def hidden_gap(size: float, z: float, v: float, rng: np.random.Generator) -> Term:
    clearance = z * rng.uniform(0.08, 0.25)
    return Term(lambda x, w: -size * limited(x, clearance))


def hidden_contact_loss(size: float, z: float, v: float, rng: np.random.Generator) -> Term:
    side, free = float(rng.choice([-1.0, 1.0])), rng.uniform(0.05, 0.2)
    return Term(lambda x, w: -side * size * rounded(side * x / z - free, 0.01))


def hidden_quadratic_damping(size: float, z: float, v: float, rng: np.random.Generator) -> Term:
    power = rng.uniform(0.85, 1.1)
    return Term(lambda x, w: size * w / v * np.hypot(w / v, 0.01) ** power)


def hidden_slip(size: float, z: float, v: float, rng: np.random.Generator) -> Term:
    """Sliders whose reaches are spread over a decade by a power law, as asperities do."""
    reach = z * rng.uniform(0.1, 0.3) * np.geomspace(0.3, 3.0, 9)
    share = reach ** rng.uniform(-0.4, 0.4)
    slips = size * share / np.sum(share)
    return Term(springs=slips / reach, slips=slips)


HIDDEN = {
    "cubic": hidden_cubic,
    "coulomb": hidden_coulomb,
    "gap": hidden_gap,
    "contact-loss": hidden_contact_loss,
    "quadratic-damping": hidden_quadratic_damping,
    "hysteresis": hidden_slip,
}
