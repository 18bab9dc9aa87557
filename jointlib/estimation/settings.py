"""How frequency responses are estimated from records in time: the ``[estimate]`` table of a measurement."""

from __future__ import annotations

from dataclasses import dataclass

ESTIMATORS = ("H1", "H2", "Hv")
SIGNALS = ("random", "chirp", "multisine", "stepped-sine")
EXCITED = ("impact", "shaker")
"""Kinds of measurement that hold a force and motions in time."""


@dataclass(frozen=True)
class Settings:
    """What a user may say of an estimate; what is None is chosen from the records and told."""

    estimator: str = "H1"
    """H1 (noise on the response), H2 (noise on the force) or Hv (both: the geometric mean of the two)."""
    signal: str = "random"
    """Of a shaker."""
    length: float | None = None
    """s, of a block: from a hit on, or of a random signal."""
    before: float | None = None
    """s, of the block that lies before the hit; its mean is the zero of the sensors."""
    force_window: bool = True
    """Whether the force is set to zero outside the pulse."""
    exponential: float | None = None
    """T in s of a window e^(−t/T) on force and response."""
