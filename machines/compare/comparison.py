"""A measured frequency response laid over the predicted one: by resonance, as a whole, and in depth of cut."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from jointlib import read_measurement
from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.frf import FRF
from jointlib.shown.pictures import AFTER, MEASURED, axes_of, draw_magnitude, literal, name_curves
from jointlib.shown.result import Columns, Shown

from ..bundles.bundle import said_by
from ..cutting.amplitude.lobes_over_range import over_the_range
from ..cutting.process.chart import StabilityLobes
from ..cutting.process.cutting import Cutting
from ..cutting.rest.solve import stability_lobes
from ..forced_response.response import response
from ..loop.records import LevelFRF, read_frfs
from ..model.machine import Machine
from ..tool.at_rest import tip_at_rest
from .measured_peaks import Resonance, at_the_peaks, resonances
from .whole_curves import frac, unit_smell

_APART = 0.25
"""Share of its frequency by which two peaks may lie apart and still be called the same."""
_SURE = 2.0
"""Standard errors that a difference must exceed to be told."""
_MOST = 1500
"""Lines of a record on which the machine is computed."""


@dataclass(frozen=True)
class Pair:
    """One resonance in both curves, or in one of them."""

    measured: Resonance | None
    predicted: Resonance | None

    def differences(self) -> dict[str, float]:
        """Predicted over measured less 1, of what differs by more than two standard errors; empty without a partner."""
        if self.measured is None or self.predicted is None:
            return {}
        found = {}
        for name, error in (("frequency", "frequency_error"), ("damping_ratio", "damping_error"),
                            ("compliance", "compliance_error")):  # fmt: skip
            a, b = getattr(self.measured, name), getattr(self.predicted, name)
            if abs(b - a) > _SURE * getattr(self.measured, error):
                found[name] = b / a - 1
        return found


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Shown):
    """One record against the machine at its force, on the lines of the record."""

    record: LevelFRF
    frequency: Array
    predicted: ComplexArray
    """m/N."""
    frac: float
    """Frequency response assurance criterion: 1 where the two curves are alike but for a factor."""
    pairs: tuple[Pair, ...]
    warnings: tuple[str, ...]

    def finding(self) -> str:
        """As `sentence`."""
        return self.sentence()

    def columns(self) -> Columns:
        """A row per resonance: measured, its standard error, predicted; nan where one of the curves lacks it."""
        table: dict[str, tuple[Sequence[float], str]] = {}
        for name, error, unit in (
            ("frequency", "frequency_error", "Hz"),
            ("damping_ratio", "damping_error", ""),
            ("compliance", "compliance_error", "m/N"),
        ):
            for side in ("measured", "predicted"):
                both = [getattr(pair, side) for pair in self.pairs]
                table[f"{side} {name}"] = [np.nan if one is None else getattr(one, name) for one in both], unit
                if side == "measured":
                    table[f"{name} error"] = [np.nan if one is None else getattr(one, error) for one in both], unit
        return table

    def to_xarray(self) -> Any:
        """The predicted receptance on the lines of the record, as an xarray DataArray."""
        H = self.predicted[:, None, None]
        return FRF(self.frequency, H, (self.record.response,), (self.record.drive,)).to_xarray()

    def plot(self, ax: Any = None) -> Any:
        """Measured and predicted size of the receptance in µm/N over frequency in Hz."""
        axes = axes_of(ax)
        force = f"{self.record.force:g} N"
        draw_magnitude(axes, self.record.frequency, self.record.receptance, color=MEASURED, label=f"measured, {force}")
        draw_magnitude(axes, self.frequency, self.predicted, color=AFTER, label=f"predicted, {force}")
        pair = f"{self.record.response} per force on {self.record.drive}"
        axes.set(xlabel="frequency [Hz]", ylabel="|x/F| [µm/N]", title=literal(pair))
        name_curves(axes)
        return axes

    def sentence(self) -> str:
        """The differences at the largest measured resonance, and how alike the curves are as a whole."""
        name = f"{self.record.name} ({self.record.response} for {self.record.force:g} N on {self.record.drive})"
        both = [p for p in self.pairs if p.measured is not None and p.predicted is not None]
        alike = f"FRAC {self.frac:.3f}"
        if not both:
            return f"{name}: no resonance is in both curves, {alike}."
        main = max(both, key=lambda p: p.measured.compliance if p.measured else 0.0)
        assert main.measured is not None
        words = {"frequency": "frequency", "damping_ratio": "damping", "compliance": "compliance"}
        told = [f"{words[key]} {share(value)}" for key, value in main.differences().items()]
        said = f"the prediction is off by {', '.join(told)}" if told else "no difference above the uncertainty"
        text = f"{name}: at the largest resonance, {main.measured.frequency:.5g} Hz, {said}"
        worst = max(both, key=_apart)
        if worst is not main and worst.measured is not None and _apart(worst) > _apart(main):
            size = share(worst.differences()["compliance"])
            text += f"; most at {worst.measured.frequency:.5g} Hz, compliance {size}"
        return f"{text}; {alike}."


def compared(machine: Machine, measurement: Path | str) -> tuple[Comparison, ...]:
    """Every record of a measurement of kind "frf" against the machine at the force of the record."""
    return tuple(_compared(machine, frf) for frf in read_frfs(read_measurement(Path(measurement)), machine))


def _compared(machine: Machine, frf: LevelFRF) -> Comparison:
    lines = frf.frequency[:: -(-len(frf.frequency) // _MOST)]
    result = response(machine, frf.force, lines, frf.drive, outputs=[frf.response])
    predicted = result.frfs[0].receptance[:, 0, 0]
    known = np.isfinite(predicted)
    measured = frf.receptance[:: -(-len(frf.frequency) // _MOST)]
    of_bundles = said_by(machine.joints())  # which hold for the machine, whatever was measured
    unit = unit_smell(measured[known], predicted[known])
    said = [
        *frf.remarks,
        *([f"{frf.name} {unit}"] if unit else []),
        *(f"{frf.name}: {warning}" for warning in result.warnings if warning not in of_bundles),
    ]
    if not known.all():
        said.append(f"{frf.name}: on {int((~known).sum())} lines the machine has no solution inside its valid range.")
    if machine.frequency is not None and (lines[0] > machine.frequency[0] or lines[-1] < machine.frequency[1]):
        low, high = machine.frequency
        said.append(
            f"{frf.name} runs from {lines[0]:.4g} to {lines[-1]:.4g} Hz, the machine file asks for {low:g} to {high:g} "
            "Hz: beyond the record nothing is compared."
        )
    ours = resonances(lines[known], predicted[known])
    theirs = resonances(frf.frequency, frf.receptance, at_the_peaks(frf))
    pairs = paired(theirs, ours)
    return Comparison(frf, lines, predicted, frac(measured[known], predicted[known]), pairs, tuple(said))


def paired(measured: Sequence[Resonance], predicted: Sequence[Resonance]) -> tuple[Pair, ...]:
    """Each measured resonance with the predicted one that is nearest to it and has none nearer, in frequency."""
    pairs, left = [], list(predicted)
    for own in measured:
        near = min(predicted, key=lambda r: abs(np.log(r.frequency / own.frequency)), default=None)
        back = None if near is None else min(measured, key=lambda r: abs(np.log(r.frequency / near.frequency)))
        if near is None or back is not own or abs(near.frequency / own.frequency - 1) > _APART:
            pairs.append(Pair(own, None))
            continue
        left.remove(near)
        pairs.append(Pair(own, near))
    pairs += [Pair(None, other) for other in left]
    return tuple(sorted(pairs, key=lambda p: (p.measured or p.predicted or _NONE).frequency))


def _apart(pair: Pair) -> float:
    """By what factor the compliances differ, as the size of its logarithm."""
    return abs(float(np.log1p(pair.differences().get("compliance", 0.0))))


def share(value: float) -> str:
    """``+12 %``; from twice and below a tenth as ``2.3 times``, without powers of ten."""
    if -0.9 <= value < 1 or not np.isfinite(value):
        return f"{100 * value:+.2g} %"
    return f"{np.format_float_positional(1 + value, precision=2, unique=False, fractional=False, trim='-')} times"


_NONE = Resonance(0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Depths:
    """What the measured tool point does to the lowest stable depth."""

    measured: float
    """m; infinite where nothing chatters inside the band."""
    predicted: float
    measured_frequency: float
    """Hz."""
    predicted_frequency: float
    method: str
    band: tuple[float, float]
    """Hz, of the record: both are searched there alone."""
    replaced: tuple[str, ...]
    """Entries of the tool's receptance that are measured, as ``xx``; the others are those of the machine."""
    speeds: tuple[float, float]
    """rpm; the depths are the lowest between them."""

    def sentence(self) -> str:
        """Both depths and their ratio."""
        entries, (low, high) = ", ".join(self.replaced), self.band
        if not np.isfinite(self.measured) or not np.isfinite(self.predicted):
            told = [f"{1e3 * d:.3g} mm" if np.isfinite(d) else "no limit" for d in (self.measured, self.predicted)]
            return f"Lowest stable depth with {entries} measured: {told[0]}, predicted: {told[1]}, up to {high:.4g} Hz."
        return (
            f"With {entries} of the tool measured the lowest stable depth is {1e3 * self.measured:.3g} mm (chatter at "
            f"{self.measured_frequency:.4g} Hz), predicted {1e3 * self.predicted:.3g} mm "
            f"({self.predicted_frequency:.4g} Hz): the prediction is off by "
            f"{share(self.predicted / self.measured - 1)}, by {self.method} at {self.speeds[0]:g} to "
            f"{self.speeds[1]:g} rpm from {low:.4g} to {high:.4g} Hz."
        )


