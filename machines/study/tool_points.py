"""Tool points of the configurations of a study, and the limits and pockets of their cuts, many at a time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import CheckFailed
from jointlib.frf import FRF

from ..cutting.amplitude.pocket import Pocket, settle
from ..cutting.process.cutting import Cutting
from ..cutting.rest.solve import stability_lobes
from ..cutting.rest.together import METHODS, Limits, limits, peak_receptance, preview
from ..tool.tool_model import ToolModel
from ..tool.tool_point import ToolPoint
from .speed_dependent import SpeedDependent

Cut = ToolModel | FRF | ToolPoint | SpeedDependent

_ROUNDS = 12
"""How often the limits of all configurations are asked for at further speeds."""


@dataclass(eq=False)
class Tips:
    """Tool points of configurations, one per amplitude: as modes, or on lines where there are none."""

    rows: list[int] = field(default_factory=list)
    tools: list[ToolModel | FRF] = field(default_factory=list)
    cut: list[Cut] = field(default_factory=list)
    """As `lobes` takes them: what has no modes is known at every frequency for small vibrations."""
    axes: list[tuple[str, ...]] = field(default_factory=list)

    def add(self, row: int, tool: ToolModel | FRF, cut: Cut, axes: tuple[str, ...]) -> None:
        """A tool point that moves along these axes."""
        self.rows.append(row)
        self.tools.append(tool)
        self.cut.append(cut)
        self.axes.append(axes)

    def peaks(self, count: int) -> Array:
        """Largest direct receptance in m/N of every configuration: of modes at the very peak, else on the lines."""
        found = np.zeros(count)
        modal: dict[tuple[str, ...], list[tuple[int, ToolModel]]] = {}
        for row, tool, axes in zip(self.rows, self.tools, self.axes, strict=True):
            if isinstance(tool, ToolModel):
                modal.setdefault(axes, []).append((row, tool))
            else:
                found[row] = max(found[row], np.max(direct(tool.receptance)))
        for members in modal.values():
            np.maximum.at(found, [row for row, _ in members], peak_receptance([tool for _, tool in members]))
        return found

    def limits(
        self, rows: Sequence[int], cuttings: Sequence[Cutting], speeds: Array, lobes: str | None, by_speed: bool = True
    ) -> Limits:
        """Limits of some configurations in their cuts, the lowest over the tool points of each.

        ``speeds`` in rpm, (rows, speeds), by the method ``lobes`` or the fast one; without ``by_speed`` the limits
        at the speeds are not needed.
        """
        place = {row: k for k, row in enumerate(rows)}
        lowest, limit = np.full(len(rows), np.inf), np.full(speeds.shape, np.inf)
        together: dict[tuple[tuple[str, ...], str], list[int]] = {}
        for i, (row, tool, axes) in enumerate(zip(self.rows, self.cut, self.axes, strict=True)):
            if row not in place:
                continue
            k, method = place[row], lobes or preview(cuttings[row].process)
            if isinstance(tool, ToolModel) and method in METHODS:
                together.setdefault((axes, method), []).append(i)
                continue
            if isinstance(tool, SpeedDependent):
                chart = tool.lobes(cuttings[row], speeds[k], method)
            else:
                one_way = axes if isinstance(tool, FRF) else None
                chart = stability_lobes(tool, cuttings[row], speeds[k], method, axes=one_way)
            lowest[k], limit[k] = min(lowest[k], chart.minimum_depth), np.minimum(limit[k], chart.sure)
        for (_, method), members in together.items():
            at = [place[self.rows[i]] for i in members]
            models = [tool for i in members if isinstance(tool := self.cut[i], ToolModel)]
            wanted = speeds[at] if by_speed else speeds[at, :0]
            found = limits(models, [cuttings[rows[k]] for k in at], method, wanted)
            np.minimum.at(lowest, at, found.minimum_depth)
            if by_speed:
                np.minimum.at(limit, at, found.depth)
        return Limits(lowest, limit)


def pockets_of(
    tips: Tips,
    cuttings: Sequence[Cutting],
    speeds: Array,
    limit: Array,
    groups: Sequence[Sequence[int]],
    lobes: str | None,
) -> Mapping[int, Pocket]:
    """The pocket of every configuration that has one; those of a group, told by their rows, are set to one speed.

    ``limit`` in m, (configurations, speeds). What is asked for at further speeds is computed for all groups at once.
    """
    found: dict[int, Pocket] = {}
    asking = [
        (rows, settle(speeds[rows[0]], limit[rows], [cuttings[row] for row in rows], rounds=_ROUNDS)) for rows in groups
    ]
    answers: list[Array | None] = [None] * len(asking)
    while asking:
        still = []
        for (rows, settling), answer in zip(asking, answers, strict=True):
            try:
                still.append((rows, settling, settling.send(answer)))
            except StopIteration as settled:
                found |= {row: one for row, one in zip(rows, settled.value, strict=True) if one is not None}
        asking = [(rows, settling) for rows, settling, _ in still]
        answers = _limits_at(tips, cuttings, [(rows, wanted) for rows, _, wanted in still], lobes)
    return found


def _limits_at(
    tips: Tips, cuttings: Sequence[Cutting], asked: Sequence[tuple[Sequence[int], Array]], lobes: str | None
) -> list[Array | None]:
    """The limits of every group of rows at its speeds, (rows, speeds); None where a method does not settle."""
    if not asked:
        return []
    most = max(len(wanted) for _, wanted in asked)
    rows = [row for group, _ in asked for row in group]
    speeds = np.concatenate([np.tile(np.resize(wanted, most), (len(group), 1)) for group, wanted in asked])
    try:
        depth = tips.limits(rows, cuttings, speeds, lobes).depth
    except CheckFailed:
        return [None] * len(asked)
    ends = np.cumsum([len(group) for group, _ in asked])[:-1]
    return [part[:, : len(wanted)] for part, (_, wanted) in zip(np.split(depth, ends), asked, strict=True)]


def direct(receptance: ComplexArray) -> Array:
    """Sizes of the direct receptances, (lines, axes)."""
    return np.asarray(np.abs(np.einsum("fii->fi", receptance)))
