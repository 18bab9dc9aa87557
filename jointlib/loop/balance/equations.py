"""The residual equations of the rig: joint law J, balance B and redundancy R, and their whitening."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.joint import Joint
from jointlib.law import JointLaw
from jointlib.loop.balance.floor import propagated
from jointlib.loop.balance.inputs import NO_INPUTS, Inputs
from jointlib.loop.balance.recorded import KEEP_OTHER, Recorded
from jointlib.loop.balance.spectra import Mask
from jointlib.loop.balance.steady import steady_force
from jointlib.modulation import Modulation

EQUATIONS = ("balance", "redundancy", "joint")
"""Order of the whitening: where a line has no valid joint equation, its last row is simply dropped."""
_REMEMBERED = 64


@dataclass(frozen=True)
class Observed(Recorded):
    """One record ready to be judged: residual equations and their covariance, on the lines up to ``f_max``."""

    stiffness: float
    """Linear part of the baseline used to propagate noise of z, N/m."""
    damping: float
    """N s/m."""
    extra: ComplexArray | None = None
    """Force in N on the lines that a modulation of the joint adds to the model."""
    passed_on: Array | None = None
    """Variance in (N times samples)² that the joint's swinging tangent adds to J on each line: see ``unseen.py``."""
    inputs: Inputs = NO_INPUTS
    """What parameters may follow in this record."""
    _forces: dict[JointLaw, ComplexArray] = field(default_factory=dict, compare=False)

    def model_force(self, joint: Joint) -> ComplexArray:
        """Force of a joint on the lines; what is lost in noise between those of the period moves its linear part."""
        none = np.zeros(len(self.frequency), dtype=complex)
        total = sum((forces_of_law((self,), law, joint.modulations)[0] for law in joint.laws), none)
        k, c = self.linear_part(total)
        total = total + np.where(self.stray & ~self.kept, (k + 1j * self.omega * c) * self.raw_displacement, 0)
        return total if self.extra is None else total + self.extra

    @cached_property
    def rows(self) -> ComplexArray:
        """N: how an additive error on a1, a2, a3, P moves B, R, J; shape (lines, 3, 4)."""
        N = np.zeros((len(self.frequency), 3, 4), dtype=complex)
        dynamic = (self.stiffness + 1j * self.omega * self.damping) * self.over_omega2
        kappa = np.where(self.kept | self.stray, dynamic, 0)
        m1, m2, m3 = (self.apparent_masses.get(a, 0.0) for a in ("a1", "a2", "a3"))
        N[:, 0, 0], N[:, 0, 1], N[:, 0, 2], N[:, 0, 3] = -m1, -m2, -m3, 1.0
        N[:, 1] = (0.0, 1.0, -1.0, 0.0)
        N[:, 2, 0], N[:, 2, 1], N[:, 2, 2] = kappa, m2 - kappa, m3
        return N

    @cached_property
    def valid(self) -> Mask:
        """Which of B, R, J can be used on which line, shape (lines, 3).

        A period line without a known z carries no joint equation where that z may still matter: then the force of
        the linear part at the threshold exceeds half the floor.
        """
        n = len(self.frequency)
        D = np.abs(self.stiffness + 1j * self.omega * self.damping) * self.over_omega2
        lost = KEEP_OTHER * D**2 * (self.noise("a1") + self.noise("a2"))
        power = [self.noise(c) if c in self.spectra.channels else np.zeros(n) for c in ("a1", "a2", "a3", "P")]
        floor = sum(np.abs(self.rows[:, 2, i]) ** 2 * S for i, S in enumerate(power))
        blind = self.on_period & ~self.kept & (lost > 0.25 * floor)
        joint = (self.frequency >= self.band[0]) & ~blind
        return np.stack([np.full(n, self.rig.has_balance), np.full(n, self.rig.has_third), joint], axis=-1)

    @cached_property
    def triangle(self) -> ComplexArray:
        """L of C = L Lᴴ per line, the equations in the order B, R, J; unused ones stand apart with variance 1."""
        n = len(self.frequency)
        power = [self.noise(c) if c in self.spectra.channels else np.zeros(n) for c in ("a1", "a2", "a3", "P")]
        extra = np.zeros(n)
        for name, u in zip(("a1", "a2", "a3"), self.rig.uncertainty, strict=True):
            if name in self.spectra.channels:
                extra += u**2 * np.abs(self.significant(name)) ** 2
        C = propagated(self.rows, power, extra)
        if self.passed_on is not None:
            C[:, 2, 2] += self.passed_on
        both = self.valid[:, :, None] & self.valid[:, None, :]
        return np.asarray(np.linalg.cholesky(np.where(both, C, np.eye(3))), dtype=complex)

    @cached_property
    def measured(self) -> ComplexArray:
        """B, R and the measured joint force in N, m/s², N (times samples); 0 where not valid. Shape (lines, 3)."""
        rig, out = self.rig, np.zeros((len(self.frequency), 3), dtype=complex)
        if rig.has_balance:
            out[:, 0] = self.channel("P") - self.apparent_masses["a1"] * self.channel("a1") - self.joint_force
        if rig.has_third:
            out[:, 1] = self.channel("a2") - self.channel("a3")
        out[:, 2] = self.joint_force
        return np.where(self.valid, out, 0)

    def residuals(self, joint: Joint) -> ComplexArray:
        """B, R, J, measured less modelled; shape (lines, 3)."""
        out = self.measured.copy()
        out[:, 2] -= np.where(self.valid[:, 2], self.model_force(joint), 0)
        return out

    def whitened_columns(self, columns: ComplexArray) -> ComplexArray:
        """L⁻¹ (B, R, J) of columns (..., lines, 3), by forward substitution; 0 where an equation is not valid."""
        L, out = self.triangle, np.where(self.valid, columns, 0)
        for i in range(3):
            for j in range(i):
                out[..., i] -= L[:, i, j] * out[..., j]
            out[..., i] /= L[:, i, i].real
        return out

    @cached_property
    def _whitened_measured(self) -> ComplexArray:
        return self.whitened_columns(self.measured)

    def whitened(self, joint: Joint) -> ComplexArray:
        """r = L⁻¹ (B, R, J): unit variance where nothing is missing. Shape (lines, 3), 0 where not valid."""
        return self._whitened_measured - self.whitened_force(self.model_force(joint))

    def whitened_force(self, force: ComplexArray) -> ComplexArray:
        """A joint force in N as a whitened column: it enters J alone. Shape (..., lines, 3)."""
        out = np.zeros((*force.shape, 3), dtype=complex)
        out[..., 2] = np.where(self.valid[:, 2], force / self.triangle[:, 2, 2], 0)
        return out


