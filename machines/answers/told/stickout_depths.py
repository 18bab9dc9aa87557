"""Depths at one speed over the stick-out of a tool, and what is to be said of them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import CheckFailed, InputError, Outcome
from jointlib.joint import Joint

from ...cutting.amplitude.frozen_lobes import lobes_at_amplitude
from ...cutting.process.chart import StabilityLobes
from ...cutting.rest.beyond_record import refuse_unknown
from ...files.machine_file import read_machine
from ...model.machine import Machine
from ...road.open_joints import with_joints

MORE = "records to a higher frequency tell more, or a spindle end that is known with its modes"


class StickOutDepths:
    """The charts at one speed by stick-out, each computed once, and what `lobes` says of them."""

    def __init__(self, path: Path, changes: dict[str, str], key: str, speed: float, method: str | None) -> None:
        self._path, self._changes, self._key, self._speed, self._method = path, changes, key, speed, method
        self._charts: dict[float, StabilityLobes] = {}
        self._refused: dict[float, str] = {}
        self._joints: dict[str, Joint] = {}
        self.remarks: tuple[str, ...] = ()
        """What is said of the joints that were identified."""

    def machine(self, stick_out: float) -> Machine:
        """The machine with the tool so far (m) out; joints that records tell are identified once."""
        read = read_machine(self._path, {**self._changes, self._key: float(stick_out)})
        names = [connection.name for connection in read.connections if connection.identify is not None]
        if names and not self._joints:
            found, said = with_joints(read)
            self._joints = {c.name: c.joint for c in found.connections if c.name in names and c.joint is not None}
            self.remarks = tuple(
                words for words in said if any(words.startswith(f"{name}: as ident") for name in names)
            )
        for name in names:
            read = read.with_joint(name, self._joints[name])
        return read

    def chart(self, stick_out: float) -> StabilityLobes | None:
        """The chart at a stick-out in m, None where it is refused."""
        at = float(stick_out)
        if at not in self._charts and at not in self._refused:
            model = self.machine(at)
            try:
                chart = lobes_at_amplitude(model, [self._speed], method=self._method)
                refuse_unknown(chart)
                self._charts[at] = chart
            except (InputError, CheckFailed) as error:
                self._refused[at] = str(error)
        return self._charts.get(at)

    def depth(self, stick_out: float) -> float:
        """m, no number where it is not known."""
        chart = self.chart(stick_out)
        return np.nan if chart is None else float(chart.depth[0])

    def sure(self, stick_out: float) -> float:
        """The depth in m where nothing is to be said against it, else no number."""
        chart = self.chart(stick_out)
        doubted = chart is None or chart.outcome is not Outcome.CONVERGED or bool(chart.doubtful[0])
        return np.nan if doubted else self.depth(stick_out)

    @property
    def known_to(self) -> float | None:
        """Hz up to which all that was computed holds."""
        return min((chart.known_to for chart in self._charts.values() if chart.known_to is not None), default=None)

    def refusals(self) -> list[str]:
        """Where the depth is not known, and why."""
        reasons: dict[str, list[float]] = {}
        for at in sorted(self._refused):
            reasons.setdefault(self._refused[at], []).append(at)
        return [f"At {_listed(places)} the depth is not known: {why}." for why, places in reasons.items()]

    def notes(self, grid: Array, pockets: Sequence[float]) -> list[str]:
        """What `lobes` says where the deepest pocket lies (m), or where the depth is largest, and what it refuses."""
        said: list[str] = []
        known = {at: chart for at, chart in self._charts.items() if pockets or at in grid}
        best = max(known, key=lambda at: float(known[at].depth[0]), default=None)
        at = pockets[0] if pockets else best
        if at is not None:
            said = [f"At {1e3 * at:.4g} mm: {sentence}" for sentence in dict.fromkeys(known[at].warnings)]
        if pockets and self._refused_or_doubted(grid):
            said.append(f"Where the depth is not known or doubtful nothing is recommended: {MORE}.")
        return [*self.remarks, *said, *self.refusals()]

    def _refused_or_doubted(self, grid: Array) -> bool:
        return self.known_to is not None and bool(np.any(np.isnan([self.sure(x) for x in grid])))


def _listed(places: Sequence[float]) -> str:
    return ", ".join(f"{1e3 * x:.4g}" for x in places) + " mm"
