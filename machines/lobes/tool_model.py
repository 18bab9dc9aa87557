"""The tool point as modes: a receptance with finitely many poles, which a method in time can integrate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ArrayLike, ComplexArray
from jointlib.errors import InputError

from ..indices import Mask

_HELD_APART = 1e8
_NOTHING = 1e-13
_FLEXIBLE = 1e-4
_STRONG = 1e-2
_FAR = 4.0
_SLOW = 1e-7
"""Share of the fastest pole below which one is a free motion, which rounding has put beside zero."""
_ASIDE = 1e-9


@dataclass(frozen=True, eq=False)
class ToolModel:
    """G(ω) = Σ_p κ_p·(c_p·b_pᵀ)/(jω − s_p) + conjugates + D, on the directions of the tool that move.

    Parameters
    ----------
    poles
        s_p in rad/s, those with Im ≥ 0, shape (m,).
    inputs, outputs
        b and c, shape (m, n): the modal state follows ξ̇_p = s_p·ξ_p + b_pᵀF, and q = Σ κ_p·Re(c_p·ξ_p) + D·F with
        κ = 2 for an oscillating pole and 1 for a real one.
    direct
        D in m/N, shape (n, n): the flexibility of modes far above all others.
    axes
        ``("x",)``, ``("y",)`` or ``("x", "y")``.
    """

    poles: ComplexArray
    inputs: ComplexArray
    outputs: ComplexArray
    direct: Array
    axes: tuple[str, ...]

    @classmethod
    def from_states(cls, A: Array, B: Array, C: Array, D: Array, axes: tuple[str, ...]) -> ToolModel:
        """From ẋ = Ax + BF, q = Cx + DF. Modes without a share in the tool point are left out.

        Modes four times above every strong one act by their flexibility alone where their peak is below 10⁻⁴ of the
        highest.
        """
        poles, right = np.linalg.eig(A)
        reach = np.linalg.svd(right / np.linalg.norm(right, axis=0), compute_uv=False)
        if not reach[-1] * _HELD_APART > reach[0]:
            raise InputError("collocation: the tool has modes that coincide, such as a free motion; hold it, or use "
                             "multi-frequency")  # fmt: skip
        inputs, outputs = np.linalg.solve(right, B), (C @ right).T
        size = np.linalg.norm(inputs, axis=1) * np.linalg.norm(outputs, axis=1)
        peak = size / np.maximum(np.abs(poles.real), 1e-9 * np.abs(poles))
        upper = (poles.imag >= -_NOTHING * np.abs(poles)) & ~_aside(poles, inputs, outputs)
        kept = upper & (peak > _NOTHING * np.max(peak))
        if np.any(poles.real[kept] >= 0):
            raise InputError(
                "collocation: a mode of the tool is not damped, so it never settles; give it a damping ratio above 0"
            )
        speed = np.abs(poles)
        strong = np.max(speed[kept & (peak >= _STRONG * np.max(peak))])
        stiff = kept & (peak < _FLEXIBLE * np.max(peak)) & (speed > _FAR * strong)
        model = cls(poles[stiff], inputs[stiff], outputs[stiff], np.zeros_like(D), axes)
        kept &= ~stiff
        rest = D + (model(np.zeros(1))[0].real if stiff.any() else 0)
        return cls(poles[kept], inputs[kept], outputs[kept], rest, axes)

    @classmethod
    def from_modes(
        cls,
        frequency: ArrayLike,
        damping_ratio: ArrayLike,
        modal_mass: ArrayLike,
        shapes: ArrayLike,
        axes: tuple[str, ...] = ("x", "y"),
    ) -> ToolModel:
        """From natural frequencies in Hz, damping ratios, modal masses in kg and shapes (a row per axis)."""
        natural, zeta = 2 * np.pi * np.asarray(frequency, dtype=float), np.asarray(damping_ratio, dtype=float)
        S, mass = np.asarray(shapes, dtype=float), np.asarray(modal_mass, dtype=float)
        m, zero = len(natural), np.zeros((len(natural), len(natural)))
        A = np.block([[zero, np.diag(natural)], [-np.diag(natural), -np.diag(2 * zeta * natural)]])
        B = np.concatenate([np.zeros((m, len(S))), S.T / mass[:, None]])
        C = np.concatenate([S / natural, np.zeros((len(S), m))], axis=1)
        return cls.from_states(A, B, C, np.zeros((len(S), len(S))), axes)

    @property
    def weight(self) -> Array:
        """κ: 2 for an oscillating pole, 1 for a real one."""
        return np.where(np.abs(self.poles.imag) > _NOTHING * np.abs(self.poles), 2.0, 1.0)

    @property
    def fastest(self) -> float:
        """Largest pole in rad/s."""
        return float(np.max(np.abs(self.poles)))

    def __call__(self, frequency: Array) -> ComplexArray:
        """G at frequencies in Hz of either sign, shape (…, n, n)."""
        jw = 2j * np.pi * np.asarray(frequency)[..., None]
        residue = (self.weight / 2)[:, None, None] * self.outputs[:, :, None] * self.inputs[:, None, :]
        flat = residue.reshape(len(self.poles), -1)
        value = (1 / (jw - self.poles)) @ flat + (1 / (jw - self.poles.conj())) @ flat.conj()
        return np.asarray(value.reshape(*jw.shape[:-1], *self.direct.shape) + self.direct)

    @property
    def lines(self) -> Array:
        """Lines in Hz on which every mode leaves its trace, from a tenth of the lowest to twice the highest."""
        size, width = np.abs(self.poles), np.abs(self.poles.real)
        around = size[:, None] + width[:, None] * np.linspace(-6, 6, 13)
        grid = np.geomspace(0.1 * np.min(size), 2 * np.max(size), 60)
        lines = np.unique(np.concatenate([around.ravel(), grid])) / (2 * np.pi)
        return lines[lines > 0]


def _aside(poles: ComplexArray, inputs: ComplexArray, outputs: ComplexArray) -> Mask:
    """Free motions that take no part in the tool point, such as the turning of a spindle under forces across it."""
    free = np.abs(poles) < _SLOW * np.max(np.abs(poles), initial=0.0)
    if not np.any(free) or np.all(free):
        return np.zeros(len(poles), dtype=bool)
    # What they add at the slowest of the other poles, where a free motion adds less than anywhere below.
    terms = (1 / (1j * np.min(np.abs(poles[~free])) - poles))[:, None, None] * outputs[:, :, None] * inputs[:, None, :]
    part, whole = (float(np.linalg.norm(np.sum(terms[rows], axis=0))) for rows in (free, ~free))
    return free if part < _ASIDE * whole else np.zeros(len(poles), dtype=bool)
