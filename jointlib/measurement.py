"""One test and its records: what was measured, on which bodies, in which units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from jointlib.arrays import Array
from jointlib.cutting_force.cut import Cut
from jointlib.errors import InputError, nearest
from jointlib.estimation.settings import EXCITED, Settings
from jointlib.lab.dialect import Told
from jointlib.shown.pictures import axes_of, literal
from jointlib.shown.record_picture import draw_record, draw_sweeps
from jointlib.shown.result import Columns, Shown
from jointlib.shown.tried_cuts import cut_columns, draw_cuts, told_cuts

if TYPE_CHECKING:
    from jointlib.cuts.tried_cut import TriedCut

QUANTITIES = {
    "acceleration": "m/s^2",
    "velocity": "m/s",
    "displacement": "m",
    "position": "m",
    "force": "N",
    "sound": "Pa",
    "voltage": "V",
    "current": "A",
    "temperature": "K",
    "time": "s",
}
"""What a channel can measure, and the SI unit it is converted to."""

MOTIONS = ("acceleration", "velocity", "displacement")
"""What a response to a force can be measured as."""
FORCES = "cutting-force"
"""Kind of a measurement by a dynamometer while cutting."""
CUTS = "cuts"
"""Kind of a measurement of test cuts."""
RINGDOWN = "ringdown"
"""Kind of a measurement of free decays."""
KINDS = ("rig", "path", "static", "frf", *EXCITED, FORCES, CUTS, RINGDOWN)
ROLES = ("fit", "sealed", "quiet")


@dataclass(frozen=True)
class Mass:
    """Mass of a body in kg with its standard uncertainty; ``value`` is None where it is to be identified."""

    value: float | None
    uncertainty: float = 0.0
    stiffness: float = 0.0
    """N/m and, below, N s/m by which a suspension holds the body of a rig to ground."""
    damping: float = 0.0


@dataclass(frozen=True)
class Channel:
    """One column of the record files; value in ``si_unit`` = factor · column."""

    name: str
    quantity: str
    unit: str
    si_unit: str
    factor: float
    body: str | None = None
    full_scale: float | None = None
    """Largest value the sensor shows, in ``si_unit``; makes clipping decidable."""
    remove_mean: bool = False
    is_input: bool = False
    """A control voltage, a current or a temperature that may modulate parameters."""
    column: str | None = None
    """Heading in the record files; None where that is the name."""
    label: str | None = None
    """Name in the measurement file; None where that is the name here, which is the role where the channel has one."""
    offset: float = 0.0
    """Value in ``si_unit`` = factor · column + offset; 0 but for temperatures."""
    dof: str | None = None
    """Impact and shaker: degree of freedom that it measures, along its positive direction."""
    transfer: Path | None = None
    """Cutting forces: file of the FRF of the dynamometer, measured force over force."""

    def at_full_scale(self, x: Array) -> int:
        """How many samples stand at the end of its range, within a thousandth; none where no range is told."""
        return int(np.count_nonzero(np.abs(x) >= 0.999 * self.full_scale)) if self.full_scale else 0


@dataclass(frozen=True)
class Correction:
    """A fault of rig or sensor found earlier, undone on reading."""

    family: str
    channel: str | None
    body: str | None
    parameters: Mapping[str, float]
    """SI."""
    record: str | None = None
    """Name of the one record (or record file) that has the fault; None where all have it."""

    @property
    def site(self) -> str:
        """The channel or body; empty where the fault belongs to the rig as a whole."""
        return self.channel or self.body or ""

    def concerns(self, record: RecordSource) -> bool:
        """True if a record has the fault."""
        return self.record in (None, record.name, record.file.name)


@dataclass(frozen=True)
class Sweep:
    """Kind ``frf``: where a harmonic force acted, where the motion was measured, and which of the two was held."""

    drive: str
    """Degree of freedom of the machine that the force acts on."""
    response: str
    """Degree of freedom whose motion over force the file holds."""
    force: float
    """N, peak; 0 where the response was held."""
    quantity: str | None = None
    """receptance, mobility or accelerance; None where the file says it."""
    unit: str | None = None
    """Of the values in the file; None means SI, or what the file says."""
    response_at: str | None = None
    drive_at: str | None = None
    """Node and direction in a universal file that holds several."""
    conjugate: bool = False
    """True where the file counts time as exp(−jωt)."""
    amplitude: float = 0.0
    """m, peak of the response, where its displacement was held."""
    acceleration: float = 0.0
    """m/s², peak of the response, where its acceleration was held."""

    @property
    def level(self) -> str:
        """What was held, in words."""
        held = ((self.amplitude, "m"), (self.acceleration, "m/s²"), (self.force, "N"))
        return next(f"{value:g} {unit}" for value, unit in held if value or unit == "N")


@dataclass(frozen=True)
class RecordSource:
    """Where a record lies; nothing is read from it before it is asked for, so that a sealed record stays sealed."""

    file: Path
    role: str
    rows: tuple[int, int] | None = None
    condition: str | None = None
    start: float | None = None
    period: int | None = None
    sample_rate: float | None = None
    sweep: Sweep | None = None
    """Kind ``frf`` only."""
    drive: str | None = None
    """Impact and shaker: where the force acts in this record; None: at the degree of freedom of its channel."""
    cut: Cut | None = None
    """Cutting forces: what the tool does in this record; None of one that is quiet."""
    group: str | None = None
    """The group of the file that holds the record, where a file has several; its columns are named without it."""

    @property
    def name(self) -> str:
        """File name, with its group or rows where only a part is used, or its places in a universal file of several."""
        if self.sweep is not None and self.sweep.response_at is not None:
            return f"{self.file.name}[{self.sweep.response_at} from {self.sweep.drive_at}]"
        of_file = self.file.name + (f"[{self.group}]" if self.group else "")
        return of_file + (f"[{self.rows[0]}:{self.rows[1]}]" if self.rows else "")


@dataclass(frozen=True)
class Record:
    """Samples of one record in SI, one array per channel, all of one length."""

    source: RecordSource
    channels: Mapping[str, Array]
    sample_rate: float
    """Hz; 0 for a static test."""
    period: int | None
    """Samples per excitation period; None if not periodic."""
    sha256: str
    ignored: tuple[str, ...] = ()
    """Columns of the file that no channel names."""

    @property
    def name(self) -> str:
        return self.source.name

    def __len__(self) -> int:
        return len(next(iter(self.channels.values())))


@dataclass(frozen=True, repr=False)
class Measurement(Shown):
    """A measurement file as declared; ``jointlib.io.measurement_file.read_records`` opens its records."""

    source: Path
    kind: str
    channels: tuple[Channel, ...]
    records: tuple[RecordSource, ...]
    sample_rate: float | None = None
    period: int | None = None
    settle: int = 0
    """Periods dropped at the start of each record."""
    band: tuple[float, float] | None = None
    """Hz; where the joint equation is used."""
    driven: str | None = None
    """Rig: body 1, which the force drives."""
    bodies: Mapping[str, Mass] = field(default_factory=dict)
    carriage: Mass | None = None
    """Path: the moving mass that rides with the measured displacement; None means it is not part of the force.
    Ringdown: the modal mass at the place where the motion is measured; None where it is not known."""
    corrections: tuple[Correction, ...] = ()
    simulated: bool = False
    """True where the records come from a simulation; said wherever they appear."""
    text: Told = field(default_factory=Told)
    """How text records are written, as far as the file says it."""
    acts_on: str = "tool"
    """Cutting forces: ``"tool"`` or ``"workpiece"``, which of the two feels the force that the channels tell."""
    cuts: tuple[TriedCut, ...] = ()
    """Test cuts; ``records`` are those that they have."""
    estimate: Settings = field(default_factory=Settings)
    """Impact and shaker: how frequency responses are estimated."""

    def channel(self, name: str) -> Channel:
        """The channel of that name."""
        for channel in self.channels:
            if channel.name == name:
                return channel
        raise InputError(f"{self.source}: no channel {name!r}, {nearest(name, [c.name for c in self.channels])}")

    def of(self, quantity: str) -> tuple[Channel, ...]:
        """The channels that measure a quantity, in file order; modulating inputs left out."""
        return tuple(c for c in self.channels if c.quantity == quantity and not c.is_input)

    def with_role(self, role: str) -> tuple[RecordSource, ...]:
        """The records of a role, in file order."""
        return tuple(r for r in self.records if r.role == role)

    def finding(self) -> str:
        """What was measured, in how many records, and which of them are sealed; no record is opened."""
        counts = {role: len(self.with_role(role)) for role in ROLES}
        roles = ", ".join(f"{count} {role}" for role, count in counts.items() if count)
        made = "simulated " if self.simulated else ""
        if self.kind == CUTS:
            return f"{self.source.name} ({made}cuts): {told_cuts(self.cuts)}"
        said = f"{self.source.name} ({made}{self.kind}): {len(self.records)} records ({roles})"
        said += f", channels {', '.join(c.name for c in self.channels)}" if self.channels else ""
        return f"{said} at {self.sample_rate:g} Hz" if self.sample_rate else said

    def columns(self) -> Columns:
        """A row per record as declared, nan where nothing is said; of frequency responses force, place, what moved."""
        if self.kind == CUTS:
            return cut_columns(self.cuts)
        told: dict[str, Any] = {
            "record": ([r.name for r in self.records], ""),
            "role": ([r.role for r in self.records], ""),
            "condition": ([r.condition or "" for r in self.records], ""),
            "start": ([np.nan if r.start is None else r.start for r in self.records], "s"),
            "sample_rate": ([r.sample_rate or self.sample_rate or np.nan for r in self.records], "Hz"),
        }
        sweeps = [r.sweep for r in self.records if r.sweep is not None]
        if len(sweeps) == len(self.records) and sweeps:
            told = {name: told[name] for name in ("record", "role", "condition")}
            told |= {
                "drive": ([s.drive for s in sweeps], ""),
                "response": ([s.response for s in sweeps], ""),
                "force": ([s.force for s in sweeps], "N"),
            }
        return told

    def plot(self, ax: Any = None, record: str | None = None) -> Any:
        """One record (default: the first that is fitted), which is read for it; a sealed one stays sealed.

        Force over displacement in N over µm or mm; of a rig accelerations in m/s² over time in ms; of frequency
        responses all of them (default) in µm/N over Hz.
        """
        from jointlib import read_records

        if self.kind == CUTS:
            axes = axes_of(ax)
            draw_cuts(axes, self.cuts)
            return axes
        allowed = {r.name: r for r in sorted(self.records, key=lambda r: r.role != "fit") if r.role != "sealed"}
        names = [*allowed] if record is None and self.kind == "frf" else [record or next(iter(allowed), "")]
        for name in names:
            if name not in allowed:
                raise InputError(f"{self.source}: no record {name!r} that is not sealed, {nearest(name, allowed)}")
        axes, chosen = axes_of(ax), [allowed[name] for name in names]
        if self.kind == "frf":
            draw_sweeps(axes, self, chosen)
            return axes
        (found,) = read_records(self, chosen)
        draw_record(axes, self, found.channels, found.sample_rate)
        axes.set(title=literal(found.name))
        return axes
