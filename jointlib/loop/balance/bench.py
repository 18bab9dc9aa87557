"""The records on the bench: as read, and as they stand once named faults are undone."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.fault import Fault, Setting, Shape
from jointlib.joint import Joint
from jointlib.loop.balance.bodies import Rig
from jointlib.loop.balance.equations import Observed
from jointlib.loop.balance.floor import Floor
from jointlib.loop.balance.inputs import NO_INPUTS, Inputs
from jointlib.loop.balance.rig_view import RigView
from jointlib.loop.balance.spectra import Spectra
from jointlib.loop.balance.unseen import passed_on, unseen_motion

_REMEMBERED = 12


@dataclass(frozen=True)
class Raw:
    """One record as read, its steady part only."""

    spectra: Spectra
    floor: Floor
    rig: Rig
    band: tuple[float, float, float, float]
    first: int = 0
    """Samples of run-in that were dropped before it."""
    feed: Array | None = None
    """Feed position in m, where a channel measures it."""
    inputs: Inputs = NO_INPUTS
    _seen: dict[Hashable, Observed] = field(default_factory=dict, compare=False)
    """The record under recent corrections, so that forces of laws along it are computed once."""

    def under(self, found: Sequence[Found], record: int) -> Observed:
        """The record with faults undone; the joint's share in its noise is not yet known."""
        acting = [f for f in found if f.fault.on != "joint"]
        return self.remembered(self.key(acting, record), lambda: self._bare(acting, record))

    def key(self, found: Sequence[Found], record: int) -> Hashable:
        """What tells the faults undone in this record from others."""
        acting = (f for f in found if f.fault.on != "joint")
        return tuple((f.label, *f.shape.values(), *f.of(record).values()) for f in acting)

    def _bare(self, acting: Sequence[Found], record: int) -> Observed:
        rig = self.rig
        for f in acting:
            if f.fault.on == "body":
                rig = rig.added(f.site, **f.of(record))
        spectra = _undone(self, rig, acting, record)
        bare = Observed(spectra, rig, self.floor, self.band, 0.0, 0.0, inputs=self.inputs)
        if not (bare.kept & bare.on_period).any():
            raise InputError(f"{self.spectra.name}: the relative motion drowns in noise on every line")
        return bare

    def remembered(self, key: Hashable, made: Callable[[], Observed]) -> Observed:
        """What was made for a key, made now if it is new."""
        if key not in self._seen:
            if len(self._seen) > _REMEMBERED:
                self._seen.clear()
            self._seen[key] = made()
        return self._seen[key]


@dataclass(frozen=True)
class Found:
    """A fault that was named, with its coefficients: one set, or one a record where records share no clock."""

    fault: Fault
    site: str
    shape: Shape
    parameters: tuple[Mapping[str, float], ...]
    """What undoing needs, one mapping or one a record."""
    coefficients: tuple[Array, ...]
    """Linear coefficients of the columns, of which a modulation of the joint is made."""

    @property
    def label(self) -> str:
        return label_of(self.fault, self.site)

    def of(self, record: int) -> Mapping[str, float]:
        return self.parameters[record if self.fault.per_record else 0]


def label_of(fault: Fault, site: str) -> str:
    """Family and where it sits: what distinguishes one contestant from another."""
    return f"{fault.family} {site}".strip()


def observe(raw: Raw, joint: Joint, found: Sequence[Found] = (), record: int = 0) -> Observed:
    """A record with faults undone, seen with a joint.

    Its linear part on this motion carries the noise of z, and the joint tells the motion that is not measured.
    """
    bare = raw.under(found, record)

    here = raw.inputs.at(joint)

    def seen_with_joint() -> Observed:
        k, c = bare.linear_part(bare.model_force(here))
        unseen = unseen_motion(bare, here)
        along = bare._forces if unseen is None else {}
        whole = replace(bare, stiffness=k, damping=c, unseen=unseen, _forces=along)
        return replace(whole, passed_on=passed_on(whole, here))

    seen = raw.remembered((raw.key(found, record), here.laws), seen_with_joint)
    modulated = [f for f in found if f.fault.on == "joint"]
    if not modulated:
        return seen
    view = view_of(raw, seen)
    parts = [f.coefficients[record] @ columns_in(view, f)[..., 2] for f in modulated]
    extra: ComplexArray = np.sum(parts, axis=0)
    return replace(seen, extra=extra)


def parameter_errors(f: Found, covariance: Array) -> dict[str, float]:
    """Standard errors of the physical parameters from the covariance of the coefficients; none for shapes."""
    known = f.parameters[0]
    slopes = {n: np.zeros(len(covariance)) for n in known}
    for i, variance in enumerate(np.diag(covariance)):
        h = 0.1 * float(np.sqrt(max(variance, 1e-300)))
        step = f.fault.correction(h * np.eye(len(covariance))[i], f.shape)
        moved = known if step is None else f.fault.combined(known, step)
        for n in known:
            slopes[n][i] = (moved[n] - known[n]) / h
    return {n: float(np.sqrt(s @ covariance @ s)) for n, s in slopes.items() if np.any(s)}


def columns_in(view: RigView, f: Found) -> ComplexArray:
    """Columns of a fault in B, R, J, (q, lines, 3).

    A joint that changes leaves a motion that does not return to its start, and no acceleration tells of a ramp of z
    over the record, nor of the parabola whose acceleration is the mean; what they add to J belongs to it.
    """
    columns = f.fault.columns(view, f.site, f.shape)
    return np.concatenate([columns, view.open_ends]) if f.fault.on == "joint" else columns


def view_of(raw: Raw, observed: Observed) -> RigView:
    """The record as a fault sees it."""
    return RigView(observed, raw.first, raw.feed)


def _undone(raw: Raw, rig: Rig, found: Sequence[Found], record: int) -> Spectra:
    """The channels with every fault of sensors and rig undone, in the order in which they were found."""
    acting = [f for f in found if f.fault.on in ("channel", "rig")]
    if not acting:
        return raw.spectra
    s = raw.spectra
    channels: Mapping[str, Array] = {n: np.fft.irfft(X, s.samples) for n, X in s.channels.items()}
    setting = Setting(s.sample_rate, raw.first, True, rig.masses)
    for f in acting:
        channels = f.fault.undo(channels, f.site, f.of(record), setting)
    return replace(s, channels={n: np.fft.rfft(x) for n, x in channels.items()})
