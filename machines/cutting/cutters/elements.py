"""One pattern of a cutter, cut into elements: where forces act, and which motions they look back at.

Between two angles at which an edge enters or leaves the cut everything is smooth. Each such element in which something
cuts has Chebyshev nodes; what a flute left a pitch earlier is the polynomial through the nodes of the element in which
it was left. With helix an edge enters over the angle κ·b that the depth takes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from jointlib.arrays import Array

from ...indices import Index
from ..loops.collocation import chebyshev
from ..process.cutter import Cutter, Flute

_SAME = 1e-9
"""rad; edges no further apart are one."""
_HIT = 1e-13


@dataclass(frozen=True, eq=False)
class Element:
    """A stretch of the pattern, ``start`` to ``end`` in rad of tool angle, and the flutes that cut in it.

    ``flutes`` holds each with the angle in rad that its tip is behind the tool's.
    """

    start: float
    end: float
    flutes: tuple[tuple[Flute, float], ...]


def elements(cutter: Cutter, depth: float) -> tuple[Element, ...]:
    """Of one pattern from tool angle 0, at a depth in m; those in which nothing cuts have no flutes."""
    first, last = cutter.arc
    if cutter.cutting.process != "milling":
        return (Element(0.0, cutter.pattern, ((cutter.flutes[0], 0.0),)),)
    edges = [
        (flute.place + edge + lag) % cutter.pattern
        for flute in cutter.flutes
        for edge in (first, last)
        for lag in (0.0, flute.lag * depth)
    ]
    if not cutter.twisted:
        edges += [(edge + flute.behind) % cutter.pattern for flute in cutter.flutes for edge in edges]
    ends = np.unique(np.concatenate([[0.0, cutter.pattern], edges]))
    ends = ends[np.append(np.diff(ends) > _SAME, True)]
    ends[-1] = cutter.pattern
    if ends[0] > 0 or len(ends) < 2:
        ends = np.concatenate([[0.0], ends[ends > _SAME]])
    found = []
    for start, end in zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True):
        middle, held = (start + end) / 2, []
        for flute in cutter.flutes:
            turned = (middle - flute.place - first) % cutter.pattern
            while turned < last - first + flute.lag * depth:
                held.append((flute, middle - first - turned))
                turned += cutter.pattern
        found.append(Element(start, end, tuple(held)))
    return tuple(found)


@dataclass(frozen=True, eq=False)
class Acts:
    """The cut in one element, N/m² of depth: by motions at its own and earlier nodes, and at those of the pattern
    before, each by the first output of the element looked at, (count, axes, outputs, axes); and what rubs per C/v.
    """

    own: dict[int, Array]
    before: dict[int, Array]
    rubs: Array

    def of(self, held: dict[int, Array], first: int, count: int) -> Array:
        """The part of an element with so many nodes beyond its ``first`` output."""
        if first not in held:
            rows, n = self.rubs.shape[:2]
            held[first] = np.zeros((rows, n, count + 1, n))
        return held[first]


@dataclass(frozen=True, eq=False)
class Nodes:
    """Nodes of the elements in which something cuts.

    ``places`` (rad, (outputs,)) are where motions are told, ``acting`` which of them are where forces act: all but the
    first ones after a free flight. ``spans`` has for every element its start, end, first output and count of nodes
    beyond the first; None for a free flight in its place.
    """

    cutter: Cutter
    parts: tuple[Element, ...]
    counts: tuple[int, ...]
    places: Array
    acting: Index
    spans: tuple[tuple[float, float, int, int] | None, ...]

    @classmethod
    def of(cls, cutter: Cutter, parts: tuple[Element, ...], counts: tuple[int, ...]) -> Nodes:
        """With so many nodes an element beside its first one."""
        places, acting, spans = list[Array](), list[Index](), list[tuple[float, float, int, int] | None]()
        held, joined = 0, False
        for part, count in zip(parts, counts, strict=True):
            if not part.flutes:
                spans.append(None)
                joined = False
                continue
            x, _, _ = chebyshev(count)
            angle = part.start + (part.end - part.start) * (x + 1) / 2
            angle[-1] = part.end
            if not joined:
                places.append(angle[:1])
                held += 1
            places.append(angle[1:])
            spans.append((part.start, part.end, held - 1, count))
            acting.append(np.arange(held, held + count))
            held += count
            joined = True
        whole = np.concatenate(places) if places else np.zeros(0)
        return cls(cutter, parts, counts, whole, np.concatenate(acting) if acting else np.zeros(0, int), tuple(spans))

    def forces(self, depth: float, axes: list[int]) -> tuple[Array, Array, Array]:
        """Matrices of the cut in N/m² of depth: by own motions at the places of this pattern, by those of the one
        before, (acting·axes, outputs·axes) each, and what rubs per C/v, (acting, axes, axes).

        The force on the tool is −depth·(own·q − before·q_before) − depth·(C/v)·rubs·q̇.
        """
        n, many = len(axes), len(self.places)
        own = np.zeros((len(self.acting), n, many, n))
        before, rubs, row = np.zeros_like(own), np.zeros((len(self.acting), n, n)), 0
        for acts in self.acts(depth, axes):
            rows = slice(row, row + len(acts.rubs))
            row = rows.stop
            rubs[rows] = acts.rubs
            for whole, blocks in ((own, acts.own), (before, acts.before)):
                for first, block in blocks.items():
                    whole[rows, :, first : first + block.shape[2]] += block
        shape = (len(self.acting) * n, many * n)
        return own.reshape(shape), before.reshape(shape), rubs

    def acts(self, depth: float, axes: list[int]) -> Iterator[Acts]:
        """The `forces` of one element in which something cuts after the other."""
        n = len(axes)
        for part, span in zip(self.parts, self.spans, strict=True):
            if span is None:
                continue
            _, _, first, count = span
            rows, columns = np.arange(count), np.arange(first + 1, first + 1 + count)
            acts = Acts({}, {}, np.zeros((count, n, n)))
            angle = self.places[columns]
            for flute, behind in part.flutes:
                phi, height, share = self.cutter.sections(flute, angle - behind, depth)
                H, N = (m[..., axes, :][..., axes] for m in self.cutter.matrices(phi))
                here = acts.of(acts.own, first, count)
                here[rows, :, rows + 1] += np.einsum("ks,ksab->kab", share, H)
                acts.rubs[:] += np.einsum("ks,ksab->kab", share, N)
                if flute.spread:
                    late = angle[:, None] - flute.behind - flute.spread * height
                    pushed = share[..., None, None] * H
                else:
                    late = (angle - flute.behind)[:, None]
                    pushed = np.einsum("ks,ksab->kab", share, H)[:, None]
                self._looked(late, pushed, acts)
            yield acts

    @cached_property
    def _starts(self) -> Array:
        return np.array([part.start for part in self.parts])

    def _looked(self, late: Array, pushed: Array, acts: Acts) -> None:
        """Put what acts by motions at angles ``late`` (nodes, sections) in its place; they lie in the pattern before
        where they are negative.
        """
        earlier = late < (-_SAME if self.spans[-1] is None else _SAME)
        place = np.where(earlier, late + self.cutter.pattern, late)
        starts = self._starts
        which = np.clip(np.searchsorted(starts, place + _SAME, side="right") - 1, 0, len(starts) - 1)
        for e in np.unique(which).tolist():
            k, s = np.nonzero(which == e)
            span = self.spans[e]
            if span is None:  # on the edge of an element, but for rounding
                span = self._beside(float(place[k[0], s[0]]))
            start, end, first, count = span
            weight = _through(count, 2 * (place[k, s] - start) / (end - start) - 1)
            by = np.einsum("iab,ik->iakb", pushed[k, s], weight)
            for held, sign, some in ((acts.before, 1.0, earlier[k, s]), (acts.own, -1.0, ~earlier[k, s])):
                if np.any(some):
                    np.add.at(acts.of(held, first, count), k[some], sign * by[some])

    def _beside(self, place: float) -> tuple[float, float, int, int]:
        """The element in which something cuts that begins or ends nearest to an angle."""
        held = [span for span in self.spans if span is not None]
        return min(held, key=lambda span: min(abs(place - span[0]), abs(place - span[1])))


@lru_cache(maxsize=64)
def _barycentric(count: int) -> Array:
    weight = (-1.0) ** np.arange(count + 1)
    weight[[0, -1]] /= 2
    return np.asarray(weight)


def _through(count: int, x: Array) -> Array:
    """Weights on Chebyshev nodes x_0 … x_n of the polynomial through them, at every x, (x, nodes)."""
    nodes, _, _ = chebyshev(count)
    gap = x[:, None] - nodes
    hit = np.abs(gap) < _HIT
    share = _barycentric(count) / np.where(hit, 1.0, gap)
    share = np.where(np.any(hit, axis=1, keepdims=True), hit.astype(float), share)
    return np.asarray(share / np.sum(share, axis=1, keepdims=True))
