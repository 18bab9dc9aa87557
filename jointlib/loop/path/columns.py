"""Forces of laws and columns of effects along prepared records, whole grids of shapes at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.effect import JointEffect, Path
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.law import JointLaw, Motion
from jointlib.loop.path.preparation import Run
from jointlib.modulation import Modulation, hats
from jointlib.parameter import Role, parameters_of
from jointlib.registry import installed

Shape = Mapping[str, float]

_LINEAR_PROBE = np.array([[0.7, -0.3, 0.9, -0.8], [0.2, 0.9, -0.6, -0.5]])
_MOST_AT_ONCE = 1.5e7
"""Samples times records times shapes that are stepped together: 120 MB a column."""
_STEP = 1e-3
"""Of a parameter, for the slope of a force."""
_TINY = 1e-6
"""Of a parameter that may not be zero: what it is where its factor is zero."""
_MOST_KEPT = 5e7
"""Values of thinned columns that are remembered: 400 MB."""


def law_forces(runs: Sequence[Run]) -> Callable[[JointLaw], Array]:
    """The force of a law along prepared records, filtered and thinned like the measured one.

    A linear law commutes with the filter, so the filtered path already gives its filtered force; any other law is
    evaluated on the full-rate path and its force filtered.
    """

    def along(law: JointLaw) -> Array:
        if not law.states and all(_is_linear(law, run) for run in runs):
            return np.concatenate([f[run.keep] for run, f in zip(runs, bare_forces(runs, law), strict=True)])
        return np.concatenate([run.column(f) for run, f in zip(runs, bare_forces(runs, law), strict=True)])

    return lru_cache(maxsize=64)(along)


def bare_forces(runs: Sequence[Run], law: JointLaw) -> list[Array]:
    """The force of a law along each record at the full rate, not filtered."""
    if law.states:
        stepped = _side_by_side(runs)
        forces = law.along(stepped.displacement, stepped.velocity, stepped.time_step)
        return [run.spread(forces[:, i]) for i, run in enumerate(runs)]
    return [law.step(Motion(r.path.displacement, r.path.velocity), np.empty((len(r.force), 0)))[0] for r in runs]


def modulated_forces(runs: Sequence[Run]) -> Callable[[JointLaw, tuple[Modulation, ...]], Array]:
    """The force of a law whose parameters follow inputs, filtered and thinned."""

    def along(law: JointLaw, modulations: tuple[Modulation, ...]) -> Array:
        full = _followed(runs, law, modulations)
        return np.concatenate([run.column(f) for run, f in zip(runs, full, strict=True)])

    return lru_cache(maxsize=64)(along)


def follower_columns(runs: Sequence[Run], joint: Joint, m: Modulation) -> Array:
    """∂F/∂(coefficient of a modulation), (coefficient, sample): the slope of the force over the logarithm of the role's
    parameters, times what each coefficient does to their factor."""
    slope = [np.zeros(len(run.force)) for run in runs]
    others = tuple(o for o in joint.modulations if o is not m)
    for law in joint.laws:
        if not any(p.role is m.role for p in parameters_of(law)):
            continue
        more, less = (_followed(runs, _scaled(law, [(m.role, np.asarray(f))]), others) for f in (1 + _STEP, 1 - _STEP))
        for total, high, low in zip(slope, more, less, strict=True):
            total += (high - low) / (2 * _STEP)
    parts = [r.column(hats(m, r.inputs[m.condition]) * s) for r, s in zip(runs, slope, strict=True)]
    return np.concatenate(parts, axis=1)


def _followed(runs: Sequence[Run], law: JointLaw, modulations: tuple[Modulation, ...]) -> list[Array]:
    """Along each record at the full rate, not filtered.

    Without memory the parameters of a law are those at each sample. A law with memory is stepped with those of each
    point of a table, and its forces are joined as the factors are: in a straight line from point to point.
    """
    own = tuple(m for m in modulations if any(p.role is m.role for p in parameters_of(law)))
    if law.states:
        return _joined(runs, law, own)
    out = []
    for r in runs:
        moved = _scaled(law, [(m.role, m.along(r.inputs[m.condition])) for m in own])
        out.append(moved.step(Motion(r.path.displacement, r.path.velocity), np.empty((len(r.force), 0)))[0])
    return out


def _joined(runs: Sequence[Run], law: JointLaw, modulations: tuple[Modulation, ...]) -> list[Array]:
    if not modulations:
        return bare_forces(runs, law)
    first, rest = modulations[0], modulations[1:]
    at, factors = (np.array(x) for x in zip(*first.table, strict=True))
    weights = [np.array([np.interp(run.inputs[first.condition], at, row) for row in np.eye(len(at))]) for run in runs]
    if rest or any(p.listed for p in parameters_of(law)):
        found = [_joined(runs, _scaled(law, [(first.role, np.asarray(f))]), rest) for f in factors]
        return [
            np.sum([w * f[i] for w, f in zip(weight, found, strict=True)], axis=0) for i, weight in enumerate(weights)
        ]
    wide = _widened(_side_by_side(runs), len(at))
    forces = _scaled(law, [(first.role, factors)]).along(wide.displacement, wide.velocity, wide.time_step)
    return [
        np.sum([w * run.spread(forces[:, i, k]) for k, w in enumerate(weight)], axis=0)
        for i, (run, weight) in enumerate(zip(runs, weights, strict=True))
    ]


def _scaled(law: JointLaw, factors: Sequence[tuple[Role, Array]]) -> JointLaw:
    """A law with the parameters of some roles times factors, which may be arrays."""
    moved: dict[str, Any] = {}
    for p in parameters_of(law):
        for role, factor in factors:
            if p.role is role and not p.table:
                known = np.asarray(moved.get(p.name, getattr(law, p.name)))
                bare = p.above + _TINY * float(np.max(np.abs(known))) if np.isfinite(p.above) else -np.inf
                new = np.maximum(known * factor, max(p.lower, bare))
                moved[p.name] = tuple(new.tolist()) if p.listed else new if np.ndim(new) else float(new)
    return replace(law, **moved) if moved else law  # type: ignore[type-var]


class ColumnStore:
    """Columns of effects along the fit records, kept from round to round while the joint does not enter them."""

    def __init__(self, runs: Sequence[Run]) -> None:
        self._runs = runs
        self._kept: dict[tuple[str, str, tuple[tuple[str, float], ...]], tuple[Joint, Array]] = {}

    def columns(self, effect: JointEffect, shapes: Sequence[Shape], joint: Joint) -> list[Array]:
        """Filtered and thinned force for unit coefficients, (coefficient, sample), at each shape."""
        keys = [(effect.family, effect.member, tuple(sorted(shape.items()))) for shape in shapes]
        probe = _probe(self._runs[0].path)
        have: dict[int, Array] = {}
        for i, (key, shape) in enumerate(zip(keys, shapes, strict=True)):
            if key in self._kept:
                then, columns = self._kept[key]
                if then is joint or np.array_equal(
                    effect.columns(probe, shape, then), effect.columns(probe, shape, joint)
                ):
                    have[i] = columns
        todo = [i for i in range(len(shapes)) if i not in have]
        for i, columns in zip(todo, self._along([shapes[i] for i in todo], effect, joint), strict=True):
            have[i] = columns
            if sum(c.size for _, c in self._kept.values()) + columns.size < _MOST_KEPT:
                self._kept[keys[i]] = joint, columns
        return [have[i] for i in range(len(shapes))]

    def _along(self, shapes: Sequence[Shape], effect: JointEffect, joint: Joint) -> list[Array]:
        runs, laws = self._runs, installed("jointlib.laws").found
        if effect.member not in laws or not laws[effect.member].states:
            return [
                np.concatenate([run.column(effect.columns(run.path, s, joint)) for run in runs], axis=1) for s in shapes
            ]
        stepped = _side_by_side(runs)
        many = max(1, int(_MOST_AT_ONCE / stepped.displacement.size))
        out: list[Array] = []
        for first in range(0, len(shapes), many):
            for columns in _stepped(effect, stepped, shapes[first : first + many], joint):
                rows = [[_thinned(run, row[:, i]) for i, run in enumerate(runs)] for row in columns]
                out.append(np.array([np.concatenate(row) for row in rows]))
        return out


def _stepped(effect: JointEffect, paths: Path, shapes: Sequence[Shape], joint: Joint) -> list[Array]:
    """Columns (coefficient, step, record) of an effect with memory at each shape; all shapes in one pass if it can."""
    if len(shapes) > 1:
        grid = {key: np.array([s[key] for s in shapes]) for key in shapes[0]}
        if _takes_grids(effect, paths, shapes, grid, joint):
            wide = _widened(paths, len(shapes))
            together = effect.columns(wide, grid, joint)  # type: ignore[arg-type]
            return [together[..., k] for k in range(len(shapes))]
    return [effect.columns(paths, shape, joint) for shape in shapes]


def _takes_grids(
    effect: JointEffect, paths: Path, shapes: Sequence[Shape], grid: Mapping[str, Array], joint: Joint
) -> bool:
    """True if an effect asked for all shapes at once answers the same as asked for the last one alone."""
    pick = np.linspace(0, len(paths.displacement) - 1, 12).astype(int)
    short = Path(paths.displacement[pick], paths.velocity[pick], paths.time_step)
    try:
        together = effect.columns(_widened(short, len(shapes)), grid, joint)  # type: ignore[arg-type]
    except (TypeError, ValueError, IndexError, InputError):
        return False
    alone = effect.columns(short, shapes[-1], joint)
    return together.shape == (*alone.shape, len(shapes)) and np.allclose(together[..., -1], alone, rtol=1e-9, atol=0)


def _widened(path: Path, count: int) -> Path:
    shape = (*path.displacement.shape, count)
    z, v = (np.broadcast_to(x[..., None], shape) for x in (path.displacement, path.velocity))
    return Path(z, v, path.time_step)


def _side_by_side(runs: Sequence[Run]) -> Path:
    """The paths on which laws with memory are stepped, one record a column; the shorter ones rest at their end."""
    paths = [run.stepped() for run in runs]
    longest = max(len(p.displacement) for p in paths)
    z = np.stack([np.pad(p.displacement, (0, longest - len(p.displacement)), mode="edge") for p in paths], axis=1)
    v = np.stack([np.pad(p.velocity, (0, longest - len(p.velocity))) for p in paths], axis=1)
    return Path(z, v, paths[0].time_step)


def _thinned(run: Run, stepped: Array) -> Array:
    """One record's part of a stepped force, (step,), at the full rate, through the filter, thinned."""
    return run.column(run.spread(stepped))


