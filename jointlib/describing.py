"""The describing function of a joint, and the block that python-control takes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import ArrayLike, ComplexArray
from jointlib.errors import InputError
from jointlib.harmonic import FirstHarmonic
from jointlib.joint import Joint


@dataclass(frozen=True)
class DescribingFunction:
    """Gain G(A, ω) of a joint for z = bias + A cos ωt: the fundamental of the force over that of the motion, N/m.

    Real part: equivalent stiffness. Imaginary part over ω: equivalent viscous damping. Dhupia et al. 2008,
    eqs 21–22 numerically, eq. 32 for polynomials; closed for the Hertz guide as well.
    """

    joint: Joint
    bias: float = 0.0

    def __call__(self, amplitude: ArrayLike, omega: ArrayLike) -> ComplexArray:
        """G in N/m for amplitudes in m and angular frequencies in rad/s, which broadcast."""
        return self.joint.first_harmonic(amplitude, omega, self.bias).gain

    def harmonic(self, amplitude: ArrayLike, omega: ArrayLike) -> FirstHarmonic:
        """G with dG/dA, dG/dω, the mean force and the quadrature error."""
        return self.joint.first_harmonic(amplitude, omega, self.bias)

    def at(self, omega: float) -> Block:
        """The gain at one angular frequency (rad/s), as python-control expects a nonlinearity."""
        return Block(self, float(omega))


@dataclass(frozen=True)
class Block:
    """A joint at one frequency, for ``control.describing_function`` and ``control.describing_function_response``."""

    function: DescribingFunction
    omega: float

    def describing_function(self, A: float) -> complex:
        """G(A, ω) in N/m at this block's frequency."""
        return complex(self.function(A, self.omega))

    def __call__(self, z: float) -> float:
        """Force in N at a displacement in m; only for a joint whose force depends on displacement alone."""
        joint = self.function.joint
        z_all, v_all = np.array([z, z]), np.array([0.0, 1.0])
        force = joint.force_along(z_all, v_all) if not joint.states else np.array([0.0, 1.0])
        if force[0] != force[1]:
            raise InputError(
                f"joint {joint.name!r}: the force depends on velocity or memory, so a displacement alone does not give "
                "it; use the describing function (try_method=True in python-control)"
            )
        return float(force[0])

    def _isstatic(self) -> bool:
        """python-control's word for a nonlinearity that keeps nothing between calls."""
        return True
