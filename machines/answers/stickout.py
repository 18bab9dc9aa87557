"""How far a tool may stick out so that the wanted speed lies in a pocket."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from jointlib.answers.given import File, Quantities, Quantity, one, several
from jointlib.arrays import Array
from jointlib.errors import InputError, nearest
from jointlib.io.atomic import given_target, write_text
from jointlib.shown.pictures import axes_of, name_curves, write_picture
from jointlib.shown.progress import Progress, Silent, each
from jointlib.shown.result import Columns, Shown
from jointlib.shown.text import table
from jointlib.units import quantity

from ..files.machine_file import documents
from ..files.opened import with_tool
from ..indices import Mask
from .told.stickout_depths import MORE, StickOutDepths

_COUNT, _FEWEST, _MOST = 13, 3, 500
_BETWEEN = 3
"""Further stick-outs on either side of a pocket."""
_EXACT = 2e-4
"""m, to which the stick-out of a pocket is refined."""
_RISE = 1.05
"""By how much a pocket must be deeper than the lowest depth of the curve."""


@dataclass(frozen=True)
class Pocket:
    """A stick-out (m) at which the depth at the wanted speed is larger than on either side, and that depth (m)."""

    stick_out: float
    depth: float


@dataclass(frozen=True, eq=False, repr=False)
class StickOuts(Shown):
    """Limiting depth of cut at one speed over the stick-out of a tool."""

    component: str
    speed: float
    """rpm."""
    stick_out: Array
    """m."""
    depth: Array
    """m; infinite where unbounded, no number where it is not known."""
    doubtful: Mask
    """Where `lobes` doubts the depth, as of records that end early: it is no more than that, and no advice."""
    known_to: float | None
    """Hz up to which all depths hold; None where nothing is left out."""
    flutes: float | None
    """m, the length of the flutes, where the tool is known by its sizes."""
    pockets: tuple[Pocket, ...]
    """Deepest first."""
    notes: tuple[str, ...]
    files: tuple[Path, ...] = ()

    def finding(self) -> str:
        """The stick-outs that put a pocket at the speed."""
        if not self.pockets:
            unknown = int(np.count_nonzero(self.doubtful | np.isnan(self.depth)))
            if not unknown:
                return f"no stick-out of {self.component} in this range puts a pocket at {self.speed:.5g} rpm"
            more = "" if self.known_to is None else f": {MORE}"
            return (
                f"no stick-out of {self.component} in this range is known to put a pocket at {self.speed:.5g} rpm, at "
                f"{unknown} of {len(self.depth)} of them the depth is not known or doubtful{more}"
            )
        best = self.pockets[0]
        rest = ", ".join(f"{1e3 * p.stick_out:.4g} mm ({self._told(p.depth)})" for p in self.pockets[1:])
        return (
            f"a stick-out of {1e3 * best.stick_out:.4g} mm puts a pocket at {self.speed:.5g} rpm, stable below "
            f"{self._told(best.depth)}{'; also ' + rest if rest else ''}"
        )

    def _told(self, depth: float, doubtful: bool = False) -> str:
        """A depth in words: no deeper than the flutes, and no more than what is known."""
        said = _mm(depth)
        if self.flutes and depth > self.flutes:
            said = f"{_mm(self.flutes)}, where the flutes end"
        if not doubtful or np.isnan(depth):
            return said
        known = "doubtful" if self.known_to is None else f"up to {self.known_to:g} Hz"
        return f"{'at most ' if np.isfinite(depth) else ''}{said}, {known}"

    def columns(self) -> Columns:
        """A row per stick-out."""
        return {"stick_out": (self.stick_out, "m"), "depth": (self.depth, "m"), "doubtful": (self.doubtful, "")}

    def plot(self, ax: Any = None) -> Any:
        """Limiting depth in mm over the stick-out in mm, the pockets marked."""
        axes = axes_of(ax)
        curve = np.where(np.isfinite(self.depth) & ~self.doubtful, self.depth, np.nan)
        axes.plot(1e3 * self.stick_out, 1e3 * curve, ".-", label="stable below, as computed")
        if np.any(self.doubtful & np.isfinite(self.depth)):
            doubted = np.where(self.doubtful & np.isfinite(self.depth), self.depth, np.nan)
            axes.plot(1e3 * self.stick_out, 1e3 * doubted, "x", label="at most, doubtful")
        found = [(1e3 * p.stick_out, 1e3 * p.depth) for p in self.pockets if np.isfinite(p.depth)]
        if found:
            axes.plot(*zip(*found, strict=True), "o", mfc="none", label="a pocket at that speed")
        axes.set(xlabel="stick-out [mm]", ylabel=f"depth at {self.speed:.5g} rpm [mm]")
        name_curves(axes)
        return axes

    def as_json(self) -> dict[str, Any]:
        """What ``jointlib stickout --json`` prints."""
        return {
            "speed": self.speed,
            "component": self.component,
            "stick_out": self.stick_out.tolist(),
            "depth": self.depth.tolist(),
            "doubtful": self.doubtful.tolist(),
            "known_to": self.known_to,
            "flute_length": self.flutes,
            "pockets": [vars(pocket) for pocket in self.pockets],
            "sentence": self.finding(),
            "warnings": list(self.notes),
            "file": str(self.files[0]) if self.files else None,
        }

    def words(self) -> list[str]:
        """What ``jointlib stickout`` prints."""
        each_of = zip(self.stick_out, self.depth, self.doubtful, strict=True)
        rows = [(f"{1e3 * x:.4g}", self._told(d, doubted)) for x, d, doubted in each_of]
        return [f"{self.finding()}.", *table(("stick-out [mm]", "depth"), rows), *self.notes]


def stickout(
    machine: File,
    *,
    between: Quantities,
    speed: Quantity,
    count: int = _COUNT,
    component: str | None = None,
    method: str | None = None,
    output: File | None = None,
    tool: str | None = None,
    progress: Progress | None = None,
) -> StickOuts:
    """The stick-outs of a tool that put a pocket at a speed, and the depth over the stick-out: ``jointlib stickout``.

    Parameters
    ----------
    machine
        A machine file with a component of kind "tool" and a cut.
    between
        Shortest and longest stick-out, m or with units.
    speed
        rpm or with its unit.
    count
        Stick-outs of the curve; pockets between them are refined to 0.2 mm.
    component
        Which component of kind "tool"; default: the only one.
    method
        Of the lobes, as in ``lobes``; default: what suits.
    output
        The file of the curve to write: .csv or .svg.
    tool
        Which of several named tools is in the machine.
    progress
        Told of every part that takes long.
    """
    target = given_target(output, ".csv", ".svg")
    limits, rate = several(between, "m", "--between", 1e-6), one(speed, "rpm", "--speed", 1e-6)
    if len(limits) != 2 or not limits[0] < limits[1]:
        raise InputError(f"--between: {', '.join(f'{x:g} m' for x in limits)}, expected the shortest and the longest")
    if not _FEWEST <= count <= _MOST:
        raise InputError(f"--count: {count}, expected {_FEWEST} to {_MOST}")
    assert rate is not None
    path, changes = Path(machine), with_tool(tool)
    name, flutes = _named(path, changes, component)
    told = StickOutDepths(path, changes, f"component.{name}.stick_out", rate, method)
    grid = np.linspace(*limits, count)
    with (progress or Silent()).step("computing depths over the stick-out"):
        first = told.machine(float(grid[0]))
        if first.cutting is None or not first.tool:
            raise InputError(f"{path}: no [tool] or no [cutting], expected both for a depth of cut")
        sure = np.array([told.sure(x) for x in each("stick-outs", grid, count)])
        pockets = _pockets(grid, sure, told.sure)
    curve = np.array([told.depth(x) for x in grid])
    if not np.any(~np.isnan(curve)):
        raise InputError(f"{path}: no depth is known from {limits[0]:g} to {limits[1]:g} m; {told.refusals()[0]}")
    doubtful = np.isnan(sure) & ~np.isnan(curve)
    notes, known_to = tuple(told.notes(grid, [pocket.stick_out for pocket in pockets])), told.known_to
    found = StickOuts(name, rate, grid, curve, doubtful, known_to, flutes, pockets, notes)
    if target is None:
        return found
    if target.suffix == ".svg":
        write_picture(target, found.plot())
    else:
        rows = "".join(f"{x:.9g},{d:.9g},{q:d}\n" for x, d, q in zip(grid, curve, doubtful, strict=True))
        write_text(target, f"stick_out [m],depth [m],doubtful\n{rows}")
    return replace(found, files=(target,))


def _named(path: Path, changes: dict[str, str], component: str | None) -> tuple[str, float | None]:
    """The component of kind tool that is asked for, and how long its flutes are in m."""
    parts = [part for d in documents(path, changes) for part in d.raw().get("component", []) if isinstance(part, dict)]
    tools = [str(part.get("name")) for part in parts if part.get("kind") == "tool"]
    if component is not None:
        if component not in tools:
            raise InputError(f"--component: no component {component!r} of kind 'tool', {nearest(component, tools)}")
        return component, _flutes(parts, component)
    if len(tools) != 1:
        have = ", ".join(tools) or "none"
        raise InputError(f"{path}: components of kind 'tool': {have}; expected one, or --component with its name")
    return tools[0], _flutes(parts, tools[0])


def _flutes(parts: Sequence[dict[str, Any]], name: str) -> float | None:
    """The length of the flutes in m; None of a tool without."""
    given = next(part.get("flute_length") for part in parts if part.get("name") == name)
    return None if given is None else quantity(given, "m", f"component {name!r}") or None


def _pockets(grid: Array, curve: Array, depth: Callable[[float], float]) -> tuple[Pocket, ...]:
    """Maxima of the curve inside the range, each refined between its neighbours."""
    lowest = np.nanmin(curve, initial=np.inf)
    found = []
    for i in range(1, len(grid) - 1):
        left, here, right = curve[i - 1 : i + 2]
        if not (here >= left and here >= right and here > _RISE * lowest):
            continue
        found.append(_refined(grid[i - 1 : i + 2], here, depth) if np.isfinite(here) else Pocket(float(grid[i]), here))
    return tuple(sorted(found, key=lambda pocket: -pocket.depth))


def _refined(around: Array, here: float, depth: Callable[[float], float]) -> Pocket:
    """The deepest place between two neighbours: more stick-outs first, as lobes of several modes may lie there."""
    between = np.linspace(around[0], around[2], 2 * _BETWEEN + 3)
    further = each("stick-outs next to a pocket", between[1:-1], len(between) - 2)
    inner = [here if i == _BETWEEN + 1 else depth(x) for i, x in enumerate(further, 1)]
    top = int(np.nanargmax(inner)) + 1
    best = Pocket(float(between[top]), float(inner[top - 1]))
    if not np.isfinite(best.depth):
        return best
    tried = scipy.optimize.minimize_scalar(
        lambda x: -np.nan_to_num(depth(x), nan=0.0),
        bounds=(between[top - 1], between[top + 1]),
        method="bounded",
        options={"xatol": _EXACT},
    )
    return Pocket(float(tried.x), float(-tried.fun)) if -tried.fun > best.depth else best


def _mm(depth: float) -> str:
    if np.isnan(depth):
        return "not known"
    return f"{1e3 * depth:.4g} mm" if np.isfinite(depth) else "any depth"
