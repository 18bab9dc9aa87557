"""What is changed for a configuration: in the machine file, in the joints and in the cut."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.units import quantity

from .conditions import Case
from .factors import IDENTIFICATION
from .study import BASE, Study


@dataclass(frozen=True)
class Setting:
    """One configuration: the file it starts from, what is changed in it, and what in its joints and its cut."""

    file: Path
    document: tuple[tuple[str, Any], ...]
    """Changes of the file by path, hashable."""
    joints: tuple[tuple[str, float], ...]
    """Values in SI by connection or bundle and parameter, as ``guide.hertz_guide.preload``."""
    cutting: tuple[tuple[str, Any], ...]
    sample: int | None = None
    """Number of the draw from what the identification left open; None: the machine as identified."""

    @property
    def changes(self) -> dict[str, Any]:
        """All of it by path, as `write_machine` takes it."""
        return {path: plain(value) for path, value in (*self.document, *self.cutting, *self.joints)}


def setting(study: Study, numbers: Array, case: Case, places: Mapping[str, str]) -> Setting:
    """What a row of the plan stands for; ``places`` maps paths into joints to the unit of the parameter."""
    document: list[tuple[str, Any]] = []
    cutting: list[tuple[str, Any]] = []
    joints, file, sample = [], study.base, None
    for path, value in case.changes.items():
        (cutting if path.startswith("cutting.") else document).append((path, _hashable(value)))
    for factor, number in zip(study.factors, numbers, strict=True):
        if factor.path == IDENTIFICATION:
            sample = None if np.isnan(number) else int(number)
            continue
        value = factor.value(float(number))
        if factor.path == BASE:
            file = study.source.parent / str(value)
        elif factor.path in places:
            joints.append((factor.path, quantity(value, places[factor.path], f"{study.source}: {factor.name}")))
        elif factor.path == "cutting" or factor.path.startswith("cutting."):
            cutting.append((factor.path, _hashable(value)))
        else:
            document.append((factor.path, _hashable(value)))
    return Setting(file, tuple(document), tuple(joints), tuple(cutting), sample)


def _hashable(value: Any) -> Any:
    if isinstance(value, dict):
        return frozenset((key, _hashable(v)) for key, v in value.items())
    return tuple(_hashable(v) for v in value) if isinstance(value, list) else value


def plain(value: Any) -> Any:
    if isinstance(value, frozenset):
        return {key: plain(v) for key, v in sorted(value, key=lambda item: str(item[0]))}
    return [plain(v) for v in value] if isinstance(value, tuple) else value
