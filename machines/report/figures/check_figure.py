"""The picture of the linear check."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ..drawing import AFTER, BEFORE, sheet
from ..page import Figure


def check_figure(frequency: Array, ours: ComplexArray, theirs: ComplexArray) -> Figure:
    """Receptance by coupling and by the state-space model, and their relative difference."""
    with sheet(2, width=10.0, height=3.2) as paper:
        left, right = paper.axes
        left.semilogy(frequency, np.abs(ours) * 1e6, color=AFTER, label="receptance coupling")
        left.semilogy(frequency, np.abs(theirs) * 1e6, ":", color=BEFORE, linewidth=2.2, label="python-control")
        left.set(xlabel="frequency [Hz]", ylabel="|x/F| [µm/N]", title="Joints linearised")
        left.legend()
        difference = np.abs(ours - theirs) / np.max(np.abs(theirs))
        right.semilogy(frequency, np.maximum(difference, 1e-18), color=AFTER)
        right.axhline(1e-8, color=BEFORE, linestyle="--")
        right.set(xlabel="frequency [Hz]", ylabel="difference / largest", title="Difference (limit broken)")
    return Figure(
        paper.svg, "The coupled machine against a state-space model that was built from feedback interconnections."
    )