def _probe(path: Path) -> Path:
    """A short stretch of a path, to see whether columns have changed."""
    pick = np.linspace(0, len(path.displacement) - 1, 40).astype(int)
    return Path(path.displacement[pick], path.velocity[pick], path.time_step)


def _is_linear(law: JointLaw, run: Run) -> bool:
    """True if forces add up over motions whatever the parameters."""
    size = np.array([np.max(np.abs(run.path.displacement)), np.max(np.abs(run.path.velocity))])[:, None]
    first, second = _LINEAR_PROBE * size, np.roll(_LINEAR_PROBE, 1, axis=1) * size
    joint = Joint((law,))
    moved = {}
    for i, (name, value) in enumerate(joint.parameters.items()):
        moved[name] = value * (1 + 0.1 / (i + 1)) or 1.0
    for probe in (joint, moved_or_none(joint, moved)):
        if probe is None:
            continue
        f1, f2, both = (probe.step(Motion(*z), np.empty((4, 0)))[0] for z in (first, second, first + second))
        if not np.allclose(both, f1 + f2, rtol=1e-9, atol=1e-9 * float(np.max(np.abs(both)) + 1e-300)):
            return False
    return True


def moved_or_none(joint: Joint, values: Mapping[str, float]) -> Joint | None:
    """The joint with other parameters; None where they are not admissible."""
    try:
        return joint.with_parameters(values)
    except InputError:
        return None
