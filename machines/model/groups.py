"""Components that connections tie together."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointlib.arrays import Array

from ..indices import Index


def groups(rows: Array, owner: Index, count: int) -> list[list[int]]:
    """Components that rows over their coordinates tie together, directly or in a chain.

    ``owner`` is the component of every column, ``count`` the number of components.
    """
    label = list(range(count))
    for row in rows:
        tied: Sequence[int] = sorted({label[i] for i in owner[row != 0]})
        label = [tied[0] if group in tied else group for group in label]
    return [[i for i in range(count) if label[i] == group] for group in sorted(set(label))]


def unmoved(owner: Index, names: Sequence[str], rows: Array, joints: Array, moved: Array) -> tuple[str, ...]:
    """What tool and drive leave at rest, a sentence each.

    ``rows`` are those of all connections over the dofs of components ``names``, ``joints`` those with a joint, and
    ``moved`` those of tool and drive.
    """
    said = []
    tied = groups(rows, owner, len(names))
    at = set(owner[np.any(moved != 0, axis=0)])
    reached = {i for group in tied if at & set(group) for i in group}
    beside = [name for i, name in enumerate(names) if i not in reached]
    if len(moved) and beside:
        part = "it takes" if len(beside) == 1 else "they take"
        said.append(f"{', '.join(beside)}: joined to nothing that tool or drive moves, so {part} no part.")
    if len(moved) and len(joints) and not reached & set(owner[np.any(joints != 0, axis=0)]):
        said.append("tool: it moves no joint, so its response is linear whatever the amplitude.")
    return tuple(said)