def depths(machine: Machine, records: Sequence[LevelFRF], speeds: Array) -> Depths | None:
    """Lobes from the measured tool point against the predicted one at rest; None without a cut or such a record.

    ``speeds`` in rpm ascend over the range whose lowest depth is told, also between them.

    Of several forces the smallest counts, since it is nearest to vanishing vibration.
    """
    dofs, axes = machine.tool_dofs, machine.tool_axes
    at_tool = [r for r in records if r.drive in dofs and r.response in dofs]
    if machine.cutting is None or not any(r.drive == r.response for r in at_tool):
        return None
    chosen = {(r.response, r.drive): r for r in sorted(at_tool, key=lambda r: -r.force)}
    low = max(r.frequency[0] for r in chosen.values())
    high = min(r.frequency[-1] for r in chosen.values())
    main = next(r for (output, drive), r in chosen.items() if output == drive)
    lines = main.frequency[(main.frequency >= low) & (main.frequency <= high)]
    ours = tip_at_rest(machine, lines)(lines)
    theirs = ours.copy()
    for (output, drive), record in chosen.items():
        one = FRF(record.frequency, record.receptance[:, None, None], (output,), (drive,))
        theirs[:, dofs.index(output), dofs.index(drive)] = one.on(lines).receptance[:, 0, 0]
    cutting = Cutting(**machine.cutting)
    frfs = [FRF(lines, matrix, dofs, dofs) for matrix in (theirs, ours)]
    method = "multi-frequency" if cutting.process == "milling" else "turning"
    try:
        a, b = (_over(frf, cutting, speeds, method, axes) for frf in frfs)
    except InputError:
        if method == "turning":
            raise
        method = "zero-order"
        a, b = (_over(frf, cutting, speeds, method, axes) for frf in frfs)
    return Depths(
        a.minimum_depth, b.minimum_depth, a.minimum_frequency, b.minimum_frequency, method,
        (float(lines[0]), float(lines[-1])),
        tuple(f"{axes[dofs.index(o)]}{axes[dofs.index(i)]}" for o, i in chosen),
        (float(speeds[0]), float(speeds[-1])),
    )  # fmt: skip


def _over(frf: FRF, cutting: Cutting, speeds: Array, method: str, axes: tuple[str, ...]) -> StabilityLobes:
    """The chart of a record over a range of speeds, with the lowest depth between them."""

    def at(some: Array) -> StabilityLobes:
        return stability_lobes(frf, cutting, some, method, axes=axes)

    chart = at(speeds)
    return chart if chart.branches else over_the_range(chart, at)
