"""The tool point as modes: a receptance with finitely many poles, which a method in time can integrate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from jointlib.arrays import Array, ArrayLike, ComplexArray
from jointlib.errors import InputError

from ..indices import Index, Mask
from .coinciding import told_apart
from .tool_point import share_along

_NOTHING = 1e-13
_SLOW = 1e-7
"""Share of the fastest pole below which one is a free motion, which rounding has put beside zero."""
_GROWS = 1e-6
"""Share of itself by which a pole lies right of zero where that is no rounding."""
_ASIDE = 1e-9
_JOINED = 2.0
"""Times the highest frequency kept up to which the modes above it are one with inertia."""
_CACHED = 4096
"""Lines worked on at once, so few that they stay in the processor's cache."""
_BLOCK = 2**16
_ALIKE = 48
"""Lines times modes at once: memory of that size is used again, larger pieces are fetched and cleared each time; in
multiples of so many lines, in which a product has the same bits as in one piece."""
_COINCIDE = "collocation: the tool has modes that coincide, such as a free motion; hold it, or use multi-frequency"


class Undamped(InputError):
    """The tool feels a mode that never settles: no depth of cut is stable.

    It may even grow by itself: ``unstable``, as of a machine that a stiffness below zero lets give way.
    """

    def __init__(self, pole: complex, fastest: float = 0.0) -> None:
        size = abs(pole) or 1.0
        self.unstable = pole.real > max(_GROWS * size, _SLOW * fastest)
        if self.unstable and abs(pole.imag) < _GROWS * size:
            super().__init__(
                "the machine does not stand by itself: it gives way without any force, by a factor of e in "
                f"{1e3 / pole.real:.3g} ms, so no depth of cut can be told; expected no stiffness so far below zero"
            )
            return
        if self.unstable:
            super().__init__(
                f"the mode at {size / (2 * np.pi):.5g} Hz that the tool feels grows by itself, with a damping ratio of "
                f"{-pole.real / size:.1g}, so no depth of cut can be told; expected no damping below zero"
            )
            return
        super().__init__(
            f"the mode at {abs(pole) / (2 * np.pi):.5g} Hz that the tool feels has a damping ratio of "
            f"{0.0 - pole.real / size:.1g}, so no depth of cut can be told; expected 0.001 to 0.1: "
            "a damping, or a loss_factor"
        )


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
        """From ẋ = Ax + BF, q = Cx + DF. Modes without a share in the tool point are left out."""
        return cls.several(A[None], B, C, D, axes)[0]

    @classmethod
    def several(cls, A: Array, B: Array, C: Array, D: Array, axes: tuple[str, ...]) -> list[ToolModel]:
        """`from_states` for several A, (models, n, n), in one decomposition."""
        poles, right = (found.astype(complex) for found in np.linalg.eig(A))
        try:
            inputs, outputs = np.linalg.solve(right, B.astype(complex)), (C @ right).swapaxes(1, 2)
        except np.linalg.LinAlgError:
            raise InputError(_COINCIDE) from None
        aside = np.array([_aside(*one) for one in zip(poles, inputs, outputs, strict=True)])
        for vectors, left_out in zip(right / np.linalg.norm(right, axis=1, keepdims=True), aside, strict=True):
            if not told_apart(vectors[:, ~left_out]):
                raise InputError(_COINCIDE)
        # A pole at zero, of a part that nothing holds, is counted as slow as numbers tell.
        speed = np.maximum(np.abs(poles), 1e-15 * np.max(np.abs(poles), axis=1, keepdims=True, initial=1e-285))
        with np.errstate(over="ignore"):  # the two poles of a part that drifts have one vector, and inputs unbounded
            peak = np.linalg.norm(inputs, axis=2) * np.linalg.norm(outputs, axis=2)
        peak /= np.maximum(np.abs(poles.real), 1e-9 * speed)
        share = peak / np.max(np.where(aside, 0.0, peak), axis=1, keepdims=True)
        kept = (poles.imag >= -_NOTHING * speed) & ~aside & (share > _NOTHING)
        if np.any(poles.real[kept] >= 0):
            raise Undamped(poles[kept][int(np.argmax(poles.real[kept]))], float(np.max(np.abs(poles))))
        return [
            cls(one[mask], to[mask], seen[mask], D, axes)
            for one, to, seen, mask in zip(poles, inputs, outputs, kept, strict=True)
        ]

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
    def residues(self) -> ComplexArray:
        """κ_p·c_p·b_pᵀ, shape (m, n, n)."""
        return np.asarray(self.weight[:, None, None] * self.outputs[:, :, None] * self.inputs[:, None, :])

    @property
    def fastest(self) -> float:
        """Largest pole in rad/s."""
        return float(np.max(np.abs(self.poles)))

    def __call__(self, frequency: Array) -> ComplexArray:
        """G at frequencies in Hz of either sign, shape (…, n, n)."""
        # κ/2·(R/(jω − s) + R̄/(jω − s̄)) = (b + jω·a)/(|s|² − ω² − 2jω·Re s) with a = κ·Re R and b = −κ·Re(R·s̄)
        f = np.asarray(frequency)
        speed, place = (part.reshape(len(self.poles), self.direct.size) for part in self._shares)
        size, damped = np.abs(self.poles), -2 * self.poles.real
        value = np.empty((f.size, self.direct.size), dtype=complex)
        lines = max(_ALIKE, _BLOCK // max(1, len(self.poles)) // _ALIKE * _ALIKE)
        for first in range(0, f.size, lines):
            omega = 2 * np.pi * f.ravel()[first : first + lines, None]
            re, im = (size - omega) * (size + omega), damped * omega
            scale = 1 / (re * re + im * im)
            re, im = re * scale, im * scale
            value[first : first + lines] = re @ place + omega * (im @ speed) + 1j * (omega * (re @ speed) - im @ place)
        return np.asarray(value.reshape(*f.shape, *self.direct.shape) + self.direct)

    @cached_property
    def _shares(self) -> tuple[Array, Array]:
        """κ·Re R and −κ·Re(R·s̄) of every pole, each (m, n, n)."""
        residue = self.residues
        return residue.real, -(residue * self.poles.conj()[:, None, None]).real

    def up_to(self, frequency: float) -> ToolModel:
        """The same with modes above a frequency in Hz joined into one a direction, or into their flexibility.

        Σ of those modes is R₀ + s·R₁ + s²·R₂ + … about s = 0. In a direction v the mode in their place has stiffness
        −R₂/R₄ per mass, R₁/R₂ of damping per mass, and gives the terms in s and s² exactly and, on a tool of little
        damping, that in s⁴; the rest of R₀ is flexibility. One more than twice above ``frequency`` is left out.
        """
        fast = np.abs(self.poles) > 2 * np.pi * frequency
        if not fast.any():
            return self
        far, near = self._part(fast, np.zeros_like(self.direct)), self._part(~fast, self.direct)
        poles, shapes = far._joined(2 * np.pi * frequency)
        outputs = shapes / (2j * poles.imag[:, None])
        one = ToolModel(poles, shapes.astype(complex), outputs, np.zeros_like(self.direct), self.axes)
        at_rest = np.zeros(1)
        return ToolModel(
            np.concatenate([near.poles, one.poles]),
            np.concatenate([near.inputs, one.inputs]),
            np.concatenate([near.outputs, one.outputs]),
            self.direct + (far(at_rest) - one(at_rest))[0].real,
            self.axes,
        )

    def _part(self, mask: Mask, direct: Array) -> ToolModel:
        return ToolModel(self.poles[mask], self.inputs[mask], self.outputs[mask], direct, self.axes)

    def _joined(self, cutoff: float) -> tuple[ComplexArray, Array]:
        """Poles, (m,), and shapes ψ, (m, n), of the modes ψψᵀ/(s² + cs + k) that stand for all; see `up_to`."""
        terms = [np.einsum("pab,p->ab", self.residues, -(self.poles ** -(k + 1))).real for k in (1, 2, 4)]
        first, second, fourth = ((term + term.T) / 2 for term in terms)
        inertia, along = np.linalg.eigh(-second)
        felt = inertia > _NOTHING * np.max(np.abs(inertia), initial=0.0)
        unit = along[:, felt] / np.sqrt(inertia[felt])
        slowness, turned = np.linalg.eigh(unit.T @ fourth @ unit)
        unit = unit @ turned
        damping = -np.einsum("am,ab,bm->m", unit, first, unit)
        near = (slowness * (_JOINED * cutoff) ** 2 > 1) & (damping > 0) & (damping**2 * slowness < 1)
        stiffness, damping = 1 / slowness[near], damping[near]
        shapes = stiffness[:, None] * (-second @ unit[:, near]).T
        return -damping / 2 + 1j * np.sqrt(stiffness - damping**2 / 4), shapes

    def along(self, direction: ArrayLike) -> ToolModel:
        """The same tool, free to move along one direction only; see `ToolPoint.along`."""
        share = share_along(self.axes, direction)
        inputs, outputs = (modes @ share[:, None] for modes in (self.inputs, self.outputs))
        return ToolModel(self.poles, inputs, outputs, np.array([[share @ self.direct @ share]]), ("x",))

    @property
    def lines(self) -> Array:
        """Lines in Hz on which every mode leaves its trace, from a tenth of the lowest to twice the highest."""
        size = np.abs(self.poles) if len(self.poles) else _SOMEWHERE
        grid = np.geomspace(0.1 * np.min(size), 2 * np.max(size), 60)
        lines = np.unique(np.concatenate([around(self.poles), grid]) / (2 * np.pi))
        return lines[lines > 0]


_SOMEWHERE = 2 * np.pi * np.array([10.0, 5e3])
"""rad/s, of a tool that no mode moves."""


def around(poles: ComplexArray) -> Array:
    """Frequencies in rad/s on which the resonance of every pole leaves its trace, in no order."""
    return np.asarray((np.abs(poles)[:, None] + np.abs(poles.real)[:, None] * np.linspace(-6, 6, 13)).ravel())


class ToolModels:
    """Several tool models that move along the same axes, evaluated together."""

    def __init__(self, models: Sequence[ToolModel]) -> None:
        self.axes = models[0].axes
        self._direct = np.array([model.direct.ravel() for model in models]).T
        most, n = max(len(model.poles) for model in models), len(self.axes)
        # Places that a model does not fill are poles at −1 without a share.
        poles, residue = np.full((len(models), most), -1.0 + 0j), np.zeros((len(models), most, n, n), dtype=complex)
        for i, model in enumerate(models):
            poles[i, : len(model.poles)] = model.poles
            residue[i, : len(model.poles)] = model.residues
        # κ/2·(R/(jω − s) + R̄/(jω − s̄)) = (b + jω·a)/(|s|² − ω² − 2jω·Re s) with a = κ·Re R and b = −κ·Re(R·s̄)
        b = -(residue * poles.conj()[:, :, None, None]).real
        flat = (len(models), most, n * n)
        parts = (
            np.abs(poles)[:, :, None] ** 2,
            -2 * poles.real[:, :, None],
            residue.real.reshape(flat),
            b.reshape(flat),
        )
        self._terms = np.ascontiguousarray(np.concatenate(parts, axis=2).transpose(1, 2, 0))
        lines = [model.lines for model in models]
        self.lines: Array = np.concatenate(lines)
        """`ToolModel.lines` of all models, one after the other."""
        self.tool: Index = np.repeat(np.arange(len(models)), [len(own) for own in lines])
        """The model of every line."""

    def __call__(self, frequency: Array, tool: Index) -> ComplexArray:
        """G at frequencies in Hz, each of the model ``tool``: both of shape (nf,) → (nf, n, n)."""
        n = len(self.axes)
        G = np.empty((len(frequency), n, n), dtype=complex)
        for first in range(0, len(frequency), _CACHED):
            some = slice(first, first + _CACHED)
            self._some(2 * np.pi * frequency[some], tool[some], G[some].reshape(-1, n * n))
        return G

    def _some(self, omega: Array, tool: Index, G: ComplexArray) -> None:
        real, imag = self._direct[:, tool].copy(), np.zeros((G.shape[1], len(omega)))
        squared = omega**2
        for of_pole in self._terms:
            of_line = of_pole.take(tool, axis=1)
            re, im = of_line[0] - squared, of_line[1] * omega
            scale = 1 / (re**2 + im**2)
            re *= scale
            im *= scale
            fast_re, fast_im = re * omega, im * omega
            for k, (speed, place) in enumerate(zip(of_line[2 : 2 + len(real)], of_line[2 + len(real) :], strict=True)):
                real[k] += place * re + speed * fast_im
                imag[k] += speed * fast_re - place * im
        G.real, G.imag = real.T, imag.T


def _aside(poles: ComplexArray, inputs: ComplexArray, outputs: ComplexArray) -> Mask:
    """Free motions that take no part in the tool point, such as the turning of a spindle under forces across it."""
    free = np.abs(poles) < _SLOW * np.max(np.abs(poles), initial=0.0)
    if not np.any(free) or np.all(free):
        return np.zeros(len(poles), dtype=bool)
    # What they add at the slowest of the other poles, where a free motion adds less than anywhere below.
    terms = (1 / (1j * np.min(np.abs(poles[~free])) - poles))[:, None, None] * outputs[:, :, None] * inputs[:, None, :]
    with np.errstate(over="ignore"):  # motions that coincide may have shares beyond all numbers: they are not aside
        part, whole = (float(np.linalg.norm(np.sum(terms[rows], axis=0))) for rows in (free, ~free))
    return free if part < _ASIDE * whole else np.zeros(len(poles), dtype=bool)
