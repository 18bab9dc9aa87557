"""Where on a machine a joint may be wrong: a connection, or a bundle whose rows change together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from jointlib.joint import Joint
from jointlib.law import JointLaw, Motion
from jointlib.parameter import Role, parameters_of

from ...model.machine import Machine

_SHARED = (Role.STIFFNESS, Role.DAMPING, Role.SLIP_FORCE)


@dataclass(frozen=True)
class Place:
    """One connection, or all rows of a bundle."""

    name: str
    rows: tuple[int, ...]
    """Indices of its connections among `Machine.flexible`."""
    share: tuple[float, ...]
    """Stiffness of each row over that of the stiffest; a law added to the place is shared out like this."""
    stiffness: float
    """N/m at rest, of the stiffest row."""

    def with_joint(self, joints: tuple[Joint, ...], changed: Mapping[int, Joint]) -> tuple[Joint, ...]:
        """All joints of the machine with these rows changed."""
        return tuple(changed.get(i, joint) for i, joint in enumerate(joints))


def places_of(machine: Machine) -> tuple[Place, ...]:
    """The connections that carry a joint, in order; rows that a bundle made count as one place."""
    groups: dict[str, list[int]] = {}
    for i, connection in enumerate(machine.flexible):
        joint = connection.joint
        bundle = str(joint.provenance["bundle"]).partition(" (")[0] if joint and "bundle" in joint.provenance else ""
        own = bundle and connection.name.startswith(f"{bundle}.")
        groups.setdefault(bundle if own else connection.name, []).append(i)
    joints = machine.joints()
    out = []
    for name, rows in groups.items():
        k = np.array([at_rest(joints[i]) for i in rows])
        top = float(np.max(k)) if np.max(k) > 0 else 1.0
        share = np.where(k > 0, k / top, 1e-3)
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
