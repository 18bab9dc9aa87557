"""Forces of laws whose parameters follow inputs, and what a modulation adds to them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from jointlib.arrays import Array
from jointlib.effect import Path
from jointlib.joint import Joint
from jointlib.law import JointLaw, Motion
from jointlib.loop.path.columns import at_full_rate, bare_forces, kept, stepped_together
from jointlib.loop.path.force.unit_size import Sizes
from jointlib.loop.path.preparation import Run
from jointlib.modulation import Modulation, acting, hats, scaled
from jointlib.parameter import Role, parameters_of
from jointlib.pieces import in_pieces

_STEP = 1e-3
"""Of a parameter, for the slope of a force."""

Modulations = tuple[Modulation, ...]


@dataclass(frozen=True, eq=False)
class Followed:
    """Forces along prepared records whose inputs the parameters of laws follow; each is computed once."""

    runs: tuple[Run, ...]

    @cached_property
    def force(self) -> Callable[[JointLaw, Modulations], Array]:
        """Of a law, filtered and thinned."""

        def of_unit_size(law: JointLaw, modulations: Modulations) -> Array:
            return self._column(self._full(law, modulations))

        remembered = lru_cache(maxsize=64)(of_unit_size)

        def along(law: JointLaw, modulations: Modulations) -> Array:
            one, size = self._sized(law)
            return size * remembered(one, acting(law, modulations))

        return along

    def columns(self, joint: Joint, m: Modulation) -> Array:
        """∂F/∂(coefficient of a modulation), (coefficient, sample): the slope of the force over the logarithm of the
        role's parameters, times what each coefficient does to their factor."""
        others, parts = tuple(o for o in joint.modulations if o is not m), []
        for law in joint.laws:
            if any(p.role is m.role for p in parameters_of(law)):
                one, size = self._sized(law)
                parts.append(size * self._unit_columns(one, m, acting(law, others)))
        if parts:
            return np.asarray(sum(parts))
        return np.zeros((len(hats(m, np.zeros(1))), sum(len(r.time) for r in self.runs)))

    @cached_property
    def _unit_columns(self) -> Callable[[JointLaw, Modulation, Modulations], Array]:
        def along(law: JointLaw, m: Modulation, others: Modulations) -> Array:
            slope = self._slope(law, m, others)
            bare = [self._hats(_flat(m), i) for i in range(len(self.runs))]
            return self._column([hat * s for hat, s in zip(bare, slope, strict=True)])

        return lru_cache(maxsize=16)(along)

    def _slope(self, law: JointLaw, m: Modulation, others: Modulations) -> list[Array]:
        """∂f/∂ln(parameters of the role), at the full rate: the force itself where all that holds newtons has it."""
        if not law.states and self._is_whole(law, (m,)):
            return self._full(law, others)
        more, less = (self._full(scaled(law, [(m.role, np.asarray(f))]), others) for f in (1 + _STEP, 1 - _STEP))
        return [(high - low) / (2 * _STEP) for high, low in zip(more, less, strict=True)]

    def _full(self, law: JointLaw, modulations: Modulations) -> list[Array]:
        """Along each record at the full rate, not filtered.

        The parameters of a law are those at each sample, as in an FMU: what remembers stays where it is while they
        change, and then follows the law with the new ones.
        """
        own = acting(law, modulations)
        if law.states:
            return self._stepped(law, own) if own else bare_forces(self.runs, law)
        if not own or self._is_whole(law, own):
            out = bare_forces(self.runs, law)
            for m in own:
                out = [f * self._factor(m, i) for i, f in enumerate(out)]
            return out
        out = []
        for i, r in enumerate(self.runs):
            moved = scaled(law, [(m.role, self._factor(m, i)) for m in own])
            out.append(moved.step(Motion(r.path.displacement, r.path.velocity), np.empty((len(r.force), 0)))[0])
        return out

    def _is_whole(self, law: JointLaw, own: Modulations) -> bool:
        """True if all that is proportional to the force follows the same inputs, and nothing else does."""
        roles = {m.role for m in own}
        return (
            len(roles) == 1
            and self._sized.proportional(law)
            and all((p.role in roles) == p.unit.startswith("N") for p in parameters_of(law))
        )

    @cached_property
    def _sized(self) -> Sizes:
        return Sizes(self.runs[0].path)

    @cached_property
    def _factor(self) -> Callable[[Modulation, int], Array]:
        """Of a modulation along the record of that number."""
        return lru_cache(maxsize=2 * len(self.runs))(lambda m, i: m.along(_followed(self.runs[i], m)))

    @cached_property
    def _hats(self) -> Callable[[Modulation, int], Array]:
        """What each coefficient of a modulation does to its factor along the record of that number."""
        return lru_cache(maxsize=2 * len(self.runs))(lambda m, i: hats(m, _followed(self.runs[i], m)))

    def _stepped(self, law: JointLaw, own: Modulations) -> list[Array]:
        """Of a law with memory whose parameters change from step to step."""

        def along(runs: Sequence[Run], path: Path) -> list[Array]:
            many = np.ones((len(path.displacement), len(own), len(runs)))
            for k, m in enumerate(own):
                for j, run in enumerate(runs):
                    factor = self._factor(m, self.runs.index(run))[:: run.preparation.step]
                    many[: len(factor), k, j] = factor
            return at_full_rate(runs, changing(law, [m.role for m in own], many, path))

        return stepped_together(self.runs, along)

    def _column(self, full: Sequence[Array]) -> Array:
        return kept(self.runs, full)


def _followed(run: Run, m: Modulation) -> Array:
    """What the parameters follow along a record, at the full rate."""
    return m.followed(run.inputs[m.condition], run.path.time_step)


def _flat(m: Modulation) -> Modulation:
    """A modulation that moves nothing, with the same points: what its coefficients do does not depend on them."""
    return replace(m, table=tuple((point, 1.0) for point, _ in m.table))


def changing(law: JointLaw, roles: Sequence[Role], factors: Array, path: Path) -> Array:
    """Force in N along paths (step, record) of a law whose parameters change from step to step, from the virgin state.

    ``factors`` are those of the parameters of each role, (step, role, record).
    """
    every = scaled(law, [(role, factors[:, k]) for k, role in enumerate(roles)])
    known = vars(every)
    rows = {name: len(value) if isinstance(value, tuple) else 0 for name, value in known.items() if _changes(value)}
    # The parameters of all steps are checked once, and go along the path beside the displacement.
    listed = [x for name in rows for x in (known[name] if rows[name] else [known[name]])]
    moving = np.stack([path.displacement, *listed], axis=1)

    def step(here: Array, speed: Array, state: Array) -> tuple[Array, Array]:
        now, first = object.__new__(type(law)), 1
        now.__dict__.update(known)
        for name, count in rows.items():
            own = tuple(here[..., first + k, :] for k in range(max(count, 1)))
            now.__dict__[name], first = own if count else own[0], first + len(own)
        return now.step(Motion(here[..., 0, :], speed[..., 0, :], path.time_step), state)

    def virgin(here: Array) -> Array:
        return law.initial_state(here[..., 0, :])

    return in_pieces(virgin(moving[0]), virgin, step, moving, path.velocity[:, None])


def _changes(value: object) -> bool:
    """True for a parameter, or a list of them, with a value at every step."""
    return isinstance(value[0] if isinstance(value, tuple) and value else value, np.ndarray)
