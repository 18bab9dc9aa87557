"""Dry friction that turns too slowly with the speed to be dry: damping that saturates, which has no name."""

from __future__ import annotations

import numpy as np

from jointlib.joint import Joint
from jointlib.loop.decay.fitted import Fitted
from jointlib.ringdown.evidence import Evidence

_SMOOTHING = "smoothing_velocity"
_SLOW = 0.1
"""Of the largest speed; dry friction has turned long before."""
_SURE = 2.0
"""Standard errors by which a smoothing velocity lies above that."""


def rounded(evidence: Evidence, before: Joint, found: Fitted) -> float | None:
    """The smoothing velocity of friction that a joint got, over the largest speed; None where it may be dry.

    Below its smoothing velocity friction is a damper, so that its damping does not fall as 1/A down to the smallest
    amplitude. Where other modes move the joint, they round dry friction for the one that is told.
    """
    if not evidence.alone:
        return None
    speed = max(float(np.max(b.amplitude * b.omega)) for b in evidence.backbones)
    known = found.joint.covariance
    for name, value in found.joint.parameters.items():
        if name in before.parameters or not name.endswith(_SMOOTHING) or known is None or name not in known.names:
            continue
        if value - _SURE * known.standard_error(name) > _SLOW * speed:
            return value / speed
    return None
