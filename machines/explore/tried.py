"""Test cuts of a machine file as the page marks them on the lobes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from jointlib import read_measurement
from jointlib.cuts.judged import judged_cuts
from jointlib.cuts.tried_cut import TriedCut

from ..model.machine import Machine


@dataclass(frozen=True)
class Tried:
    """A cut that somebody made, and whether it was made as the machine file cuts."""

    cut: TriedCut
    alike: bool
    """Whether mode, immersion, feed and teeth are those of ``[cutting]``."""


def tried_of(machine: Machine) -> tuple[Tried, ...]:
    """The cuts of every ``[[cuts]]`` that were judged, in order."""
    given = machine.cutting or {}
    return tuple(
        Tried(one.cut, _alike(one.cut, given))
        for path in machine.cuts
        for one in judged_cuts(read_measurement(path))
        if one.cut.verdict != "unknown"
    )


def _alike(cut: TriedCut, cutting: Mapping[str, object]) -> bool:
    own = {name: getattr(cut, name) for name in ("mode", "immersion", "feed")}
    same = all(value is None or cutting.get(name) in (None, value) for name, value in own.items())
    return same and cutting.get("teeth", cut.teeth) == cut.teeth
