"""A record as it was measured: the static curve, the loop along a path, accelerations over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from jointlib.arrays import Array
from jointlib.shown.pictures import draw_magnitude, literal, name_curves

if TYPE_CHECKING:
    from jointlib.measurement import Measurement, RecordSource

_SAMPLES = 4000


def draw_record(axes: Any, measurement: Measurement, channels: Mapping[str, Array], sample_rate: float) -> None:
    """Force over displacement of a static test (µm) or a path (mm); of a rig its first samples over time in ms."""
    force = measurement.of("force")
    moved = measurement.of("displacement") or measurement.of("position")
    if measurement.kind != "rig" and force and moved:
        factor, unit = (1e6, "µm") if measurement.kind == "static" else (1e3, "mm")
        x, y = channels[moved[0].name] * factor, channels[force[0].name]
        axes.plot(x, y, ".", markersize=3)
        shown = unit if moved[0].si_unit == "m" else moved[0].si_unit
        axes.set(xlabel=f"{literal(moved[0].name)} [{shown}]", ylabel=f"{literal(force[0].name)} [{force[0].si_unit}]")
        return
    quantity = next((q for q in ("acceleration", "force", "position", "displacement") if measurement.of(q)), None)
    drawn = measurement.of(quantity) if quantity else measurement.channels
    for channel in drawn:
        values = channels[channel.name][:_SAMPLES]
        axes.plot(1e3 * np.arange(len(values)) / sample_rate, values, label=literal(channel.name))
    axes.set(xlabel="time [ms]", ylabel=f"{quantity or 'channel'} [{drawn[0].si_unit.replace('^2', '²')}]")
    name_curves(axes)


def draw_sweeps(axes: Any, measurement: Measurement, sources: Sequence[RecordSource]) -> None:
    """Measured frequency responses as the size of a receptance in µm/N over frequency in Hz."""
    from jointlib.io.frf_files import read_frf

    for source in sources:
        sweep = source.sweep
        if sweep is None:
            continue
        found = read_frf(
            source.file,
            where=f"{measurement.source}: record {source.name}",
            response_at=sweep.response_at,
            drive_at=sweep.drive_at,
            quantity=sweep.quantity,
            unit=sweep.unit,
            told=measurement.text,
        )
        if found.quantity is not None and found.value.ndim == 1:
            f = found.frequency[found.frequency > 0]
            H = found.value[found.frequency > 0] / found.quantity.per_receptance(f)
            label = literal(f"{sweep.response} per force on {sweep.drive}, {sweep.level}")
            draw_magnitude(axes, f, H, label=label)
    axes.set(xlabel="frequency [Hz]", ylabel="|x/F| [µm/N]")
    name_curves(axes)
