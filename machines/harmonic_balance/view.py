"""A machine at some frequencies as its nonlinear joints see it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ..coupling.coordinates import Coordinates
from ..coupling.joint_chain import JointChain
from ..indices import Index, Mask


@dataclass(frozen=True, eq=False)
class View:
    """Receptances in m/N at some lines: motions are all joints (in order) and then the outputs, forces the inputs.

    q + Hzz Tᵀ g(T q) = Hzf F and x = Hof F − Hoz Tᵀ g hold for the nonlinear joints' motions z = T q and forces g;
    where all move independently q is z. Where gains at rest are coupled in, g is what forces differ by from these.
    """

    omega: Array
    """Angular frequency in rad/s, (nf,)."""
    Hzz: ComplexArray
    """(nf, r, r) over the coordinates q."""
    Hzf: ComplexArray
    """(nf, r, inputs)."""
    Hoz: ComplexArray
    """(nf, motions, r); motions are every joint and then the outputs."""
    Hof: ComplexArray
    """(nf, motions, inputs)."""
    coordinates: Coordinates
    base: ComplexArray | None = None
    """Gains at rest of the nonlinear joints in N/m that are coupled in, (nf, nj); None where they are open."""
    chain: JointChain | None = None
    """What stands for Hzz, then empty, where joints share parts with few others."""

    @classmethod
    def alone(cls, omega: Array, H: ComplexArray, coordinates: Coordinates, base: ComplexArray | None = None) -> View:
        """Of the joints' motions and no others, from receptances to these, (nf, r, r + inputs)."""
        r, none = len(coordinates.rows), H[:, :0]
        return cls(omega, H[:, :, :r], H[:, :, r:], none[:, :, :r], none[:, :, r:], coordinates, base)

    @classmethod
    def of_chain(cls, omega: Array, chain: JointChain, driven: ComplexArray, coordinates: Coordinates) -> View:
        """Of a chain of joints about their gains at rest, ``driven`` from the inputs to these, (nf, nj, inputs)."""
        base = np.empty_like(chain.base)
        base[:, chain.order] = chain.base
        return replace(cls.alone(omega, driven, coordinates, base), Hzz=driven[:, :0], Hzf=driven, chain=chain)

    def at(self, lines: Index | Mask) -> View:
        """The same view on lines picked by index (which may repeat)."""
        Hzz, Hzf, Hoz, Hof = (part[lines] for part in (self.Hzz, self.Hzf, self.Hoz, self.Hof))
        base = None if self.base is None else self.base[lines]
        chain = None if self.chain is None else self.chain.at(lines)
        return View(self.omega[lines], Hzz, Hzf, Hoz, Hof, self.coordinates, base, chain)

    def directed(self, direction: ComplexArray) -> View:
        """One input instead of several: the forces act together with these complex weights, (nf, inputs)."""
        weight = direction[:, :, None]
        return View(self.omega, self.Hzz, self.Hzf @ weight, self.Hoz, self.Hof @ weight, self.coordinates)

    def coupled(self, gain: ComplexArray, first: int) -> ComplexArray:
        """Receptance from the inputs to the motions from ``first`` on, with the nonlinear joints at these gains."""
        c = self.coordinates
        q = np.linalg.solve(np.eye(len(c.rows)) + c.through(self.Hzz, gain), self.Hzf)
        return np.asarray(self.Hof[:, first:] - c.through(self.Hoz[:, first:], gain) @ q)

    def at_rest(self, base: ComplexArray) -> View:
        """The joints alone with gains at rest (N/m, (nf, nj)) coupled in, so that free parts stay well conditioned."""
        c = self.coordinates
        system = np.eye(len(c.rows)) + c.through(self.Hzz, base)
        H = np.asarray(np.linalg.solve(system, np.concatenate([self.Hzz, self.Hzf], axis=2)), dtype=complex)
        return View.alone(self.omega, H, c, base)
