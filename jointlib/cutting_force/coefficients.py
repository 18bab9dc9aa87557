"""Coefficients of cutting forces with their covariance, as a file holds them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from jointlib.errors import InputError
from jointlib.joint import Covariance


@dataclass(frozen=True)
class Coefficients:
    """What an edge feels per depth, over the chip (N/m²) and whatever the chip (N/m), by name."""

    process: str
    values: Mapping[str, float]
    covariance: Covariance | None = None
    provenance: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        wrong = next((name for name in ("tangential", "normal") if self.values.get(name, 1.0) <= 0), None)
        if wrong is not None:
            raise InputError(f"{wrong} is {self.values[wrong]:g} N/m², expected more than 0")
