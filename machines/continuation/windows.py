"""Windows over frequency round lines that ask for more than a solution each."""

from __future__ import annotations

import numpy as np

from ..indices import Mask

_MARGIN, _SHARE = 2, 5
"""A window reaches so many lines past what is doubtful, or a fifth of its own width."""


def stretches(bad: Mask) -> list[tuple[int, int]]:
    """First and last line of every window, neither of them doubtful where the range does not end."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], bad, [False]]).astype(int))).reshape(-1, 2)
    out: list[tuple[int, int]] = []
    for a, b in edges.tolist():
        margin = max(_MARGIN, (b - a) // _SHARE)
        i, j = edges_of(bad, a - margin, b - 1 + margin)
        if out and i <= out[-1][1]:
            i, j = out[-1][0], max(j, out.pop()[1])
        out.append((i, j))
    return out


def edges_of(bad: Mask, i: int, j: int) -> tuple[int, int]:
    """First and last line at or beyond these two that are not doubtful, where the range does not end."""
    i, j = max(i, 0), min(j, len(bad) - 1)
    while i > 0 and bad[i]:
        i -= 1
    while j < len(bad) - 1 and bad[j]:
        j += 1
    return i, j
