"""A joint: a flat sum of laws with its validity range, covariance and provenance."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from jointlib.arrays import Array, ArrayLike, ComplexArray
from jointlib.errors import InputError, nearest
from jointlib.harmonic import FirstHarmonic, broadcast, closed_form
from jointlib.law import JointLaw, Motion, memoryless
from jointlib.modulation import CONDITIONS, Modulation
from jointlib.parameter import Parameter, Role, parameters_of
from jointlib.shown.pictures import axes_of, draw_stiffness
from jointlib.shown.result import Columns, Shown
from jointlib.units import parameters_in_words

_AMPLITUDE, _FREQUENCY = 1e-5, 100.0
"""m and Hz up to which, and at which, a joint is drawn whose validity is not known."""


@dataclass(frozen=True)
class Covariance:
    """Covariance of estimated parameters; ``names`` are joint parameter names, SI units."""

    names: tuple[str, ...]
    matrix: Array

    def standard_error(self, name: str) -> float:
        """Standard error of one parameter, nan where it was not estimated."""
        if name not in self.names:
            return float("nan")
        i = self.names.index(name)
        return float(np.sqrt(self.matrix[i, i]))

    def widened(self, errors: Mapping[str, float]) -> Covariance:
        """The same correlations with each standard error raised to the one given for it, where that is larger."""
        factor = np.ones(len(self.names))
        for i, name in enumerate(self.names):
            own, given = self.standard_error(name), errors.get(name, 0.0)
            if own > 0 and given > own:
                factor[i] = given / own
        return Covariance(self.names, self.matrix * np.outer(factor, factor))


@dataclass(frozen=True, repr=False)
class Joint(Shown):
    """Σ f_k(z, ż, state) along one relative displacement; ``+`` adds a law or another joint's laws.

    Parts are named after their kinds (``hertz_guide``, ``viscous``, a second one ``viscous_2``), so a parameter
    is ``viscous.damping`` and an entry of a table ``polynomial.coefficients[1][0]``. Forces are those at the
    reference of its modulations; :meth:`at` gives the joint under other conditions.
    """

    laws: tuple[JointLaw, ...] = ()
    name: str = "joint"
    fixed: frozenset[str] = frozenset()
    """Parameters that a refit must not move."""
    validity: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """Ranges [low, high] of amplitude (m), velocity (m/s), frequency (Hz), preload (N), where known."""
    covariance: Covariance | None = None
    provenance: Mapping[str, Any] = field(default_factory=dict)
    modulations: tuple[Modulation, ...] = ()
    """What conditions make of the parameters of a role, over all parts."""

    def __add__(self, other: JointLaw | Joint) -> Joint:
        added = other.laws if isinstance(other, Joint) else (other,)
        further = other.modulations if isinstance(other, Joint) else ()
        modulations = (*self.modulations, *further)
        return replace(self, laws=(*self.laws, *added), covariance=None, modulations=modulations)

    def at(self, condition: Mapping[str, float]) -> Joint:
        """The joint under conditions in SI (``{"temperature": 313.0}``), every modulation carried out and dropped."""
        for name in condition:
            if name not in CONDITIONS:
                raise InputError(f"joint {self.name!r}: no condition {name!r}, {nearest(name, CONDITIONS)}")
        factor: dict[Role, float] = {}
        for m in self.modulations:
            if m.condition not in condition:
                raise InputError(
                    f"joint {self.name!r}: its {m.role.value} depends on {m.condition}, which is not given"
                )
            factor[m.role] = factor.get(m.role, 1.0) * m.factor(condition[m.condition])
        scaled = {name: value * factor[p.role] for name, (value, p) in self._flat.items() if p.role in factor}
        bare = replace(self, modulations=())
        return bare.with_parameters(scaled) if scaled else bare

    def based(self, condition: str, value: float) -> Joint:
        """The same joint told by its forces at another value of a condition (SI, `CONDITIONS`)."""
        moved = tuple(m for m in self.modulations if m.condition == condition)
        if all(m.reference == value for m in moved):
            return self
        others = tuple(m for m in self.modulations if m.condition != condition)
        here = replace(self, modulations=moved).at({condition: value})
        return replace(here, modulations=(*others, *(m.based(value) for m in moved)))

    def lagging(self, condition: str, lag: float) -> Joint:
        """The same joint with what follows a condition behind it by a lag of the first order (s)."""
        moved = (replace(m, lag=lag) if m.condition == condition else m for m in self.modulations)
        return replace(self, modulations=tuple(moved))

    @cached_property
    def part_names(self) -> tuple[str, ...]:
        """One name per law, in order."""
        names: list[str] = []
        for law in self.laws:
            base = law.kind.replace("-", "_")
            count = sum(n == base or n.rsplit("_", 1)[0] == base for n in names)
            names.append(base if not count else f"{base}_{count + 1}")
        return tuple(names)

    @property
    def parameters(self) -> dict[str, float]:
        """Every scalar parameter in SI by its joint name; tables entry by entry."""
        return {name: value for name, (value, _) in self._flat.items()}

    @property
    def units(self) -> dict[str, str]:
        """SI unit of every parameter."""
        return {name: p.unit for name, (_, p) in self._flat.items()}

    @cached_property
    def _flat(self) -> dict[str, tuple[float, Parameter]]:
        flat: dict[str, tuple[float, Parameter]] = {}
        for part, law in zip(self.part_names, self.laws, strict=True):
            for p in parameters_of(law):
                value = getattr(law, p.name)
                if p.table:
                    for i, row in enumerate(value):
                        for j, entry in enumerate(row):
                            flat[f"{part}.{p.name}[{i}][{j}]"] = float(entry), p
                elif p.listed:
                    flat |= {f"{part}.{p.name}[{i}]": (float(entry), p) for i, entry in enumerate(value)}
                else:
                    flat[f"{part}.{p.name}"] = float(value), p
        return flat

    def parted(self, holds: Callable[[JointLaw], bool]) -> tuple[Joint, Joint]:
        """The laws for which something holds, and the others, as joints without name, range or errors."""
        return Joint(tuple(law for law in self.laws if holds(law))), Joint(
            tuple(law for law in self.laws if not holds(law))
        )

    def with_parameters(self, values: Mapping[str, float]) -> Joint:
        """The joint with some parameters replaced; what was estimated of the old values is dropped."""
        known = self.parameters
        for name in values:
            if name not in known:
                raise InputError(f"joint {self.name!r}: no parameter {name!r}, {nearest(name, known)}")
        merged = {**known, **values}
        laws = []
        for part, law in zip(self.part_names, self.laws, strict=True):
            new: dict[str, Any] = {}
            for p in parameters_of(law):
                key = f"{part}.{p.name}"
                if p.table:
                    shape = np.shape(getattr(law, p.name))
                    rows = range(shape[0])
                    new[p.name] = tuple(tuple(merged[f"{key}[{i}][{j}]"] for j in range(shape[1])) for i in rows)
                elif p.listed:
                    new[p.name] = tuple(merged[f"{key}[{i}]"] for i in range(len(getattr(law, p.name))))
                else:
                    new[p.name] = merged[key]
            laws.append(replace(law, **new))  # type: ignore[type-var]
        return replace(self, laws=tuple(laws), covariance=None)

    @property
    def states(self) -> tuple[str, ...]:
        """Names of all internal states."""
        return tuple(f"{n}.{s}" for n, law in zip(self.part_names, self.laws, strict=True) for s in law.states)

    def _parts(self, state: Array) -> list[Array]:
        parts, first = [], 0
        for law in self.laws:
            parts.append(state[..., first : first + len(law.states)])
            first += len(law.states)
        return parts

    def initial_state(self, displacement: ArrayLike) -> Array:
        """Virgin state of all parts at a displacement in m, shape (*z.shape, number of states)."""
        z = np.asarray(displacement, dtype=float)
        return np.concatenate([np.empty((*z.shape, 0)), *(law.initial_state(z) for law in self.laws)], axis=-1)

    def step(self, motion: Motion, state: Array) -> tuple[Array, Array]:
        """Force in N at the end of the step, and the new state."""
        force = np.zeros(np.broadcast_shapes(np.shape(motion.displacement), np.shape(motion.velocity)))
        after = []
        for law, part in zip(self.laws, self._parts(state), strict=True):
            f, new = law.step(motion, part)
            force = force + f
            if law.states:
                after.append(new)
        if len(after) > 1:
            return force, np.concatenate(after, axis=-1)
        return force, after[0] if after else state

    def jacobian(self, motion: Motion, state: Array) -> tuple[Array, Array]:
        """Tangent stiffness ∂f/∂z in N/m and damping ∂f/∂ż in N s/m."""
        stiffness = damping = np.zeros(np.broadcast_shapes(np.shape(motion.displacement), np.shape(motion.velocity)))
        for law, part in zip(self.laws, self._parts(state), strict=True):
            k, c = law.jacobian(motion, part)
            stiffness, damping = stiffness + k, damping + c
        return stiffness, damping

    def force_along(self, displacement: ArrayLike, velocity: ArrayLike, time_step: float = 0.0) -> Array:
        """Force in N along a path sampled every ``time_step`` s (time on the first axis), from the virgin state."""
        z, v = np.broadcast_arrays(np.asarray(displacement, dtype=float), np.asarray(velocity, dtype=float))
        parts = [law.along(z, v, time_step) if law.states else memoryless(law, z, v) for law in self.laws]
        return parts[0] if len(parts) == 1 else np.asarray(sum(parts, np.zeros(z.shape)))

    def first_harmonic(self, amplitude: ArrayLike, omega: ArrayLike = 1.0, bias: ArrayLike = 0.0) -> FirstHarmonic:
        """Sum of the parts' describing functions, with derivatives (A in m, ω in rad/s, bias in m)."""
        if not self.laws:
            return closed_form(0.0, 0.0, 0.0, 0.0, broadcast(amplitude, omega, bias)[0].shape)
        first, *others = (law.first_harmonic(amplitude, omega, bias) for law in self.laws)
        return sum(others, first)

    def by_bias(self, amplitude: Array, omega: Array, bias: Array) -> tuple[ComplexArray, Array, Array]:
        """∂G/∂z0 (N/m²), ∂N0/∂A and ∂N0/∂z0 (N/m), sums over the parts; see `JointLaw.by_bias`."""
        nothing = np.zeros(np.broadcast_shapes(amplitude.shape, omega.shape, bias.shape))
        gain, by_amplitude, mean = nothing.astype(complex), nothing, nothing
        for law in self.laws:
            part = law.by_bias(amplitude, omega, bias)
            gain, by_amplitude, mean = gain + part[0], by_amplitude + part[1], mean + part[2]
        return gain, by_amplitude, mean

    def finding(self) -> str:
        """Its laws and their first parameters."""
        flat, errors, units = self.parameters, self._errors(), self.units
        words = parameters_in_words({name: (value, errors[name], units[name]) for name, value in flat.items()})
        laws = " + ".join(law.kind for law in self.laws) or "no law"
        return f"{self.name!r} is {laws}" + (f"\n{words}" if words else "")

    def _errors(self) -> dict[str, float]:
        """Standard errors in SI, nan where a parameter was not estimated."""
        known = self.covariance
        return {name: float("nan") if known is None else known.standard_error(name) for name in self.parameters}

    def columns(self) -> Columns:
        """A row per parameter, in SI."""
        flat = self.parameters
        return {
            "parameter": (list(flat), ""),
            "value": (list(flat.values()), ""),
            "unit": ([self.units[name] for name in flat], ""),
            "standard_error": (list(self._errors().values()), ""),
            "fixed": ([name in self.fixed for name in flat], ""),
        }

    def plot(self, ax: Any = None, amplitude: ArrayLike | None = None, frequency: float | None = None) -> Any:
        """Equivalent stiffness in N/µm over the amplitude in µm at one frequency (Hz), by default where it is valid."""
        axes = axes_of(ax)
        low, high = self.validity.get("frequency", (_FREQUENCY, _FREQUENCY))
        at = float(np.sqrt(max(low, high / 100) * high)) if frequency is None else float(frequency)
        largest = self.validity.get("amplitude", (0.0, _AMPLITUDE))[1]
        A = np.linspace(largest / 200, largest, 200) if amplitude is None else np.asarray(amplitude, dtype=float)
        draw_stiffness(axes, A, self.first_harmonic(A, 2 * np.pi * at).gain, label=f"{self.name}, {at:.4g} Hz")
        axes.set(xlabel="amplitude [µm]", ylabel="Re G [N/µm]")
        return axes
