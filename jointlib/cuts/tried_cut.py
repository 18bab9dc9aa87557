"""A test cut: where it was made, what was judged of it, and the chatter frequency where one was heard."""

from __future__ import annotations

from dataclasses import dataclass, replace

from jointlib.cutting_force.possible import impossible
from jointlib.errors import InputError
from jointlib.measurement import RecordSource

VERDICTS = ("stable", "chatter", "marginal", "unknown")
ON_A_LINE = 0.01
"""Of the tooth frequency: what is no further from one of its harmonics is not told from it."""


@dataclass(frozen=True)
class TriedCut:
    """One cut, SI with the speed in rpm.

    Parameters
    ----------
    speed, depth
        Spindle speed in rpm and depth of the edge in the cut in m.
    teeth
        That cut in a revolution; 1 in turning.
    mode, immersion, feed
        As in ``[cutting]`` of a machine; None where the machine's holds.
    verdict
        One of `VERDICTS`; None where its record has to tell.
    chatter_frequency
        Hz, None where none was heard.
    record
        Sound, acceleration or force of the cut, None where there is none.
    diameter
        m of the cutter, None where the file does not say it.
    process
        ``"milling"`` or ``"turning"``.
    """

    name: str
    speed: float
    depth: float
    teeth: int
    mode: str | None = None
    immersion: float | None = None
    feed: float | None = None
    verdict: str | None = None
    chatter_frequency: float | None = None
    record: RecordSource | None = None
    diameter: float | None = None
    process: str = "milling"

    def __post_init__(self) -> None:
        said = []
        if not self.speed > 0:
            said.append(f"speed is {self.speed:g} rpm, expected more than 0")
        if not self.depth > 0:
            told = f"a {self.verdict} verdict at zero depth tells nothing" if self.depth == 0 else "a depth is positive"
            said.append(f"depth is {self.depth:g} m, expected more than 0: {told}")
        said += impossible(
            self.process,
            speed=self.speed,
            depth=self.depth,
            feed=self.feed,
            teeth=self.teeth,
            immersion=self.immersion,
            diameter=self.diameter if self.process == "milling" else None,
        )
        if self.verdict is None and self.record is None:
            said.append(f"verdict is missing, expected {', '.join(VERDICTS)}, or a record (file) that tells it")
        f = self.chatter_frequency
        if f is not None and self.verdict in ("stable", "unknown"):
            said.append(f"chatter_frequency is {f:g} Hz in a cut that is {self.verdict}, expected chatter or marginal")
        if f is not None and not f > 0:
            said.append(f"chatter_frequency is {f:g} Hz, expected more than 0")
        elif f is not None and self.speed > 0:
            order = f / self.tooth_frequency
            if round(order) >= 1 and abs(order - round(order)) < ON_A_LINE:
                said.append(
                    f"chatter_frequency is {f:g} Hz, harmonic {round(order)} of the teeth ({self.tooth_frequency:g} Hz "
                    f"at {self.speed:g} rpm), expected chatter beside them: at them a stable cut vibrates too"
                )
        if said:
            raise InputError(*said)

    @property
    def tooth_frequency(self) -> float:
        """Hz at which teeth pass."""
        return self.teeth * self.speed / 60

    @property
    def kind(self) -> str:
        """``"flip"`` where the chatter stands halfway between harmonics of the teeth, else ``"hopf"``; empty: none."""
        if self.chatter_frequency is None:
            return ""
        half = self.chatter_frequency / self.tooth_frequency - 0.5
        return "flip" if abs(half - round(half)) < ON_A_LINE else "hopf"

    def judged(self, verdict: str, chatter_frequency: float | None) -> TriedCut:
        """The same cut with what its record tells; what the file says goes before."""
        frequency = chatter_frequency if self.chatter_frequency is None else self.chatter_frequency
        told = self.verdict or verdict
        return replace(self, verdict=told, chatter_frequency=frequency if told in ("chatter", "marginal") else None)
