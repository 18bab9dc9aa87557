"""The residual equations of the rig: joint law J, balance B and redundancy R, and their whitening."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.joint import Joint
from jointlib.law import JointLaw
from jointlib.loop.balance.bodies import Rig
from jointlib.loop.balance.floor import Floor, propagated
from jointlib.loop.balance.spectra import Mask, Spectra
from jointlib.loop.balance.steady import steady_force

EQUATIONS = ("balance", "redundancy", "joint")
"""Order of the whitening: where a line has no valid joint equation, its last row is simply dropped."""
_KEEP_PERIOD, _KEEP_OTHER = 6.0, 14.0
_REMEMBERED = 64


@dataclass(frozen=True)
class Observed:
    """One record ready to be judged: residual equations, kept motion, covariance.

    All spectra stand on the lines up to ``f_max``. The relative motion Z = −(A1 − A2)/ω² is kept only where it
    stands clear of its noise, because double integration multiplies noise by 1/ω²; the mean is never integrated.
    """

    spectra: Spectra
    rig: Rig
    floor: Floor
    band: tuple[float, float, float, float]
    stiffness: float
    """Linear part of the baseline used to propagate noise of z, N/m."""
    damping: float
    """N s/m."""
    extra: ComplexArray | None = None
    """Force in N on the lines that a modulation of the joint adds to the model."""
    unseen: ComplexArray | None = None
    """Motion on lines where no z is measured, m times samples of the oversampled period: see ``unseen.py``."""
    passed_on: Array | None = None
    """Variance in (N times samples)² that the joint's swinging tangent adds to J on each line: see ``unseen.py``."""
    _forces: dict[JointLaw, ComplexArray] = field(default_factory=dict, compare=False)

    @cached_property
    def lines(self) -> slice:
        """The mean … f_max."""
        return slice(0, int(np.searchsorted(self.spectra.frequency, self.band[3], side="right")))

    @cached_property
    def frequency(self) -> Array:
        return self.spectra.frequency[self.lines]

    @cached_property
    def omega(self) -> Array:
        return 2 * np.pi * self.frequency

    @cached_property
    def _over_omega2(self) -> Array:
        """1/ω², 0 for the mean: it is never integrated."""
        safe = np.where(self.omega > 0, self.omega, np.inf)
        return np.asarray(1 / safe**2)

    @cached_property
    def on_period(self) -> Mask:
        return self.spectra.on_period[self.lines]

    def channel(self, name: str) -> ComplexArray:
        return self.spectra.channels[name][self.lines]

    def noise(self, name: str) -> Array:
        return self.floor.power[name][self.lines]

    def significant(self, name: str) -> ComplexArray:
        """A channel on the lines where it stands clear of its noise, 0 elsewhere."""
        X = self.channel(name)
        limit = np.where(self.on_period, _KEEP_PERIOD, _KEEP_OTHER) * self.noise(name)
        return np.where(np.abs(X) ** 2 > limit, X, 0)

    @cached_property
    def displacement_noise(self) -> Array:
        """E|Z|² of noise alone; 0 for the mean."""
        return np.asarray((self.noise("a1") + self.noise("a2")) * self._over_omega2**2)

    @cached_property
    def kept(self) -> Mask:
        """Lines on which z is known: clear of noise; outside the excited band the test is stricter."""
        f_min, low, high, _ = self.band
        excited = self.on_period & (self.frequency >= low - 1e-9) & (self.frequency <= high + 1e-9)
        limit = np.where(excited, _KEEP_PERIOD, _KEEP_OTHER) * self.displacement_noise
        above = np.abs(self._raw_displacement) ** 2 > limit
        return np.asarray(above & (self.frequency >= f_min) & (self.frequency > 0), dtype=bool)

    @cached_property
    def _raw_displacement(self) -> ComplexArray:
        Z: ComplexArray = -(self.channel("a1") - self.channel("a2")) * self._over_omega2
        return Z

    @cached_property
    def Z(self) -> ComplexArray:
        return np.where(self.kept, self._raw_displacement, 0)

    @cached_property
    def path(self) -> tuple[Array, Array, float]:
        """z in m and ż in m/s over one averaged period, oversampled, and the time step in s."""
        return self.spectra.moved(self.Z[self.on_period], self.unseen)

    @cached_property
    def whole_path(self) -> tuple[Array, Array, float] | None:
        """The same over the whole record; None where all that is known of z repeats."""
        if not np.any(self.stray & self.kept):
            return None
        return self.spectra.moved(self.Z[1:], self.unseen, whole=True)

    def lines_of(self, force: Array, whole: bool = False) -> ComplexArray:
        """A force over one period, or over the whole record, on the lines (last axis in and out), without its mean."""
        on = np.arange(len(self.frequency)) > 0 if whole else self.on_period
        F = np.fft.rfft(force, axis=-1) * (self.spectra.samples / force.shape[-1])
        out = np.zeros((*force.shape[:-1], len(self.frequency)), dtype=complex)
        out[..., on] = F[..., 1 : on.sum() + 1]
        return out

    @cached_property
    def stray(self) -> Mask:
        """Lines between those of the period on which the joint equation is used.

        What does not repeat moves the joint through its linear part there; z is taken as measured, noise and all,
        for what is lost below a threshold would count as missing force.
        """
        return np.asarray(~self.on_period & (self.frequency >= self.band[0]), dtype=bool)

    @cached_property
    def informative(self) -> Mask:
        """Lines on which z is more than noise: what a stiffness can be fitted to."""
        return np.asarray(self.on_period | self.kept, dtype=bool)

    def model_force(self, joint: Joint) -> ComplexArray:
        """Force of a joint on the lines; what is lost in noise between those of the period moves its linear part."""
        none = np.zeros(len(self.frequency), dtype=complex)
        total = sum((forces_of_law((self,), law)[0] for law in joint.laws), none)
        k, c = self.linear_part(total)
        total = total + np.where(self.stray & ~self.kept, (k + 1j * self.omega * c) * self._raw_displacement, 0)
        return total if self.extra is None else total + self.extra

    def force_along(self, of: Callable[[Array, Array, float], Array]) -> ComplexArray:
        """A force in N without memory, of z, ż and the time step, on the lines: of all the motion that is known."""
        return self.lines_of(of(*self.path)) if self.whole_path is None else self.lines_of(of(*self.whole_path), True)

    def with_stray(self, force: ComplexArray) -> ComplexArray:
        """A force on the period lines with its linear part on the lines between them where z is more than noise."""
        if self.whole_path is None:
            return force
        k, c = self.linear_part(force)
        return force + np.where(self.stray & self.kept, (k + 1j * self.omega * c) * self.Z, 0)

    def linear_part(self, force: ComplexArray) -> tuple[float, float]:
        """Stiffness in N/m and damping in N s/m that come nearest to a force on the kept lines."""
        use = self.kept & self.on_period
        columns = np.stack([self.Z[use], 1j * self.omega[use] * self.Z[use]])
        size = np.linalg.norm(columns, axis=1)
        A = np.concatenate([columns.real, columns.imag], axis=1).T / size
        b = np.concatenate([force[use].real, force[use].imag])
        k, c = np.linalg.lstsq(A, b, rcond=None)[0] / size
        return float(k), float(c)

    @cached_property
    def joint_force(self) -> ComplexArray:
        """f = m2 a2 + m3 a3 in N and what holds these bodies to ground; without a3 both masses move with a2."""
        parts = [self.apparent_masses[a] * self.channel(a) for a in self.rig.masses if a != "a1"]
        return np.asarray(sum(parts))

    @cached_property
    def apparent_masses(self) -> Mapping[str, ComplexArray]:
        """kg that move with each accelerometer and what holds them to ground, on the lines: see :class:`Rig`."""
        return {a: self.rig.apparent_mass(a, self.omega) for a in self.rig.masses}

    @cached_property
    def rows(self) -> ComplexArray:
        """N: how an additive error on a1, a2, a3, P moves B, R, J; shape (lines, 3, 4)."""
        N = np.zeros((len(self.frequency), 3, 4), dtype=complex)
        dynamic = (self.stiffness + 1j * self.omega * self.damping) * self._over_omega2
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
        D = np.abs(self.stiffness + 1j * self.omega * self.damping) * self._over_omega2
        lost = _KEEP_OTHER * D**2 * (self.noise("a1") + self.noise("a2"))
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


def forces_of_law(records: Sequence[Observed], law: JointLaw) -> list[ComplexArray]:
    """Force of one law in N on the lines of each record; a refit varies one law at a time, so forces are remembered.

    What does not repeat moves a law without memory as what does; one with memory it moves through its linear part.
    """
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
