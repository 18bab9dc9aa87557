"""A joint and the named faults fitted to the training records, and the columns they can move by."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.joint import Covariance, Joint
from jointlib.loop.answer.refit import bounds_of
from jointlib.loop.balance.bench import Found, Raw, columns_in, observe, parameter_errors, view_of
from jointlib.loop.balance.equations import Observed
from jointlib.loop.balance.excess import localisation
from jointlib.loop.balance.layout import Layout
from jointlib.loop.balance.rig_view import RigView
from jointlib.loop.balance.tangents import tangents
from jointlib.loop.contest.model import Model, least_squares
from jointlib.loop.contest.trial import Trial
from jointlib.modulation import is_fitted, names_of, stepped
from jointlib.parameter import Role, parameters_of

_LINEAR_ROLES = (Role.STIFFNESS, Role.DAMPING, Role.SLIP_FORCE)
_ROUNDS = 8
_SETTLED = 0.02
"""Of its standard error: a smaller step is none."""
_WORTHLESS = 2e-3
"""Of the loss: a step that lowers it by less is the last; steps of one that converges become small much faster."""
_ROUGHLY = 0.03
"""The same while the noise that the joint passes on is still that of another one."""
_DAMPINGS = (0.0, 1e-4, 1e-3, 1e-2, 0.1, 1.0)
"""Of the diagonal of XᵀX, after Levenberg and Marquardt: tried in turn from the one that served last, or one less."""
_FAR = 4.0
"""Times a parameter that cannot be negative: where a threshold is hardly reached, a longer step leads out of sight."""


@dataclass(frozen=True)
class Fitted:
    """A joint at its least squares over some records, the faults undone in them, and what was free."""

    raws: tuple[Raw, ...]
    joint: Joint
    free: tuple[str, ...] = ()
    """Joint parameters that were refitted."""
    followed: tuple[str, ...] = ()
    """Coefficients of modulations of the joint that were refitted."""
    held: tuple[str, ...] = ()
    """Parameters that these records cannot tell from the others, held at their value."""
    found: tuple[Found, ...] = ()
    errors: tuple[Mapping[str, float], ...] = ()
    """Standard errors of the parameters of each fault that is the same in all records."""
    followed_errors: Mapping[str, float] = field(default_factory=dict)
    """Standard errors of the coefficients of modulations."""
    noise: Joint | None = None
    """The joint whose linear part carries the noise of z, where that is not ``joint`` itself."""

    @cached_property
    def records(self) -> tuple[Observed, ...]:
        """The training records with the faults undone."""
        joint = self.noise or self.joint
        return tuple(observe(raw, joint, self.found, i) for i, raw in enumerate(self.raws))

    @cached_property
    def model(self) -> Model:
        """The whitened residual with the columns of everything that is free."""
        records = self.records
        layout = self.layout
        y = layout.row([o.whitened(self.joint) for o in records])
        names = (*self.free, *self.followed)
        slopes = tangents(records, self.joint, names)
        joint = [columns_of(records, [d[None] for d in slopes[n]]) for n in names]
        blocks = [*joint, *(fault_block(self.views, f) for f in self.found)]
        stacked = np.concatenate(blocks) if blocks else np.zeros((0, len(y)))
        return Model(y, stacked, layout.records, sum(int(o.valid.sum()) for o in records), layout)

    @cached_property
    def layout(self) -> Layout:
        return layout_of(self.records)

    @cached_property
    def views(self) -> tuple[RigView, ...]:
        """The training records as faults see them."""
        return tuple(view_of(raw, o) for raw, o in zip(self.raws, self.records, strict=True))

    @cached_property
    def tried(self) -> dict[Hashable, Trial | None]:
        """Trials beside this model by contestant and shape; None where the model can imitate it."""
        return {}

    @cached_property
    def size(self) -> float:
        """Σ|r|² over the training records, without the joint equation where z is but noise."""
        total = 0.0
        for o, r in zip(self.records, self.whitened(), strict=True):
            total += float(np.sum(np.abs(r[:, :2]) ** 2) + np.sum(np.abs(r[o.informative, 2]) ** 2))
        return total

    @cached_property
    def localised(self) -> dict[str, dict[str, Any]]:
        """Where its residuals on the training records exceed their noise."""
        return localisation(self.records, self.whitened())

    def whitened(self) -> list[ComplexArray]:
        """Whitened residuals of each training record."""
        return [o.whitened(self.joint) for o in self.records]

    def on(self, raws: Sequence[Raw]) -> Fitted:
        """The same model on other records; what each record has of its own (a phase, a drift) is fitted to it."""
        records = [observe(raw, self.joint, [f for f in self.found if not f.fault.per_record]) for raw in raws]
        own = [f for f in self.found if f.fault.per_record]
        found = {f.label: f for f in self.found}
        if own:
            blank = Fitted(tuple(raws), self.joint, found=tuple(f for f in self.found if not f.fault.per_record))
            views = [view_of(raw, o) for raw, o in zip(raws, records, strict=True)]
            blocks = [fault_block(views, f) for f in own]
            theta, _ = least_squares(replace(blank.model, columns=np.concatenate(blocks)))
            first = 0
            for f, block in zip(own, blocks, strict=True):
                step = theta[first : first + len(block)].reshape(len(raws), -1)
                first += len(block)
                parameters = tuple(f.fault.correction(np.asarray(c), f.shape) or {} for c in step)
                found[f.label] = replace(f, parameters=parameters, coefficients=tuple(step))
        return replace(self, raws=tuple(raws), found=tuple(found.values()))


def layout_of(records: Sequence[Observed]) -> Layout:
    return Layout(tuple(o.spectra.samples for o in records), tuple(o.on_period for o in records))


def columns_of(records: Sequence[Observed], forces: Sequence[ComplexArray]) -> Array:
    """Joint forces on the lines of each record, (q, lines) each, as whitened real columns (q, n)."""
    return layout_of(records).row([o.whitened_force(F) for o, F in zip(records, forces, strict=True)])


def fault_parts(views: Sequence[RigView], f: Found) -> list[ComplexArray]:
    """Whitened columns of a fault in each record, (q, lines, 3)."""
    parts = [(v.observed, columns_in(v, f)) for v in views]
    return [o.whitened_force(c[..., 2]) if f.fault.on == "joint" else o.whitened_columns(c) for o, c in parts]


def fault_block(views: Sequence[RigView], f: Found) -> Array:
    """Whitened real columns of a fault: (q, n), or (records·q, n) where every record has coefficients of its own."""
    parts, layout = fault_parts(views, f), layout_of([v.observed for v in views])
    if not f.fault.per_record:
        return layout.row(parts)
    q = len(parts[0])
    out = np.zeros((len(parts) * q, layout.records[-1].stop))
    for i, part in enumerate(parts):
        out[i * q : i * q + q, layout.records[i]] = layout.of_record(i, part)
    return out


def free_parameters(joint: Joint) -> tuple[str, ...]:
    """What a refit of a joint may move: not what is declared fixed, nor a threshold or clearance that is off (0)."""
    names = []
    values = joint.parameters
    for part, law in zip(joint.part_names, joint.laws, strict=True):
        for p in parameters_of(law):
            for name in values:
                if name.split("[", 1)[0] != f"{part}.{p.name}" or joint.fixed & {name, f"{part}.{p.name}"}:
                    continue
                if values[name] != 0 or p.table or p.role in _LINEAR_ROLES:
                    names.append(name)
    return tuple(names)


def fit(raws: Sequence[Raw], joint: Joint, wanted: Sequence[str], found: Sequence[Found] = ()) -> Fitted:
    """Refit joint, its modulations and faults together as far as these records can tell them apart; what cannot be
    told is held.

    Gauss–Newton steps of everything at once, damped while they raise the loss; faults are undone exactly each time.
    It ends when a step is a small part of the standard errors.
    """
    here = Fitted(tuple(raws), joint, found=tuple(found), noise=joint)
    fitted = [m for m in raws[0].inputs.active(joint.modulations) if is_fitted(m)]
    told, held = _independent(here.records, joint, [*wanted, *(n for m in fitted for n in names_of(m))])
    free = tuple(n for n in told if n in joint.parameters)
    here = replace(here, free=free, followed=told[len(free) :], held=held)
    if any(o.unseen is not None for o in here.records):
        here = _settled(here, _ROUGHLY)
        here = replace(here, noise=here.joint)
    here = _settled(here, _WORTHLESS)
    return _with_errors(replace(here, noise=None))


def _settled(here: Fitted, worthless: float) -> Fitted:
    """The model at its least squares, the motion it sees and the noise that it carries held.

    A step that lowers the loss by less than the share ``worthless`` is the last.
    """
    level = 0
    for _ in range(_ROUNDS):
        if not len(here.model.columns):
            return here
        theta, covariance = least_squares(here.model)
        if np.all(np.abs(theta) <= _SETTLED * np.sqrt(np.diag(covariance))):
            break
        for damping in _DAMPINGS[max(0, level - 1) :]:
            step = theta if not damping else least_squares(here.model, damping)[0]
            there = _moved(here, step) or here
            if there.size < here.size:
                break
        else:
            break
        level = _DAMPINGS.index(damping)
        gain, here = here.size - there.size, there
        if gain < worthless * here.size:
            break
    return here


def _independent(
    records: Sequence[Observed], joint: Joint, wanted: Sequence[str]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    held: list[str] = []
    blocks: list[Array] = []
    free: list[str] = []
    slopes = tangents(records, joint, wanted)
    for name in wanted:
        block = columns_of(records, [d[None] for d in slopes[name]])
        known = Model(block[0], np.concatenate(blocks) if blocks else np.zeros((0, block.shape[1])), (), 0)
        if known.without(block) is None:
            held.append(name)
        else:
            blocks.append(block)
            free.append(name)
    return tuple(free), tuple(held)


def _moved(here: Fitted, theta: Array) -> Fitted | None:
    """The model after a step of all its coefficients; None where the joint does not exist there."""
    n = len(here.free)
    values = np.array([here.joint.parameters[name] for name in here.free])
    lower, upper = bounds_of(here.joint, here.free)
    signed = (lower >= 0) & (values > 0)
    lower = np.where(signed, np.maximum(lower, values / _FAR), lower)
    upper = np.where(signed, np.minimum(upper, values * _FAR), upper)
    moved = np.clip(values + theta[:n], lower, upper).tolist()
    try:
        joint = here.joint.with_parameters(dict(zip(here.free, moved, strict=True)))
    except InputError:
        return None
    first, found = n + len(here.followed), []
    steps = dict(zip(here.followed, theta[n:first].tolist(), strict=True))
    if steps:
        own = [(m, np.array([steps.get(k, 0.0) for k in names_of(m)])) for m in joint.modulations]
        changed = [stepped(m, step) if np.any(step) else m for m, step in own]
        if any(m is None for m in changed):
            return None
        joint = replace(joint, modulations=tuple(m for m in changed if m is not None))
    for f in here.found:
        sets, q = len(f.coefficients), len(f.coefficients[0])
        step = theta[first : first + sets * q].reshape(sets, q)
        first += sets * q
        further = [f.fault.correction(np.asarray(c), f.shape) for c in step]
        parameters = tuple(
            known if new is None else f.fault.combined(known, new)
            for known, new in zip(f.parameters, further, strict=True)
        )
        coefficients = tuple(c + s for c, s in zip(f.coefficients, step, strict=True))
        found.append(replace(f, parameters=parameters, coefficients=coefficients))
    return replace(here, joint=joint, found=tuple(found))


def _with_errors(here: Fitted) -> Fitted:
    """Standard errors of joint and faults together: what one takes the other cannot.

    A parameter pinned at a bound, or without influence, has no covariance.
    """
    _, covariance = least_squares(here.model)
    n = len(here.free)
    lower, upper = bounds_of(here.joint, here.free)
    values = np.array([here.joint.parameters[name] for name in here.free])
    inside = (values > lower) & (values < upper) & (np.linalg.norm(here.model.columns[:n], axis=1) > 0)
    keep = np.flatnonzero(inside)
    known = Covariance(tuple(here.free[i] for i in keep), covariance[np.ix_(keep, keep)]) if len(keep) else None
    errors, first = [], n + len(here.followed)
    of_followed = np.sqrt(np.diag(covariance)[n:first]).tolist()
    for f in here.found:
        q, sets = len(f.coefficients[0]), len(f.coefficients)
        own = covariance[first : first + q, first : first + q]
        first += q * sets
        errors.append({} if sets > 1 else parameter_errors(f, own))
    return replace(
        here,
        joint=replace(here.joint, covariance=known),
        errors=tuple(errors),
        followed_errors=dict(zip(here.followed, of_followed, strict=True)),
    )
