"""What a path trace refuses, each with one sentence."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointlib.effect import JointEffect
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.loop.path.preparation import displacement_channel, force_channel
from jointlib.measurement import Measurement, Record
from jointlib.registry import installed

_FEWEST = 256
"""Samples below which a record is neither filtered nor held out."""


def check_laws(joint: Joint, where: str) -> None:
    """A path is followed in time, so every law must exist there."""
    for part, law in zip(joint.part_names, joint.laws, strict=True):
        if not law.in_time:
            raise InputError(f"{where}: law {part!r} exists in the frequency domain only, a path is traced in time")


def exists_in_time(effect: JointEffect) -> bool:
    """False for an effect whose law exists in the frequency domain only."""
    laws = installed("jointlib.laws").found
    return effect.member not in laws or bool(laws[effect.member].in_time)


def check_records(measurement: Measurement, records: Sequence[Record]) -> None:
    """Records must be long enough, move, and carry a force."""
    displacement, force = displacement_channel(measurement), force_channel(measurement)
    for record in records:
        where = record.source.file
        if len(record) < _FEWEST:
            raise InputError(f"{where}: {len(record)} samples, expected at least {_FEWEST} for a trace")
        if not np.ptp(record.channels[displacement]) > 0:
            raise InputError(f"{where}: the displacement {displacement!r} does not move, expected a path")
        if not np.ptp(record.channels[force]) > 0:
            raise InputError(f"{where}: the force {force!r} never changes, expected a live channel")


def missing_of(measurement: Measurement, records: Sequence[Record]) -> dict[str, str]:
    """What faults may require (see :class:`jointlib.path_fault.PathFault`) and these records do not have, in words."""
    out = {}
    starts = [r.source.start for r in records]
    if len(records) > 1 and not measurement.of("time") and any(s is None for s in starts):
        out["clock"] = "the records share no clock"
    return out
