"""Where on a machine a joint may be wrong: a connection, or several whose rows change together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from jointlib.joint import Joint
from jointlib.law import JointLaw, Motion
from jointlib.parameter import Role, parameters_of

from ...model.joint_places import between_two_nodes
from ...model.machine import Machine

_SHARED = (Role.STIFFNESS, Role.DAMPING, Role.SLIP_FORCE)


@dataclass(frozen=True)
class Place:
    """One connection, all rows of a bundle, or what joins two nodes in deflection and rotation."""

    name: str
    rows: tuple[int, ...]
    """Indices of its connections among `Machine.flexible`."""
    share: tuple[float, ...]
    """Stiffness of each row over that of the stiffest; a law added to the place is shared out like this.

    0 for rotations beside deflections, which have parameters of their own."""
    stiffness: float
    """N/m at rest, of the stiffest row."""

    @property
    def turned(self) -> tuple[int, ...]:
        """Its rows that are rotations beside deflections."""
        return tuple(row for row, share in zip(self.rows, self.share, strict=True) if share == 0)

    def with_joint(self, joints: tuple[Joint, ...], changed: Mapping[int, Joint]) -> tuple[Joint, ...]:
        """All joints of the machine with these rows changed."""
        return tuple(changed.get(i, joint) for i, joint in enumerate(joints))


def places_of(machine: Machine) -> tuple[Place, ...]:
    """The connections that carry a joint, in order.

    Rows that a bundle made count as one place, and so do deflections and rotations between the same two nodes, as
    between shank and holder: a response at the tool sees them together.
    """
    groups: dict[str, list[int]] = {}
    pairs = between_two_nodes(machine.flexible)
    for i, connection in enumerate(machine.flexible):
        bundle = connection.bundle.partition(" (")[0]
        own = bundle and connection.name.startswith(f"{bundle}.")
        groups.setdefault(bundle if own else pairs.get(i, connection.name), []).append(i)
    joints = machine.joints()
    out = []
    for name, rows in groups.items():
        k = np.array([at_rest(joints[i]) for i in rows])
        turns = np.array([machine.flexible[i].rotates for i in rows])
        mixed = bool(np.any(turns) and not np.all(turns))
        own_k = k[~turns] if mixed else k
        top = float(np.max(own_k)) if np.max(own_k) > 0 else 1.0
        share = np.where(turns & mixed, 0.0, np.where(k > 0, k / top, 1e-3))
        out.append(Place(name, tuple(rows), tuple(float(s) for s in share), top))
    return tuple(out)


def at_rest(joint: Joint) -> float:
    """Stiffness in N/m at small amplitude, at low frequency."""
    gain = complex(joint.first_harmonic(1e-9, 1.0).gain)
    if np.isfinite(gain.real) and gain.real > 0:
        return float(gain.real)
    rest = np.zeros(())
    return max(float(joint.jacobian(Motion(rest, rest), joint.initial_state(rest))[0]), 0.0)


def shared(law: JointLaw, share: float) -> JointLaw:
    """The law of one row: forces in proportion, lengths and speeds as they are."""
    if share == 1.0:
        return law
    values = {}
    for p in parameters_of(law):
        if p.role in _SHARED:
            own = getattr(law, p.name)
            values[p.name] = tuple(share * v for v in own) if p.listed else share * own
    return replace(law, **values)  # type: ignore[type-var]
