"""A machine at some frequencies as its nonlinear joints see it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ..coupling.coordinates import Coordinates
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

    @classmethod
    def alone(cls, omega: Array, H: ComplexArray, coordinates: Coordinates, base: ComplexArray | None = None) -> View:
        """Of the joints' motions and no others, from receptances to these, (nf, r, r + inputs)."""
        r, none = len(coordinates.rows), H[:, :0]
        return cls(omega, H[:, :, :r], H[:, :, r:], none[:, :, :r], none[:, :, r:], coordinates, base)

    def at(self, lines: Index | Mask) -> View:
        """The same view on lines picked by index (which may repeat)."""
        Hzz, Hzf, Hoz, Hof = (part[lines] for part in (self.Hzz, self.Hzf, self.Hoz, self.Hof))
        base = None if self.base is None else self.base[lines]
        return View(self.omega[lines], Hzz, Hzf, Hoz, Hof, self.coordinates, base)

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
