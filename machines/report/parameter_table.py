"""The parameters of a joint as a table."""

from __future__ import annotations

import numpy as np

from jointlib.joint import Joint
from jointlib.units import rounded, shown

from .page import Table


def parameter_table(joint: Joint, caption: str) -> Table:
    """Parameters with their standard errors, in the units people read."""
    rows = []
    units = joint.units
    for name, value in joint.parameters.items():
        factor, unit = shown(units[name])
        error = joint.covariance.standard_error(name) if joint.covariance else np.nan
        told, spread = rounded(value * factor, error * factor, 6)
        rows.append((name, told, spread if np.isfinite(error) else "not estimated", unit))
    return Table(("parameter", "value", "standard error", "unit"), rows, caption)
