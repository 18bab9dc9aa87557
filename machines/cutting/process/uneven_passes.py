"""Flutes that do not follow one another alike: when each is in the cut, and where on the surface it finds its waves."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from jointlib.arrays import Array

from .chart import Integers
from .cutter import Cutter
from .stretch import FEWEST, FEWEST_WOUND, SAME, Origin, Stretch, sections, stretch

Passage = tuple[list[float], list[tuple[int, int]]]
"""Angles at which a section of a flute enters stretches, ascending, and (stretch, edge in it)."""


def uneven_stretches(
    cutter: Cutter, axes: tuple[str, ...], speed: float, rate: float, depth: float
) -> tuple[Stretch, ...]:
    """One pattern of flutes at a speed in rpm, split where an edge enters or leaves the cut, see `stretches`.

    Flute j at height z stands at φ = θ − ψ_j − κ_j·z. It meets at φ what flute j − 1 left there τ_j(z) earlier, which
    no node of its own falls on, and cuts the share of the feed that the pitch before it is of an even one. No stretch
    is longer than the shortest of these times, so that what is met is there when a stretch begins.
    """
    cutting = cutter.cutting
    turning, entry, leave = 2 * np.pi * speed / 60, cutting.entry_angle, cutting.exit_angle
    lag = np.array([flute.lag for flute in cutter.flutes])
    many = sections(float(np.max(lag)) * depth)
    height = depth * (np.arange(many) + 0.5) / many if np.any(lag) else np.zeros(1)
    later = np.array([flute.place for flute in cutter.flutes])[:, None] + lag[:, None] * height
    behind = np.array([flute.behind + flute.spread * height for flute in cutter.flutes])
    beyond = np.repeat([flute.beyond for flute in cutter.flutes], many if np.any(lag) else 1)
    turns = cutter.pattern * np.arange(round(cutter.patterns))
    offset = -(turns[:, None, None] + later).reshape(-1)
    edge = np.broadcast_to(np.arange(later.size), (len(turns), later.size)).reshape(-1)
    bounds = _bounds((np.array([entry, leave])[:, None] - offset).ravel(), cutter.pattern, float(np.min(behind)))
    found, members = list[Stretch](), list[tuple[Integers, Array]]()
    for first, last in pairwise(bounds):
        middle = (first + last) / 2
        whole = 2 * np.pi * np.floor((middle + offset) / (2 * np.pi))
        cuts = (middle + offset - whole > entry) & (middle + offset - whole < leave)
        count = max(FEWEST if many == 1 else FEWEST_WOUND, int(np.ceil((last - first) / turning * rate)))
        theta = np.linspace(first, last, 2 * count + 1)[:, None] + (offset - whole)[cuts]
        members.append((edge[cuts], theta))
        one = stretch(cutting, axes, theta, (last - first) / turning / count, turning, many)
        share = behind.ravel()[edge[cuts]] * cutting.cuts_per_revolution / (2 * np.pi)
        out = beyond[edge[cuts]]
        found.append(replace(one, feed=one.feed * share, feed_between=one.feed_between * share, beyond=out))
    flutes = len(cutter.flutes)
    before = (np.arange(later.size) - many) % (flutes * many)
    return tuple(replace(one, origin=origin) for one, origin in zip(found, _origins(members, before), strict=True))


def _bounds(angle: Array, pattern: float, longest: float) -> Array:
    """Angles from 0 to a pattern at which stretches begin and end, none of them longer than ``longest``."""
    inner = np.sort(angle % pattern)
    inner = inner[(inner > SAME) & (inner < pattern - SAME) & (np.diff(inner, prepend=0) > SAME)]
    found = [0.0]
    for first, last in pairwise([0.0, *inner, pattern]):
        pieces = int(np.ceil((last - first) / longest))
        found += np.linspace(first, last, pieces + 1)[1:].tolist()
    return np.array(found)


def _origins(members: list[tuple[Integers, Array]], before: Integers) -> list[Origin]:
    """Where each node and middle finds its surface, laid end to end as `Ground` holds it."""
    steps = np.array([len(theta) // 2 for _, theta in members])
    edges = np.array([len(edge) for edge, _ in members])
    nodes_from = np.concatenate([[0], np.cumsum((steps + 1) * edges)])
    middles_from = np.concatenate([[0], np.cumsum(steps * edges)])
    passages = dict[int, Passage]()
    for i, (edge, theta) in enumerate(members):
        for k, e in enumerate(edge.tolist()):
            passages.setdefault(e, ([], []))[0].append(float(theta[0, k]))
            passages[e][1].append((i, k))
    tables = {e: _ascending(*passage) for e, passage in passages.items()}
    found = []
    for edge, theta in members:
        left, right, middle = (np.zeros(theta.shape, dtype=np.int64) for _ in range(3))
        share = np.zeros(theta.shape)
        for k, e in enumerate(edge.tolist()):
            enters, places = tables[int(before[e])]
            at = np.maximum(np.searchsorted(enters, theta[:, k] + SAME, side="right") - 1, 0)
            source, column = places[at].T
            low = enters[at]
            high = np.array([members[i][1][-1, c] for i, c in places.tolist()])[at]
            cell = np.clip((theta[:, k] - low) / (high - low) * steps[source], 0, steps[source] * (1 - 1e-12))
            whole = np.floor(cell).astype(np.int64)
            left[:, k] = nodes_from[source] + whole * edges[source] + column
            right[:, k] = left[:, k] + edges[source]
            middle[:, k] = middles_from[source] + whole * edges[source] + column
            share[:, k] = cell - whole
        found.append(Origin(left, right, middle, share))
    return found


def _ascending(enters: list[float], places: list[tuple[int, int]]) -> tuple[Array, Integers]:
    order = np.argsort(enters)
    return np.array(enters)[order], np.array(places)[order]
