"""What an FMU computes: a linear structure with joints in it; a lone joint is the structure that is not there."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.law import Motion

from .conditions import Condition, conditions_of
from .si_unit import turned
from .step_limit import operating_range
from .variables import variables_of

SLOW = 1e6
"""s; how long a joint takes to be loaded."""


@dataclass(frozen=True)
class Signal:
    """An input, an output or a state of the structure; ``size`` is how large it usually is."""

    name: str
    unit: str
    description: str
    size: float = 1.0
    start: float = 0.0


@dataclass(frozen=True, eq=False)
class System:
    """x' = A x + B u + G f, [z; v] = C x + D u, y = E x + F u + H f, and to each the constants of a static load.

    Structure states x, inputs u, outputs y; f are the joints' forces in N, and the rows of C and D give displacement
    (m) and velocity (m/s) of each joint in turn: z₀, v₀, z₁, v₁ …
    """

    name: str
    title: str
    """What it is, in one sentence without a full stop."""
    inputs: tuple[Signal, ...]
    outputs: tuple[Signal, ...]
    joints: tuple[tuple[str, Joint], ...]
    """Each joint with what stands before the names of its variables; nothing before those of a lone joint."""
    C: Array
    D: Array
    E: Array
    F: Array
    H: Array
    A: Array
    B: Array
    G: Array
    states: tuple[Signal, ...] = ()
    lone: Joint | None = None
    """The joint, where the system is a joint and nothing else."""
    band: tuple[float, float] = (0.0, 0.0)
    """Lowest and highest natural frequency in Hz, joints linear; 0 where nothing swings by itself."""
    step: float | None = None
    """Communication step in s that resolves the inputs, where the structure is integrated inside."""
    load: Array | None = None
    """What is added to x', [z; v] and y in that order under a static load: constant accelerations and offsets.

    Joints that remember were then loaded slowly from z = 0."""
    rest: Array | None = None
    """x at the start, in balance with that load; 0 without one."""
    flat: bool = False
    """Variables have names of letters, digits and _ alone in the FMU."""
    author: str = ""
    """Who made what it computes, where that is known."""
    turning: frozenset[str] = frozenset()
    """What stands before the names of the joints that turn: their motion is an angle in rad, their force a moment."""
    conditions: tuple[Condition, ...] = ()
    """What parameters of joints follow: the last of the inputs, which act on nothing else."""

    def unit(self, prefix: str, unit: str) -> str:
        """The unit of a quantity of a joint, given as that of one which moves along a line."""
        return turned(unit) if prefix in self.turning else unit

    def shown(self, name: str) -> str:
        """A variable's name as the FMU has it: ``guide_viscous_damping`` where it is flat."""
        if not self.flat:
            return name
        plain = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_")
        return plain if plain[:1].isalpha() else f"n_{plain}"

    @property
    def constants(self) -> tuple[Array, Array, Array]:
        """``load`` by what it is added to; zeros without one."""
        sizes = (len(self.A), len(self.C), len(self.E))
        return tuple(np.split(self._load, np.cumsum(sizes)[:-1]))  # type: ignore[return-value]

    @property
    def _load(self) -> Array:
        return np.zeros(len(self.A) + len(self.C) + len(self.E)) if self.load is None else self.load

    @property
    def start(self) -> Array:
        """x at the start."""
        return np.zeros(len(self.A)) if self.rest is None else self.rest

    def matrix(self) -> Array:
        """[[A, B, G], [C, D, 0], [E, F, H]]: every row that is computed over states, inputs and joint forces.

        Behind the motions of the joints come the conditions, as they stand among the inputs.
        """
        n, nu, nj, of = len(self.states), len(self.inputs), len(self.joints), len(self.conditions)
        C, D = (np.concatenate(rows) for rows in ((self.C, np.zeros((of, n))), (self.D, np.eye(nu)[nu - of :])))
        return np.block([[self.A, self.B, self.G], [C, D, np.zeros((len(C), nj))], [self.E, self.F, self.H]])

    def conditions_in(self, inputs: Array) -> list[dict[str, float]]:
        """The conditions by what they are, out of rows of inputs."""
        kinds = [c.kind for c in self.conditions]
        return [dict(zip(kinds, row[len(row) - len(kinds) :].tolist(), strict=True)) for row in inputs]

    def under(self, inputs: Array) -> System:
        """The same with its joints as they are at these inputs, at rest: conditions carried out."""
        (at,) = self.conditions_in(inputs[None])
        found = {id(joint): joint.at(at) for _, joint in self.joints}
        return replace(self, joints=tuple((prefix, found[id(joint)]) for prefix, joint in self.joints))


