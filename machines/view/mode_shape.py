"""A mode shape to look at."""

from __future__ import annotations

from dataclasses import dataclass

from jointlib.arrays import ComplexArray


@dataclass(frozen=True, eq=False)
class Mode:
    """One mode shape of a scene."""

    number: int
    """From 1 on, over all modes of the machine in ascending frequency."""
    frequency: float
    """Hz."""
    damping_ratio: float
    moved: ComplexArray
    """u and ϑ (frames, 6), scaled so that the largest displacement that is drawn is 1 and real."""
    felt: float
    """Peak compliance of the tool in this mode over that in the mode that it feels most; 0 without a tool."""

    @property
    def name(self) -> str:
        return f"{self.number}: {self.frequency:.4g} Hz, damping {100 * self.damping_ratio:.2g} %"

    @property
    def says(self) -> str:
        """A sentence."""
        text = f"Mode {self.number} at {self.frequency:.4g} Hz, damping ratio {100 * self.damping_ratio:.2g} %"
        if self.felt >= 1:
            return f"{text}: the one that the tool feels most."
        return f"{text}; at the tool its peak is {100 * self.felt:.2g} % of the highest." if self.felt else f"{text}."
