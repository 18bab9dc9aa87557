"""Blocks of hammer hits: those that are clean, windowed, and a sentence on every other one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.estimation.blocks import Spectra, motions_of, spectra_of
from jointlib.estimation.hits import Hit, common_length, find_hits
from jointlib.estimation.noise import shared
from jointlib.estimation.overload import full_scales, overloaded
from jointlib.measurement import Measurement, Record

_BEFORE = 0.05
"""Share of a block that lies before the hit, if nothing is said."""
_LONGEST_BEFORE = 0.02
"""s, and at most that."""
_SILENT = 1.5
_STILL = 0.01
_RESTLESS = 5.0
_TAIL = 0.05
_DIED = 0.01
_LOUD = 0.2
_UNLIKE = 1e-4
"""|ρ|² below which lines count as erring each for itself."""
_SHORT = 64
"""Samples that a block has at least."""


@dataclass(frozen=True, eq=False)
class Hits:
    """The clean hits of records with one place of the force."""

    spectra: Spectra
    left_out: tuple[str, ...]
    notes: tuple[str, ...]
    shift: float = 0.0
    """σ in 1/s: the spectra are Laplace transforms on s = jω + σ, as an exponential window of 1/σ makes them."""
    pulses: Array = field(default_factory=lambda: np.zeros((0, 0)))
    """The force of every block in N, from the first sample of any pulse to the last."""
    at: Array = field(default_factory=lambda: np.zeros(0))
    """s, times of those samples in the blocks."""
    length: float = np.inf
    """s, of the blocks."""
    step: float = 0.0
    """s between samples."""
    unfinished: tuple[bool, ...] = ()
    """Of every motion channel whether it is cut off before it has died out."""


@dataclass
class _Block:
    name: str
    force: Array
    motions: list[Array]
    before: int
    hit: Hit
    rest: list[float] = field(default_factory=list)
    """Motion before the hit over the largest after it, by channel."""


def hits_of(m: Measurement, records: Sequence[Record]) -> Hits:
    """Clean hits of records in which the force acts at one place, as spectra of blocks of one length."""
    rate, settings = records[0].sample_rate, m.estimate
    (hammer,) = m.of("force")
    found = [find_hits(r.channels[hammer.name], rate, settings.length) for r in records]
    if not any(found):
        raise InputError(f"{m.source}: channel {hammer.name} shows no hit, expected pulses of force")
    before = _before(m, found, records)
    if settings.length is not None:
        length = round(settings.length * rate)
    else:
        kept = [[hit for hit in hits if hit.start + _SHORT < len(r)] for hits, r in zip(found, records, strict=True)]
        length = common_length(kept, [len(r) for r in records], before)
    if length < max(_SHORT, 2 * before):
        raise InputError(
            f"{m.source}: blocks of {length} samples between the hits, expected at least {max(_SHORT, 2 * before)}; "
            "hit less often, or say length in [estimate]"
        )
    left_out: list[str] = []
    blocks = list(_clean(m, records, found, before, length, left_out))
    blocks = _after_rest(blocks, left_out)
    if not blocks:
        raise InputError(f"{m.source}: no clean hit: " + "; ".join(said.rstrip(".") for said in left_out))
    window, shift = 1.0 + np.zeros(length), 0.0
    if settings.exponential is not None:
        shift = 1 / settings.exponential
        window = np.exp(-shift * np.arange(length) / rate)
    notes = [] if settings.length else [f"blocks of {length / rate:.4g} s, as the hits leave room for."]
    force = [_pulse(b) if settings.force_window else b.force for b in blocks]
    spectra = spectra_of(force, [b.motions for b in blocks], rate, window)
    unfinished = _unfinished(m, blocks, window, notes)
    left = [window * _left(b) if settings.force_window else window for b in blocks]
    alike = np.mean([shared(one) for one in left], axis=0)
    spectra = replace(
        spectra,
        force_alike=_cropped(alike),
        motion_alike=_cropped(shared(window)),
        raised=_raised(window, blocks[0].before)[1 : len(spectra.frequency) + 1],
    )
    pulses = np.array([_pulse(b) for b in blocks])
    some = np.flatnonzero(np.any(pulses, axis=0))
    part = slice(some[0], some[-1] + 1)
    at = np.arange(length)[part] / rate
    return Hits(spectra, tuple(left_out), tuple(notes), shift, pulses[:, part], at, length / rate, 1 / rate, unfinished)


def _before(m: Measurement, found: Sequence[Sequence[Hit]], records: Sequence[Record]) -> int:
    """Samples of a block before the hit."""
    rate, settings = records[0].sample_rate, m.estimate
    if settings.before is not None:
        return max(1, round(settings.before * rate))
    first = min((hits[0].start for hits in found if hits), default=0)
    room = round(min(_LONGEST_BEFORE, _BEFORE * (settings.length or _LONGEST_BEFORE / _BEFORE)) * rate)
    return max(1, min(room, first))


def _clean(
    m: Measurement,
    records: Sequence[Record],
    found: Sequence[Sequence[Hit]],
    before: int,
    length: int,
    left_out: list[str],
) -> Iterator[_Block]:
    (hammer,), sensors = m.of("force"), motions_of(m)
    for record, hits in zip(records, found, strict=True):
        rate = record.sample_rate
        ends = full_scales(record, (hammer, *sensors))
        for number, hit in enumerate(hits, 1):
            at = f"{record.name}: hit {number} at {hit.start / rate:.4g} s"
            first = hit.start - before
            if first < 0 or first + length > len(record):
                left_out.append(f"{at} is too close to {'the beginning' if first < 0 else 'the end'} of the record.")
                continue
            if number < len(hits) and hits[number].start < first + length:
                left_out.append(f"{at} is followed by another after {(hits[number].start - hit.start) / rate:.3g} s.")
                continue
            part = slice(first, first + length)
            raw = record.channels[hammer.name][part]
            if hit.second:
                left_out.append(f"{at} is a double hit: a second lobe of {hit.second:.0%} of the first.")
                continue
            if over := overloaded(record, ends, part):
                left_out.append(f"{at} is {over}")
                continue
            motions, rest, silent = [], [], []
            for sensor in sensors:
                x = record.channels[sensor.name][part]
                x = x - np.mean(x[:before])
                quiet, moved = (float(np.sqrt(np.mean(part_of**2))) for part_of in (x[:before], x[before:]))
                silent.append(not moved > _SILENT * quiet)
                rest.append(quiet / max(float(np.max(np.abs(x))), 1e-300))
                motions.append(x)
            if all(silent):
                left_out.append(f"{at} has no response: what moves after it is not more than before it.")
                continue
            yield _Block(at, raw - np.mean(raw[:before]), motions, before, hit, rest)


def _after_rest(blocks: list[_Block], left_out: list[str]) -> list[_Block]:
    """Hits that came when the motion of the last one had died out, as far as noise lets it be seen."""
    if not blocks:
        return blocks
    least = np.min([b.rest for b in blocks], axis=0)
    out = []
    for block in blocks:
        share = np.array(block.rest)
        if np.any((share > _STILL) & (share > _RESTLESS * least)):
            left_out.append(
                f"{block.name} came before the last motion had died out: {np.max(share):.0%} of the peak before it."
            )
        else:
            out.append(block)
    return out


def _left(block: _Block) -> Array:
    """The force window: 1 over the pulse and a width of it on either side, then a cosine of a width, and 0 beyond."""
    start, width = block.before, max(block.hit.end - block.hit.start, 4)
    t = np.arange(len(block.force), dtype=float)
    beyond = np.maximum(start - width - t, t - (start + 2 * width)) / width
    return np.asarray(np.where(beyond <= 0, 1.0, np.where(beyond < 1, 0.5 + 0.5 * np.cos(np.pi * beyond), 0)))


def _pulse(block: _Block) -> Array:
    """The force with everything but the pulse at zero."""
    return block.force * _left(block)


def _raised(window: Array, before: int) -> Array:
    """1 + |W(ω)|²/(b·Σ w²) at the lines from 0 on: white noise under a window w, less its mean over b samples before.

    Without a window an offset stands at 0 Hz alone; under an exponential one it reaches into the first lines.
    """
    return np.asarray(1 + np.abs(np.fft.rfft(window)) ** 2 / (before * np.sum(window**2)))


def _cropped(alike: Array) -> Array:
    """Without the distances beyond the last at which lines err together."""
    return alike[: int(np.flatnonzero(alike > _UNLIKE)[-1]) + 1]


def _unfinished(m: Measurement, blocks: Sequence[_Block], window: Array, notes: list[str]) -> tuple[bool, ...]:
    """Of every motion whether it is still there at the end of the blocks, which leaks into other lines."""
    out = []
    for k, sensor in enumerate(motions_of(m)):
        x = np.array([b.motions[k] for b in blocks]) * window
        last = float(np.sqrt(np.mean(x[:, -max(8, round(_TAIL * x.shape[1])) :] ** 2)))
        noise = float(np.sqrt(np.mean(x[:, : blocks[0].before] ** 2))) * window[-1]
        left = np.sqrt(2) * last / float(np.mean(np.max(np.abs(x), axis=1)))
        out.append(left > _DIED and last > 2 * noise)
        if left > _LOUD:
            notes.append(
                f"{sensor.name} is still at {left:.0%} of its peak where the blocks end; expected longer blocks, with "
                "more time between the hits."
            )
    return tuple(out)