def with_conditions(system: System, where: str) -> System:
    """The system with an input for each condition that its joints depend on."""
    found = conditions_of(where, (joint for _, joint in system.joints))
    told = [Signal(c.name, c.unit, c.description, c.size, c.start) for c in found]
    B, D, F = (np.pad(M, ((0, 0), (0, len(found)))) for M in (system.B, system.D, system.F))
    return replace(system, inputs=(*system.inputs, *told), conditions=found, B=B, D=D, F=F)


def fmi_name(text: str) -> str:
    """A name as FMI's structured naming takes it: in quotes where it is more than letters, digits and _."""
    if re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", text):
        return text
    return "'" + re.sub(r"(['\\])", r"\\\1", text) + "'"


def prefixed(prefix: str, name: str) -> str:
    """``guide.hertz_guide.preload``; nothing goes before the names of a lone joint."""
    return f"{prefix}.{name}" if prefix else name


def system_of_joint(joint: Joint) -> System:
    """A joint alone: displacement and velocity in, force out."""
    every = variables_of(joint)
    sizes = _sizes(joint)
    inputs, outputs = (
        tuple(Signal(v.name, v.unit, v.description, sizes[v.unit]) for v in every if v.name in names)
        for names in ({"displacement", "velocity"}, {"force"})
    )
    title = f"Restoring force of the joint {joint.name}: " + " + ".join(law.kind for law in joint.laws)
    alone = _of_joint(joint.name, title, inputs, outputs, joint, np.eye(2), np.ones((1, 1)), joint)
    return replace(alone, author=str(joint.provenance.get("author", "")))


def system_of_connection(name: str, joint: Joint, sides: int, turns: bool = False) -> System:
    """A joint between two sides (or one, the other being the ground) that move by themselves.

    Displacement and velocity of each side in; out the force on each side, −f on the first and +f on the second. Where
    it ``turns``, these are angles and moments.
    """
    if sides not in {1, 2}:
        raise InputError(f"connection {name!r}: {sides} sides, expected 1 (the other is the ground) or 2")
    numbers = range(1, sides + 1)
    line = "about the axis" if turns else "along the connection"
    sizes = _sizes(joint)
    inputs = [
        Signal(f"{q}_{i}", turned(unit) if turns else unit, f"{moved(q, turns)} of side {i} {line}", sizes[unit])
        for i in numbers
        for q, unit in (("displacement", "m"), ("velocity", "m/s"))
    ]
    unit, pull = turned("N") if turns else "N", moved("force", turns)
    outputs = [Signal(f"force_{i}", unit, f"{pull} of the joint on side {i}", sizes["N"]) for i in numbers]
    sign = np.array([1.0, -1.0])[:sides]
    title = f"Connection {name}: " + " + ".join(law.kind for law in joint.laws)
    alone = _of_joint(name, title, inputs, outputs, joint, np.kron(sign, np.eye(2)), -sign[:, None], None)
    return replace(alone, turning=frozenset({""}) if turns else frozenset())


def moved(quantity: str, turns: bool) -> str:
    """What a displacement, a velocity or a force is called where it is one of a rotation."""
    words = {"displacement": "angle", "velocity": "angular velocity", "force": "moment"}
    return words[quantity] if turns else quantity


def _sizes(joint: Joint) -> dict[str, float]:
    """Usual size by unit: the range of the joint, and the largest force at its ends."""
    over = operating_range(joint)
    ends = [(side * over.amplitude, 0.0) for side in (-1, 1)] + [(0.0, side * over.velocity) for side in (-1, 1)]
    rest = joint.initial_state(0.0)
    with np.errstate(over="ignore"):
        forces = [abs(float(joint.step(Motion(np.asarray(z), np.asarray(v)), rest)[0])) for z, v in ends]
    force = max((f for f in forces if np.isfinite(f)), default=0.0)
    return {"m": over.amplitude, "m/s": over.velocity, "N": force or 1.0}


def _of_joint(
    name: str,
    title: str,
    inputs: Sequence[Signal],
    outputs: Sequence[Signal],
    joint: Joint,
    D: Array,
    H: Array,
    lone: Joint | None,
) -> System:
    """A joint without structure."""
    nu, ny = len(inputs), len(outputs)
    none = np.zeros((0, 0))
    alone = System(
        name,
        title,
        tuple(inputs),
        tuple(outputs),
        (("", joint),),
        C=np.zeros((2, 0)),
        D=D,
        E=np.zeros((ny, 0)),
        F=np.zeros((ny, nu)),
        H=H,
        A=none,
        B=np.zeros((0, nu)),
        G=np.zeros((0, 1)),
        lone=lone,
    )
    return with_conditions(alone, f"joint {name!r}")
