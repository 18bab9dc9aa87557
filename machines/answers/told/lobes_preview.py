"""A preview of a chart for which the time did not suffice."""

from __future__ import annotations

from typing import Any

import numpy as np

from jointlib.errors import CheckFailed, InputError
from jointlib.shown.progress import Progress

from ...deadline import within

_LONGEST = 20.0
"""Seconds that a preview may take after the time of the command is up."""


def previewed(model: Any, chart: Any, progress: Progress) -> tuple[Any, list[str]]:
    """The chart by zero-order at every speed, where some were left out of one at rest, and told; None where it has no
    such method or takes long.
    """
    from ...cutting.amplitude.frozen_lobes import lobes_at_amplitude

    if not chart.left_out:
        return None, []
    speeds = np.unique([*np.ravel(chart.speed), *chart.left_out])
    try:
        with progress.step("computing a preview at every speed"), within(_LONGEST):
            preview = lobes_at_amplitude(model, speeds, 0.0, "zero-order")
    except (CheckFailed, InputError):
        return None, []
    if not np.isfinite(preview.minimum_depth):
        return preview, []
    return preview, [
        f"By zero-order, a preview, the cut is stable at all {speeds.size} speeds below "
        f"{np.min(preview.depth) * 1e3:.4g} mm."
    ]
