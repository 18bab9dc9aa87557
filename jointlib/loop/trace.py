"""Close the loop on one measurement: the route follows from what was measured."""

from __future__ import annotations

from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.loop.answer.report import TraceReport
from jointlib.measurement import Measurement


def trace(measurement: Measurement, joint: Joint, *, seed: int = 0) -> TraceReport:
    """Say whether the joint model lacks an effect, which one, and what the error is before and after adding it.

    A rig with periodic excitation is judged in the frequency domain, a force along a measured path in the time
    domain, free decays by their frequency and damping over amplitude. Candidates come from the entry points
    ``jointlib.effects`` and compete on held-out error.
    """
    if measurement.kind == "rig":
        from jointlib.loop.periodic.route import trace_periodic

        return trace_periodic(measurement, joint, seed=seed)
    if measurement.kind == "path":
        from jointlib.loop.path import trace_path

        return trace_path(measurement, joint, seed=seed)
    if measurement.kind == "ringdown":
        from jointlib.loop.decay.route import trace_decay

        return trace_decay(measurement, joint, seed=seed)
    raise InputError(
        f"{measurement.source}: kind is {measurement.kind!r}, a trace needs records of motion: 'rig', 'path' or "
        "'ringdown'"
    )
