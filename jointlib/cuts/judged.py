"""The cuts of a measurement with what their records tell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.cuts.heard import Heard, heard
from jointlib.cuts.tried_cut import TriedCut
from jointlib.io.measurement_file import read_records
from jointlib.measurement import Measurement


@dataclass(frozen=True)
class JudgedCut:
    """A cut with its verdict, and what its record said; ``heard`` is None without one."""

    cut: TriedCut
    heard: Heard | None = None

    def doubt(self) -> str:
        """Half a sentence where file and record disagree; empty where they do not."""
        if self.heard is None or "unknown" in (self.heard.verdict, self.cut.verdict):
            return ""
        if (self.heard.verdict == "stable") == (self.cut.verdict == "stable"):
            return ""
        share = f"{100 * self.heard.share:.0f} % of the vibration does not repeat with the revolution"
        return f"{self.cut.name}: {self.cut.verdict} by the file, {self.heard.verdict} by its record ({share})"


def judged_cuts(m: Measurement) -> tuple[JudgedCut, ...]:
    """Every cut of a measurement of kind ``cuts``; the loudest channel of a record tells it."""
    found = []
    for cut in m.cuts:
        if cut.record is None:
            found.append(JudgedCut(cut))
            continue
        (record,) = read_records(m, [cut.record])
        told = [
            heard(record.channels[c.name], record.sample_rate, cut.speed, cut.teeth, f"{record.name}: {c.name}")
            for c in m.channels
        ]
        loudest = told[int(np.argmax([one.share for one in told]))]
        found.append(JudgedCut(cut.judged(loudest.verdict, loudest.chatter_frequency), loudest))
    return tuple(found)
