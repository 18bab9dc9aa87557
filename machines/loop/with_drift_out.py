"""Everything that competes, with the drift of every record taken out as the best of it sees that."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array

from ..model.machine import Machine
from . import fallback
from .explanations.places import Place
from .fit import Fitted
from .judge import excess
from .noise.drift import FARTHEST, FREQUENCY
from .records import LevelFRF
from .search import Search
from .setting import SETTLED, WHITE, Setting

_DRIFTED = 0.8
"""Share to which the loss must fall for the drift to be judged once more."""
_TURNS, _TRIED = 4, 33
"""Turns of fitting and of looking for the drift, and drifts that are tried in each."""


@dataclass(frozen=True, eq=False)
class Searched:
    """Everything that competes, with the drift of every record taken out as the best of it sees that."""

    setting: Setting
    search: Search
    found: list[Fitted]
    table: Fitted | None
    """Where the best that has a name leaves more than noise."""
    pointing: dict[str, dict[str, Fitted]]

    @classmethod
    def of(cls, machine: Machine, places: tuple[Place, ...], training: Sequence[LevelFRF]) -> Searched:
        setting, taken, previous = Setting.centred(machine, training), np.zeros(len(training)), np.inf
        if excess(setting.loss, len(setting.rows)) > 0:
            setting = Setting.of(machine, training)
        while True:
            search = Search(machine, places, setting.fitting, setting.base, setting.residual)
            found, pointing = search.run()
            best = min(found, key=lambda f: f.loss)
            table = _table(search, best, training)
            here = cls(setting, search, found, table, pointing)
            best = best if table is None or best.loss <= table.loss else table
            drift = _drifted(machine, training, setting, best)
            done = search.at_floor(search.before) or search.at_floor(best.loss) or best.loss > _DRIFTED * previous
            if done or np.max(np.abs(drift - taken)) <= SETTLED:
                return here
            taken, previous = drift, best.loss
            setting = Setting.of(machine, training, taken)


def _drifted(machine: Machine, training: Sequence[LevelFRF], setting: Setting, best: Fitted) -> Array:
    """What every record has drifted as an explanation sees it, relative.

    Where that leaves more than noise, peaks may be so narrow that no first order leads there: then drifts are tried one
    after the other, and the explanation is fitted again at the best of them, in turns.
    """
    drift = setting.drifted(best.residual, len(training))
    for _ in range(_TURNS):
        if best.loss <= WHITE * len(best.residual):
            break
        tried = np.linspace(-FARTHEST, FARTHEST, _TRIED) * FREQUENCY
        loss = np.array([_losses(machine, training, setting, best, d) for d in tried])
        there = tried[np.argmin(loss, axis=0)]
        moved = Setting.of(machine, training, there)
        if len(moved.rows) != len(setting.rows):
            break
        found = moved.fitting.descend(best.hypothesis, best.u, best.answer, np.inf)
        if found.loss > _DRIFTED * best.loss:
            break
        setting, best = moved, found
        drift = setting.drifted(best.residual, len(training))
    return drift


def _losses(machine: Machine, training: Sequence[LevelFRF], setting: Setting, best: Fitted, drift: float) -> Array:
    """Loss of an explanation on every record as if all had drifted so."""
    fitting = setting.fitting_at(machine, training, drift)
    residual = fitting.residual(fitting.answer(best.hypothesis, best.u, best.answer.z))
    return np.asarray(np.bincount(fitting.forward.points.record, np.abs(residual) ** 2, len(training)), dtype=float)


def _table(search: Search, best: Fitted, training: Sequence[LevelFRF]) -> Fitted | None:
    """Of the joint that the best explanation changes, if that leaves more than noise at several levels."""
    lines, place = len(best.residual), best.hypothesis.place
    levels = {r.level for r in training}
    if search.at_floor(search.before) or best.loss <= WHITE * lines or len(levels) < 2 or not np.any(best.answer.fine):
        return None
    at = search.fitting.moving(best.hypothesis).index(place.rows[0])
    return fallback.fitted(search, place, float(np.max(np.abs(best.answer.z[best.answer.fine, at]))))
