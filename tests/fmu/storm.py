"""Random sets of valid parameters for every law, and what the physics allows a joint with them."""

from __future__ import annotations

import numpy as np
from samples import LAWS

from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.law import JointLaw, MemorylessLaw
from jointlib.parameter import Parameter, parameters_of

JOINTS = tuple(Joint((law,), f"{law.kind} {i}") for i, law in enumerate(LAWS) if law.in_time)
EVERYTHING = Joint(tuple(law for law in LAWS if law.in_time), "everything")
ROUNDING = 1e-9
"""Of a bound, relative."""


def drawn(value: float, declared: Parameter, rng: np.random.Generator) -> float:
    """A number over four decades about a usual one, or at an edge of what is allowed."""
    if declared.name == "side":
        return float(rng.choice([-1.0, 1.0]))
    if rng.random() < 0.1:
        edges = [x for x in (declared.lower, declared.upper, 0.0) if np.isfinite(x) and x >= declared.lower]
        value = float(rng.choice(edges))
        if value > declared.above:
            return value
    size = abs(value) or (1e-7 if declared.unit == "m" else 1e-3)
    value = size * 10 ** rng.uniform(-2, 2) * (rng.choice([-1.0, 1.0]) if declared.lower == -np.inf else 1.0)
    return float(np.clip(value, declared.lower, declared.upper))


def wild(law: JointLaw, rng: np.random.Generator) -> JointLaw:
    """The law with other numbers that go together."""
    declared = {p.name: p for p in parameters_of(law)}
    joint = Joint((law,))
    while True:
        new = {
            key: drawn(value, declared[key.split(".")[1].split("[")[0]], rng) for key, value in joint.parameters.items()
        }
        try:
            return joint.with_parameters(new).laws[0]
        except InputError:
            continue


def force_bound(law: JointLaw, A: float, V: float) -> float:
    """Largest force in N while abs(z) ≤ A in m and abs(ż) ≤ V in m/s, whatever the path."""
    p = {q.name: getattr(law, q.name) for q in parameters_of(law)}
    # The play is stored with the deflection behind it: its last digits are a force.
    last = 4 * np.finfo(float).eps * float(np.sum(p.get("stiffness", 0.0))) * p.get("clearance", 0.0)
    match law.kind:
        case "polynomial":
            C = np.abs(p["coefficients"])
            return float(A ** np.arange(C.shape[0]) @ C @ V ** np.arange(C.shape[1]))
        case "chebyshev":
            C = np.abs(p["coefficients"])
            by_z, by_v = (
                [max(1.0, abs(np.polynomial.chebyshev.chebval(x, np.eye(n)[i]))) for i in range(n)]
                for x, n in zip((A / p["displacement_scale"], V / p["velocity_scale"]), C.shape, strict=True)
            )
            return float(by_z @ C @ by_v)
        case "lugre":
            # The bristle stays below the deflection of static friction, and its rate below v (1 + Fs/Fc).
            static = p["static_force"] + last
            return float(static + p["damping"] * V * (1 + static / p["slip_force"]))
        case "maxwell":
            return 2 * A * float(p["stiffness"])
        case "stribeck":
            return float(p["static_force"])
        case "coulomb" | "jenkins" | "iwan" | "dahl" | "bouc-wen":
            return float(np.sum(p["slip_force"]) + last)
        case _:
            # Between the ends of the range and the kinks in it the force grows, or falls, all the way.
            assert isinstance(law, MemorylessLaw)
            bends = [kink for kink in law.kinks()[0] if abs(kink) < A]
            z, v = np.meshgrid([A, -A, *bends], [V, -V])
            # A preloaded contact is a difference of row forces: their last digits are a force.
            rounded = 8 * np.finfo(float).eps * p.get("preload", 0.0)
            return float(np.max(np.abs(law.force(z, v)))) + rounded


def state_bound(law: JointLaw, state: str, A: float) -> float:
    """Largest size in m of a state while abs(z) ≤ A."""
    if state.split("[")[0] in {"position", "slider"}:
        return A
    assert state == "stretch"
    if law.kind == "maxwell":
        return 2 * A
    slip = getattr(law, "static_force", None) or law.slip_force  # type: ignore[attr-defined]
    return float(slip / law.stiffness + law.clearance)  # type: ignore[attr-defined]


def life(joint: Joint, rng: np.random.Generator) -> list[float]:
    """Amplitudes, bound of the force, parameters and bounds of the states of a joint with other numbers."""
    A, V = 10 ** rng.uniform(-8, -2), 10 ** rng.uniform(-6, 1)
    laws = [wild(law, rng) for law in joint.laws]
    force = sum(force_bound(law, A, V) for law in laws)
    states = [state_bound(law, state, A) for law in laws for state in law.states]
    numbers = [force, *Joint(tuple(laws)).parameters.values(), *states]
    numbers[0] *= 1 + ROUNDING
    numbers[len(numbers) - len(states) :] = [x * (1 + ROUNDING) for x in states]
    return [A, V, *numbers]


def plan(joint: Joint, references: dict[str, int], continuous: list[str], indicators: int, lives: int) -> str:
    """What the host reads."""
    rng = np.random.default_rng(len(joint.laws) + lives)
    lists = [[references[name] for name in joint.parameters], [references[name] for name in joint.states]]
    lists.append([joint.states.index(name) for name in continuous])
    head = [x for one in lists for x in (len(one), *one)] + [indicators, lives]
    return "\n".join(" ".join(map(repr, map(float, row))) for row in (head, *(life(joint, rng) for _ in range(lives))))
