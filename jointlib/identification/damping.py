"""Viscous damping of a joint from its restoring force."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.identification.estimate import sandwich
from jointlib.identification.force_balance import balance_of
from jointlib.identification.force_samples import RestoringForce
from jointlib.joint import Joint


@dataclass(frozen=True)
class ViscousDamping:
    """Damping in N s/m with its standard error."""

    damping: float
    standard_error: float


def viscous_damping(surface: RestoringForce, elastic: Joint | None = None) -> ViscousDamping:
    """c = Σ f ż / Σ ż² (Dhupia et al. 2008, eq. 15): the joint force projected on the velocity.

    In steady vibration an elastic force does no work over a whole period, so it drops out of the sum; handing it
    over as ``elastic`` takes it out sample by sample and with it most of the error. The sign is that of the restoring
    force: positive damping takes energy out.
    """
    balance = balance_of(surface)
    f = balance.target - (balance.of(elastic) if elastic is not None else 0.0)
    v = balance.rows(surface.v)
    damping = float(f @ v / (v @ v))
    error = sandwich(v[:, None], f - damping * v, balance.groups)[0, 0]
    return ViscousDamping(damping, float(np.sqrt(error)))