def forces_of_law(
    records: Sequence[Observed], law: JointLaw, modulations: Sequence[Modulation] = ()
) -> list[ComplexArray]:
    """Force of one law in N on the lines of each record, its parameters following the inputs of the record.

    A refit varies one law at a time, so forces are remembered. What does not repeat moves a law without memory as
    what does; one with memory it moves through its linear part.
    """
    return under_inputs(records, law, modulations, _remembered)


def under_inputs(
    records: Sequence[Observed],
    law: JointLaw,
    modulations: Sequence[Modulation],
    forces: Callable[[Sequence[Observed], JointLaw], list[ComplexArray]],
) -> list[ComplexArray]:
    """Forces of a law on the lines of each record, from ``forces`` of the law at the factors that its inputs reach.

    Parameters that change along a record do so slowly beside its period: the force goes from one steady state to the
    next, f(t) = Σ w_j(φ(t)) f_j(t) over some factors φ_j with weights between them in straight lines.
    """
    reached = [o.inputs.reached(law, modulations) for o in records]
    if all(len(r) == 1 and r[0][1] is law for r in reached):
        return forces(records, law)
    return [
        np.sum([o.times(forces((o,), there)[0], weight) for weight, there in r], axis=0)
        for o, r in zip(records, reached, strict=True)
    ]


def _remembered(records: Sequence[Observed], law: JointLaw) -> list[ComplexArray]:
    missing = [o for o in records if law not in o._forces]
    for o, F in zip(missing, periodic_forces(missing, law), strict=True):
        if len(o._forces) > _REMEMBERED:
            o._forces.clear()
        o._forces[law] = o.with_stray(F) if law.states else F
    return [o._forces[law] for o in records]


def periodic_forces(records: Sequence[Observed], law: JointLaw, variants: int = 0) -> list[ComplexArray]:
    """Force of a law in its periodic steady state; records of one length are stepped side by side.

    What does not repeat moves laws without memory alone.

    With ``variants`` the parameters of the law are columns (variants, 1), and so many rows come back for each record.
    """
    if not law.states and not variants:
        return [o.force_along(partial(steady_force, law)) for o in records]
    paths = [o.path for o in records]
    found: dict[int, ComplexArray] = {}
    for shape in {(len(z), step) for z, _, step in paths}:
        same = [i for i, (z, _, step) in enumerate(paths) if (len(z), step) == shape]
        # Half the samples do for a law that is stepped: its force is an integral of the motion.
        z = np.stack([paths[i][0][::2] for i in same], axis=-1)
        v = np.stack([paths[i][1][::2] for i in same], axis=-1)
        if variants:
            z, v = (np.repeat(x[:, None, :], variants, axis=1) for x in (z, v))
        force = steady_force(law, z, v, 2 * shape[1])
        found |= {i: records[i].lines_of(np.moveaxis(force[..., j], 0, -1)) for j, i in enumerate(same)}
    return [found[i] for i in range(len(records))]
