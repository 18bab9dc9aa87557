"""Forces of laws and columns of effects along prepared records, whole grids of shapes at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import TypeVar

import numpy as np

from jointlib.arrays import Array
from jointlib.effect import JointEffect, Path
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.law import JointLaw, Motion, memoryless
from jointlib.loop.path.force.unit_size import Sizes, form_of
from jointlib.loop.path.preparation import Run
from jointlib.registry import installed

Shape = Mapping[str, float]
_Found = TypeVar("_Found")

_LINEAR_PROBE = np.array([[0.7, -0.3, 0.9, -0.8], [0.2, 0.9, -0.6, -0.5]])
_MOST_AT_ONCE = 1.5e7
"""Samples times records times shapes that are stepped together: 120 MB a column."""
_LIKE = 0.8
"""Of the length of a record, up to which shorter ones are stepped beside it."""
_FEW = 2**15
"""Samples that are filtered together: more are faster one after the other."""
_MOST_KEPT = 5e7
"""Values of thinned columns that are remembered: 400 MB."""


def law_forces(runs: Sequence[Run]) -> Callable[[JointLaw], Array]:
    """The force of a law along prepared records, filtered and thinned like the measured one.

    A linear law commutes with the filter, so the filtered path already gives its filtered force; any other law is
    evaluated on the full-rate path and its force filtered. Laws that differ by their size alone are evaluated once.
    """
    linear: dict[object, bool] = {}
    sized = Sizes(runs[0].path)

    def of_unit_size(law: JointLaw) -> Array:
        form = form_of(law)
        if form not in linear:
            linear[form] = not law.states and all(_is_linear(law, run) for run in runs)
        if linear[form]:
            paths = [(r.path.displacement[r.keep], r.path.velocity[r.keep]) for r in runs]
            return np.concatenate([memoryless(law, z, v) for z, v in paths])
        return kept(runs, bare_forces(runs, law))

    remembered = lru_cache(maxsize=64)(of_unit_size)

    def along(law: JointLaw) -> Array:
        one, size = sized(law)
        return size * remembered(one)

    return along


def bare_forces(runs: Sequence[Run], law: JointLaw) -> list[Array]:
    """The force of a law along each record at the full rate, not filtered."""
    if law.states:
        return stepped_together(
            runs, lambda own, path: at_full_rate(own, law.along(path.displacement, path.velocity, path.time_step))
        )
    laid = end_to_end(tuple(runs))
    return _taken_apart(memoryless(law, laid.displacement, laid.velocity), runs)


@lru_cache(maxsize=2)
def end_to_end(runs: tuple[Run, ...]) -> Path:
    """The paths of all records as one, for laws without memory."""
    z, v = (np.concatenate([getattr(r.path, name) for r in runs]) for name in ("displacement", "velocity"))
    return Path(z, v, runs[0].path.time_step)


def _taken_apart(laid: Array, runs: Sequence[Run]) -> list[Array]:
    return np.split(laid, np.cumsum([len(run.force) for run in runs])[:-1], axis=-1)


def kept(runs: Sequence[Run], full: Sequence[Array]) -> Array:
    """Forces along each record at the full rate, (…, sample), filtered, thinned and laid end to end; those of short
    records of one length are filtered together."""
    together = {(run.begin, len(run.force)) for run in runs}
    if len(runs) > 1 and len(together) == 1 and sum(x.size for x in full) <= _FEW:
        return np.concatenate(list(runs[0].column(np.stack(full))), axis=-1)
    return np.concatenate([run.column(x) for run, x in zip(runs, full, strict=True)], axis=-1)


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
            return [kept(runs, [effect.columns(run.path, s, joint) for run in runs]) for s in shapes]
        many = max(1, int(_MOST_AT_ONCE / sum(len(run.force) for run in runs)))
        out: list[Array] = []
        for some in (shapes[first : first + many] for first in range(0, len(shapes), many)):

            def along(own: Sequence[Run], path: Path, some: Sequence[Shape] = some) -> list[list[list[Array]]]:
                found = [[at_full_rate(own, row) for row in columns] for columns in _stepped(effect, path, some, joint)]
                return [[[row[i] for row in rows] for rows in found] for i in range(len(own))]

            forces = stepped_together(runs, along)
            for k in range(len(some)):
                rows = range(len(forces[0][k]))
                out.append(np.array([kept(runs, [of_run[k][j] for of_run in forces]) for j in rows]))
        return out


def _stepped(effect: JointEffect, paths: Path, shapes: Sequence[Shape], joint: Joint) -> list[Array]:
    """Columns (coefficient, step, record) of an effect with memory at each shape; all shapes in one pass if it can."""
    if len(shapes) > 1:
        grid = {key: np.array([s[key] for s in shapes]) for key in shapes[0]}
        if _takes_grids(effect, paths, shapes, grid, joint):
            wide = widened(paths, len(shapes))
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
        together = effect.columns(widened(short, len(shapes)), grid, joint)  # type: ignore[arg-type]
    except (TypeError, ValueError, IndexError, InputError):
        return False
    alone = effect.columns(short, shapes[-1], joint)
    return together.shape == (*alone.shape, len(shapes)) and np.allclose(together[..., -1], alone, rtol=1e-9, atol=0)


def widened(path: Path, count: int) -> Path:
    shape = (*path.displacement.shape, count)
    z, v = (np.broadcast_to(x[..., None], shape) for x in (path.displacement, path.velocity))
    return Path(z, v, path.time_step)


def stepped_together(runs: Sequence[Run], along: Callable[[tuple[Run, ...], Path], list[_Found]]) -> list[_Found]:
    """What ``along`` makes of the records, those of about one length stepped side by side."""
    found: dict[Run, _Found] = {}
    for own in _of_like_length(tuple(runs)):
        found.update(zip(own, along(own, side_by_side(own)), strict=True))
    return [found[run] for run in runs]


@lru_cache(maxsize=2)
def _of_like_length(runs: tuple[Run, ...]) -> list[tuple[Run, ...]]:
    """Records in groups whose shortest has most of the length of the longest."""
    groups: list[list[Run]] = []
    for run in sorted(runs, key=lambda run: -len(run.force)):
        if not groups or len(run.force) < _LIKE * len(groups[-1][0].force):
            groups.append([])
        groups[-1].append(run)
    return [tuple(group) for group in groups]


@lru_cache(maxsize=16)
def side_by_side(runs: tuple[Run, ...]) -> Path:
    """The paths on which laws with memory are stepped, one record a column; the shorter ones rest at their end.

    Nobody can write to them, so that where they turn is found once.
    """
    paths = [run.stepped() for run in runs]
    longest = max(len(p.displacement) for p in paths)
    z = np.stack([np.pad(p.displacement, (0, longest - len(p.displacement)), mode="edge") for p in paths], axis=1)
    v = np.stack([np.pad(p.velocity, (0, longest - len(p.velocity))) for p in paths], axis=1)
    for x in (z, v):
        x.setflags(write=False)
    return Path(z, v, paths[0].time_step)


def at_full_rate(runs: Sequence[Run], stepped: Array) -> list[Array]:
    """Each record's part of a stepped force, (step, record)."""
    return [run.spread(np.ascontiguousarray(stepped[:, i])) for i, run in enumerate(runs)]


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
