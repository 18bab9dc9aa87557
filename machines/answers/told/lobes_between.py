"""The depth to stay under between the speeds of a chart, by what stands behind it at them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointlib.arrays import Array

from ...cutting.amplitude.amplitude_limits import amplitude_limits
from ...cutting.amplitude.frozen_lobes import lobes_at_amplitude
from ...cutting.amplitude.pocket import Limit, safe_depth
from ...cutting.amplitude.zones import Zones
from ...model.machine import Machine
from ...uncertainty.lobe_bands import lobe_band


def limit_between(
    machine: Machine, amplitudes: Sequence[float], method: str, zones: Zones | None, samples: int | None
) -> Limit:
    """What `safe_limit` has at any speeds: of the charts at ``amplitudes`` (m), of ``zones`` over more of them, and of
    so many ``samples`` at the first amplitude."""

    def limit(speeds: Array) -> Array:
        charts = [lobes_at_amplitude(machine, speeds, A, method) for A in amplitudes]
        parts = [safe_depth(charts)]
        if zones is not None and not any(amplitudes):
            parts.append(amplitude_limits(machine, speeds, zones.amplitude, method, rest=charts[0]).safe)
        if samples:
            parts.append(lobe_band(machine, speeds, amplitudes[0], samples, method=method).quantiles[0])
        return np.asarray(np.fmin.reduce(parts))

    return limit
