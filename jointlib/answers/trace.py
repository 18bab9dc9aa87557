"""Close the loop on a measurement of a joint."""

from __future__ import annotations

from jointlib.answers.given import File, joint_of, measurement_of
from jointlib.joint import Joint
from jointlib.loop.answer.report import TraceReport
from jointlib.loop.trace import trace as traced
from jointlib.measurement import Measurement


def trace(measurement: Measurement | File, joint: Joint | File, *, seed: int = 0) -> TraceReport:
    """Say whether the joint model lacks an effect, which one, and what the error is before and after adding it.

    A rig with periodic excitation is judged in the frequency domain, a force along a measured path in the time
    domain. Candidates come from the entry points ``jointlib.effects`` and compete on held-out error. Both arguments
    may be files. `machines.trace` also writes what ``jointlib trace`` writes.
    """
    return traced(measurement_of(measurement), joint_of(joint), seed=seed)
