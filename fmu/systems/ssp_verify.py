"""Proof of a system of FMUs before it is handed over: a short run in FMPy against the machine's own equations."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import CheckFailed

from ..loop_step import Loop, natural_frequencies
from ..members.machine_parts import Parts
from ..playback.fresh_process import answer_of
from ..playback.loop_run import LoopRun, jacobi_run
from ..system.conditions import Condition
from ..system.step_limit import operating_range

TOLERANCE = 1e-6
"""Largest difference allowed, relative to the largest value of a signal; the bodies integrate to 1e-10 a step."""
_FAINT = 1e-3
"""Share of the largest signal below which one is held against that share: bodies integrate to 1e-10 of the largest."""
_STEPS = 200
_TIME_LIMIT = 120.0


def verify_ssp(
    path: Path,
    data: bytes,
    parts: Parts,
    loop: Loop,
    largest: float | None,
    fmi: int = 2,
    conditions: Sequence[Condition] = (),
) -> float:
    """Largest relative difference of any motion and force from :func:`.loop_run.jacobi_run`; too large a one fails.

    A smooth push on every port to the outside moves the joint that moves most by up to half its range, conditions
    beside their start values. The step is a quarter of the largest stable one, and resolves the highest natural
    frequency. FMPy hands a force on the system over one step late, and conditions, which are 0 in the first. FMPy also
    holds the document against the schema of SSP 1.0; as it runs no system of FMUs of FMI 3.0, a master of our own steps
    these in it, in the same order.
    """
    fastest = float(np.max(natural_frequencies(loop)))
    step = min(largest / 4 if largest else np.inf, 1 / (50 * fastest) if fastest else 1e-4)
    joints = [joint for _, joint in parts.joints]
    apart = {c.kind: c.elsewhere for c in conditions}
    push = _push(parts, loop, step, apart)
    late = np.concatenate([np.zeros_like(push[:1]), push[:-1]])
    at = [dict.fromkeys(apart, 0.0), *[apart] * (_STEPS - 1)]
    start = {c.kind: c.start for c in conditions}
    expected = _columns(parts, jacobi_run(loop, joints, parts.outside_rows, late, step, at, start))
    inputs = {f"force_{name}": push[:, i].tolist() for i, name in enumerate(parts.outside)}
    inputs |= {c.name: [c.elsewhere] * _STEPS for c in conditions}
    found = _run(path, data, {"fmi": fmi, "step": step, "steps": _STEPS, "inputs": inputs})
    worst = 0.0
    for quantity, signals in expected.items():
        # A signal that should be zero, by symmetry, is what the integration of the others leaves of it.
        faint = _FAINT * max(float(np.max(np.abs(values))) for values in signals.values())
        for name, values in signals.items():
            size = max(float(np.max(np.abs(values))), faint, float(np.finfo(float).tiny))
            got = np.array(found.get(name, []))
            difference = float(np.max(np.abs(got - values))) / size if got.shape == values.shape else np.inf
            if not difference <= TOLERANCE:
                raise CheckFailed(
                    f"{path}: {name} in FMPy differs from the machine's equations by {difference:.1e} of its largest "
                    f"{quantity}"
                )
            worst = max(worst, difference)
    return worst


def _push(parts: Parts, loop: Loop, step: float, conditions: Mapping[str, float]) -> Array:
    """Forces (N) on the ports to the outside, step by step, under which every joint stays within its range."""
    joints = [joint for _, joint in parts.joints]
    ranges = np.array([operating_range(joint).amplitude for joint in joints])
    shape = (1 - np.cos(2 * np.pi * np.arange(_STEPS) / _STEPS))[:, None] * np.ones(len(parts.outside))

    def used(size: float) -> float:
        """The largest part of its range that a joint uses, infinite where it runs away."""
        with np.errstate(all="ignore"):
            run = jacobi_run(loop, joints, parts.outside_rows, size * shape, step, [conditions] * _STEPS, conditions)
            part = float(np.max(np.abs(run.relative) / ranges))
        return part if np.isfinite(part) else np.inf

    size = 1.0
    while (part := used(size)) > 1 and size > 1e-30:
        size /= 10
    wanted = size * 0.5 / part if 0 < part <= 1 else size
    # Beyond small motions a joint may yield more than in proportion.
    while wanted > size and used(wanted) > 1:
        wanted /= 2
    return wanted * shape


def _columns(parts: Parts, run: LoopRun) -> dict[str, dict[str, Array]]:
    """The run by quantity and by the names that FMPy gives the connectors."""
    return {
        "displacement": {f"displacement_{name}": run.motion[:, i] for i, name in enumerate(parts.outside)},
        "velocity": {f"velocity_{name}": run.velocity[:, i] for i, name in enumerate(parts.outside)},
        "force": {f"{name}.force_1": -run.force[:, i] for i, (name, _) in enumerate(parts.joints)},
    }


def _run(path: Path, data: bytes, request: dict[str, object]) -> dict[str, list[float]]:
    """The connectors of the archive, step by step, from a fresh process."""
    with tempfile.TemporaryDirectory(prefix="jointlib-") as scratch:
        file = Path(scratch) / "system.ssp"
        file.write_bytes(data)
        named = {**request, "file": str(file)}
        found: dict[str, list[float]] = answer_of(
            "ssp_replay", named, Path(scratch), f"{path}: the system", _TIME_LIMIT
        )
        return found
