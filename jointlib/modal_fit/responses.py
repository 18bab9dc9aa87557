"""Frequency responses that are fitted together."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.modal_fit.basis import Cut


@dataclass(frozen=True, eq=False)
class Responses:
    """Receptances between places, on lines that all have.

    Parameters
    ----------
    frequency
        Hz, ascending, above 0, shape (lines,).
    value
        m/N, shape (responses, lines).
    deviation
        √(E|error|²) in m/N, same shape, above 0.
    pairs
        For each response the index of the place that moves and of the one that is driven.
    dofs
        Names of the places.
    shift
        σ in 1/s where the responses are those on s = jω + σ, as an exponential window makes them.
    cut
        Where the motion is cut off in the transforms; None: nowhere.
    """

    frequency: Array
    value: ComplexArray
    deviation: Array
    pairs: tuple[tuple[int, int], ...]
    dofs: tuple[str, ...]
    shift: float = 0.0
    cut: Cut | None = None

    def __post_init__(self) -> None:
        expected = (len(self.pairs), len(self.frequency))
        if self.value.shape != expected or self.deviation.shape != expected:
            raise InputError(
                f"responses: values of shape {self.value.shape} and deviations of shape {self.deviation.shape}, "
                f"expected {expected}: a row per pair, a column per line"
            )
        if not (np.all(np.isfinite(self.value)) and np.all(self.deviation > 0)):
            raise InputError("responses: expected finite values and deviations above 0")

    @cached_property
    def s(self) -> ComplexArray:
        """jω + σ in 1/s."""
        return np.asarray(2j * np.pi * self.frequency + self.shift)

    @property
    def inputs(self) -> tuple[int, ...]:
        """Places that are driven, each once."""
        return tuple(dict.fromkeys(i for _, i in self.pairs))

    @property
    def driving(self) -> tuple[int, ...]:
        """Places whose own response to a force on them is known."""
        return tuple(dict.fromkeys(o for o, i in self.pairs if o == i))

    @property
    def count(self) -> int:
        """Real numbers that were measured."""
        return 2 * self.value.size

    def doubted(self, share: float) -> Responses:
        """With no deviation below a share of the value."""
        return replace(self, deviation=np.hypot(self.deviation, share * np.abs(self.value)))

    def within(self, low: float, high: float) -> Responses:
        """The lines between two frequencies in Hz."""
        kept = (self.frequency >= low) & (self.frequency <= high)
        return replace(
            self, frequency=self.frequency[kept], value=self.value[:, kept], deviation=self.deviation[:, kept]
        )
