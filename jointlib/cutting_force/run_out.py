"""Forces of flutes that do not stand out alike: what each of them meets depends on those that came before it.

Flute j stands at φ_j = Ωt − 2πj/N and meets the chip h_j = min over k of (k·c·sin φ + r_j − r_(j−k)), k from 1 to N, as
far as that is above zero (Kline, DeVor 1983; Altintas, Manufacturing Automation, chapter 2). The terms are straight in
s = sin φ and rise with it: a flute that stands back cuts from some s on, and over each part of s one k is least.
"""

from __future__ import annotations

from itertools import combinations, pairwise

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.cutting_force.cut import Cut
from jointlib.cutting_force.tooth_force import along, of_arc


def uneven(cut: Cut, order: Array, offsets: Array) -> ComplexArray:
    """What every coefficient gives to the forces on the tool at orders of the revolution, (orders, 3, 6), where each
    flute stands out by ``offsets`` in m; flute 0 stands at φ = 0 at t = 0."""
    total = np.zeros((len(order), 3, 6), dtype=complex)
    first, last = cut.arc
    for j in range(cut.teeth):
        of_flute = np.zeros_like(total)
        for slope, offset, low, high in _chips(cut.feed, offsets, j):
            rising, falling = (np.arcsin(low), np.arcsin(high)), (np.pi - np.arcsin(high), np.pi - np.arcsin(low))
            for begin, end in (rising, falling):
                inside = max(begin, first), min(end, last)
                if inside[0] < inside[1]:
                    of_flute += of_arc(order, inside, slope, offset)
        total += np.exp(-2j * np.pi * order * j / cut.teeth)[:, None, None] * of_flute
    return np.asarray(along(cut, order) * total)


def by_offset(cut: Cut, order: Array) -> ComplexArray:
    """What a chip that is thicker by 1 m all along gives to the lines by each flute, (orders, 3, flutes, 3): the last
    axis is K_tc, K_nc, K_ac. Right where no chip ends for it."""
    per_flute = along(cut, order) * of_arc(order, cut.arc, 0.0, 1.0)[:, :, :3]
    turned = np.exp(-2j * np.pi * order[:, None] * np.arange(cut.teeth) / cut.teeth)
    return np.asarray(per_flute[:, :, None, :] * turned[:, None, :, None])


def _chips(feed: float, offsets: Array, flute: int) -> list[tuple[float, float, float, float]]:
    """The chip of a flute as pieces (slope, offset, from, to) over s = sin φ from 0 to 1; none where nothing is cut."""
    k = np.arange(1, len(offsets) + 1)
    slope, ahead = k * feed, offsets[flute] - offsets[flute - k]
    begin = max(0.0, float(np.max(-ahead / slope)))
    if begin >= 1:
        return []
    crossings = ((ahead[b] - ahead[a]) / (slope[a] - slope[b]) for a, b in combinations(range(len(k)), 2))
    ends = [begin, *sorted({float(s) for s in crossings if begin < s < 1}), 1.0]
    pieces: list[tuple[float, float, float, float]] = []
    for low, high in pairwise(ends):
        least = int(np.argmin(slope * (low + high) / 2 + ahead))
        here = float(slope[least]), float(ahead[least])
        if pieces and pieces[-1][:2] == here:
            pieces[-1] = (*here, pieces[-1][2], high)
        else:
            pieces.append((*here, low, high))
    return pieces
