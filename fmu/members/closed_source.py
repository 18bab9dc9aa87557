"""Tables in C of a structure with its joints closed: its modes, how they are read and driven, and which joints bend."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from jointlib.arrays import Array

from ..system.closed import Closed, Modes, closed, modes
from ..system.step_limit import operating_range
from ..system.system import System
from .native import native_parts

_SMALL = 1e-3
"""Part of its range that a joint's motion always counts as."""

_SIZES = (
    *("JL_POLES", "JL_BASIS", "JL_READS", "JL_BENT", "JL_PORTS", "JL_KEPT"),
    *("JL_STIFF", "JL_BENT_BY_VELOCITY", "JL_TURNS", "JL_HALVED"),
)


@dataclass(frozen=True, eq=False)
class ClosedTables:
    """What the exponential integration reads."""

    of: Closed
    modes: Modes
    reads: Array
    """Displacements of the basis, then their velocities where a law asks for them, over y."""
    pushes: Array
    """Forces of the basis into y', (y, basis)."""
    drive: Array
    """Inputs into y', (inputs, y)."""
    constant: Array
    ports: Array
    """Outputs that are motions of ports, over y."""
    kept: tuple[int, ...]
    """Parameters that are in the modes: while they are as exported, the modes hold."""


@lru_cache(maxsize=4)
def closed_tables(system: System) -> ClosedTables | None:
    """None where the system has to be integrated by explicit steps."""
    of = closed(system)
    found = None if of is None else modes(of)
    if of is None or found is None:
        return None
    basis, motion = list(of.basis), system.C @ found.W
    reads = motion[0::2][basis]
    if of.by_velocity:
        reads = np.concatenate([reads, motion[1::2][basis]])
    ports = len(system.outputs) - 3 * len(system.joints)
    kept: list[int] = []
    for part in native_parts(system):
        linear, viscous = part.kernel.word == "linear", part.kernel.word == "viscous"
        alone = part.joint not in of.bent
        if (alone and (linear or viscous)) or (viscous and part.joint not in of.by_velocity):
            kept += range(*part.parameters)
    return ClosedTables(
        of,
        found,
        reads,
        found.inverse @ system.G[:, basis],
        (found.inverse @ system.B).T,
        found.inverse @ of.constant,
        system.E[:ports] @ found.W,
        tuple(kept),
    )


def closed_sizes(tables: ClosedTables | None) -> dict[str, int]:
    """Sizes for joint_sizes.h; 0 where there are no such tables."""
    sizes = dict.fromkeys(_SIZES, 0)
    if tables is not None:
        of = tables.of
        counts = (len(tables.reads), len(of.bent), len(tables.ports), len(tables.kept))
        told = (of.stiff, bool(of.by_velocity), bool(of.remembering), of.halved)
        sizes |= zip(_SIZES, (len(tables.modes.W), len(of.basis), *counts, *map(int, told)), strict=True)
    return sizes


def closed_text(tables: ClosedTables | None, numbers: Callable[[Array], str], whole: Callable[[list[int]], str]) -> str:
    """The tables; of one entry where there are none."""
    none = np.zeros(1)
    blocks = {
        "jl_pole": none if tables is None else tables.modes.blocks.ravel(),
        "jl_read": none if tables is None else tables.reads.T.ravel(),
        "jl_push": none if tables is None else tables.pushes.T.ravel(),
        "jl_drive": none if tables is None else tables.drive.ravel(),
        "jl_constant": none if tables is None else tables.constant,
        "jl_port": none if tables is None else tables.ports.T.ravel(),
        "jl_opened": none if tables is None else tables.modes.W.ravel(),
        "jl_at_rest": none if tables is None else tables.modes.inverse @ tables.of.system.start,
        "jl_tangent": none if tables is None else _tangents(tables.of),
        "jl_share": none if tables is None else tables.of.spread[tables.of.spread != 0],
    }
    of = None if tables is None else tables.of
    rows = np.zeros((0, 0)) if of is None else of.spread
    lists = {
        "jl_pole_kind": [] if tables is None else [int(kind) for kind in tables.modes.kinds],
        "jl_bent": [] if of is None else list(of.bent),
        "jl_by_velocity": [] if of is None else [int(j in of.by_velocity) for j in of.bent],
        "jl_remembers": [] if of is None else [int(j in of.remembering) for j in of.bent],
        "jl_share_first": [0, *np.cumsum(np.count_nonzero(rows, axis=1)).tolist()],
        "jl_share_column": [int(j) for row in rows for j in np.flatnonzero(row)],
        "jl_kept": [] if tables is None else list(tables.kept),
    }
    texts = [f"const double {name}[] = {{\n{numbers(values)}\n}};" for name, values in blocks.items()]
    texts += [f"const int {name}[] = {{\n{whole(values)}\n}};" for name, values in lists.items()]
    return "\n".join(texts)


def _tangents(of: Closed) -> Array:
    """Of each bent joint: stiffness and damping that its force is told beyond, offset of its displacement, where it
    begins, and the force that always counts as size. No damping where its laws are asked at v = 0."""
    system, moved = of.system, of.system.constants[1][0::2]
    start = (system.C @ system.start)[0::2] + moved
    rows = []
    for j in of.bent:
        small = _SMALL * abs(of.stiffness[j]) * operating_range(system.joints[j][1]).amplitude
        damping = of.damping[j] if j in of.by_velocity else 0.0
        rows.append((of.stiffness[j], damping, moved[j], start[j], small or 1e-6))
    return np.array(rows).ravel() if rows else np.zeros(1)
