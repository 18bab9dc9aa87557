"""Random machines from a seed, plausible, as documents, as files and as `Machine`; and wrong turns taken from them.

A machine is a tree of parts that stands on the ground. Parts are rigid bodies, beams, lumped masses and modal parts;
what joins two of them in space is linear guides, screws, bearings or single contacts. Everything is held and damped,
the tool bends.

>>> machine = random_machine(7)                 # the `Machine`
>>> write_random(7, folder / "seven.toml")      # the same as a file
>>> for name, wrong in mutations(machine, 7): … # bands, units, damping, stiff parts, free parts
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from scipy.linalg import eigh

from jointlib.arrays import Array
from jointlib.describing import DescribingFunction
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from jointlib.parameter import Role, parameters_of
from machines import Machine, read_machine
from machines.components.connection import Connection
from machines.components.lumped import Lumped
from machines.components.modal import Modal
from machines.components.rigid import Rigid
from machines.coupling.second_order import machine_equations

Document = dict[str, Any]
STEEL = {"name": "steel", "young": 210e9, "poisson": 0.3, "density": 7850.0, "loss_factor": 0.006}
ROWS = ((1, 0, 0), (0, 1, 0), (0, 0, 1))


@dataclass
class Plan:
    """A document as it grows: the random numbers, its tables, and how many contacts it has."""

    rng: np.random.Generator
    document: Document
    contacts: int = 0
    nonlinear: bool = True

    def between(self, low: float, high: float) -> float:
        """Log-uniform."""
        return float(np.exp(self.rng.uniform(np.log(low), np.log(high))))

    def add(self, table: str, entry: Document, contacts: int = 0) -> None:
        self.document.setdefault(table, []).append(entry)
        self.contacts += contacts

    def joint(self, stiffness: float, mass: float) -> Document:
        """A spring with a damper of 1 to 8 % of critical for this mass, at times with something nonlinear at rest."""
        damping = 2 * self.rng.uniform(0.01, 0.08) * np.sqrt(stiffness * mass)
        laws: list[Document] = [
            {"kind": "linear", "stiffness": stiffness},
            {"kind": "viscous", "damping": float(damping)},
        ]
        word = self.rng.choice(["none", "cubic", "jenkins", "hertz", "gap", "quadratic"]) if self.nonlinear else "none"
        if word == "cubic":
            laws.append({"kind": "cubic", "stiffness3": stiffness * self.between(1e8, 1e11)})
        if word == "jenkins":
            laws.append({"kind": "jenkins", "stiffness": 0.3 * stiffness, "slip_force": self.between(20, 500)})
        if word == "gap":
            laws.append({"kind": "gap", "stiffness": 0.5 * stiffness, "clearance": self.between(1e-6, 2e-5)})
        if word == "quadratic":
            laws.append({"kind": "quadratic-damping", "damping2": self.between(1e3, 1e5)})
        if word == "hertz":
            preload = self.between(300, 3000)
            # Four rows at 45°: K = 3 P0^(1/3) / κ, to the order of the stiffness.
            kappa = 3 * preload ** (1 / 3) / stiffness
            laws[0] = {"kind": "hertz-guide", "preload": preload, "kappa": kappa, "contact_angle": np.pi / 4}
        return {"law": laws}


def random_document(seed: int) -> Document:
    """The tables of a random machine of 5 to 200 contacts; the same seed, the same machine."""
    rng = np.random.default_rng([seed, 20])
    plan = Plan(rng, {"schema": "jointlib/machine/1", "name": f"random-{seed}"}, nonlinear=bool(rng.random() < 0.7))
    wanted = round(plan.between(5, 200))
    tip = _in_space(plan, wanted) if wanted >= 12 else _chain(plan, wanted)
    plan.document["tool"] = _axes(plan, *tip)
    plan.document["response"] = {"force": [float(round(plan.between(5, 100)))], "frequency": [1.0, 20e3]}
    plan.document["cutting"] = _cutting(plan)
    return plan.document


def random_machine(seed: int) -> Machine:
    """The `Machine` of a seed; its band: from a third of its lowest mode to three times the highest its tool feels."""
    with tempfile.TemporaryDirectory() as folder:
        machine = read_machine(_written(random_document(seed), Path(folder) / "machine.toml"))
    return replace(machine, source=None, frequency=felt_band(machine))


def write_random(seed: int, path: Path, band: bool = True) -> Path:
    """The same as a file; without ``band`` it says nothing of frequencies."""
    document = random_document(seed)
    document["response"].pop("frequency")
    if band:
        document["response"]["frequency"] = list(random_machine(seed).frequency or ())
    return _written(document, path)


def felt_band(machine: Machine) -> tuple[float, float]:
    """Hz: from a third of the lowest mode to three times the highest that gives the tool 1e-2 of its flexibility."""
    frequency, share = tool_modes(machine)
    felt = frequency[share > 1e-2 * share.max()]
    return float(felt.min() / 3), float(felt.max() * 3)


def tool_modes(machine: Machine) -> tuple[Array, Array]:
    """Undamped frequencies (Hz) of the modes of the machine at rest, and the compliance of each at its tool in m/N."""
    model = machine_equations(machine)
    held = np.array([_stiffness(joint) for joint in machine.joints()])
    K = model.stiffness + model.joints.T @ (held[:, None] * model.joints)
    squared, shapes = eigh(K, model.mass)
    moved = machine.dof_rows(machine.tool_dofs, "tool") @ model.shapes @ shapes
    kept = squared > 1e-12 * squared.max()
    return np.sqrt(squared[kept]) / (2 * np.pi), np.sum(moved[:, kept] ** 2, axis=0) / squared[kept]


def _stiffness(joint: Joint) -> float:
    """N/m about zero, from an amplitude far below anything that joints are known for."""
    return float(np.real(DescribingFunction(joint)(1e-12, 1.0)))


def _written(document: Document, path: Path) -> Path:
    path.write_text(tomli_w.dumps(document), encoding="utf-8")
    return path


# ---- machines of lumped masses in two directions --------------------------------------------------------------------


def _chain(plan: Plan, wanted: int) -> tuple[str, str]:
    """Masses one on the other, along x and y at times alike; the last one, or a modal tool on it, cuts."""
    rng, before, k = plan.rng, "", 0
    mass, pair = plan.between(50, 2000), ["x", "y"]
    while plan.contacts < wanted:
        name = f"mass_{k}"
        plan.add("component", {"name": name, "kind": "lumped", "dofs": pair, "mass": np.diag([mass, mass]).tolist()})
        for axis in pair:
            f = plan.between(30, 300) * 1.7**k
            entry = {"between": [f"{name}.{axis}", f"{before}.{axis}" if before else "ground"]}
            plan.add(
                "connection",
                {"name": f"joint_{k}_{axis}", **entry, "joint": plan.joint((2 * np.pi * f) ** 2 * mass, mass)},
                1,
            )
        if k > 0 and rng.random() < 0.3:  # a way to the ground past the others
            stiffness = plan.between(1e6, 3e7)
            other = {"between": [f"{name}.x", "ground"], "joint": plan.joint(stiffness, mass)}
            plan.add("connection", {"name": f"strut_{k}", **other}, 1)
        before, mass, k = name, mass * rng.uniform(0.2, 0.8), k + 1
    if rng.random() < 0.5:
        return f"{before}.x", f"{before}.y"
    return _modal_tool(plan, before)


def _modal_tool(plan: Plan, before: str) -> tuple[str, str]:
    """A tool known by the modes of the free part: its translations, and one bending mode each way."""
    mass, f = plan.between(0.5, 8), [plan.between(500, 4000) for _ in range(2)]
    shape = plan.rng.uniform(0.4, 0.9)
    tool: Document = {"name": "tool", "kind": "modal", "dofs": ["base_x", "base_y", "tip_x", "tip_y"]}
    tool |= {"frequency": [0.0, 0.0, *f], "damping_ratio": [0.0, 0.0, *plan.rng.uniform(0.01, 0.05, 2).tolist()]}
    tool |= {"modal_mass": [mass, mass, 0.5 * mass, 0.5 * mass]}
    tool |= {"shapes": [[1.0, 0.0, -shape, 0.0], [0.0, 1.0, 0.0, -shape], [1.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, 1.0]]}
    plan.add("component", tool)
    for axis in "xy":
        joint = plan.joint(plan.between(3e7, 3e8), mass)
        plan.add(
            "connection",
            {"name": f"clamp_{axis}", "between": [f"tool.base_{axis}", f"{before}.{axis}"], "joint": joint},
            1,
        )
    return "tool.tip_x", "tool.tip_y"


# ---- machines in space ----------------------------------------------------------------------------------------------


def _in_space(plan: Plan, wanted: int) -> tuple[str, str]:
    """Bodies one on the other from the floor up, a tool held by the last; at times a table stands beside it."""
    rng, before, mass, z = plan.rng, "ground", plan.between(800, 6000), 0.0
    levels = min(int(rng.integers(1, 7)), wanted // 12)
    for k in range(levels):
        size, name = rng.uniform(0.5, 1.0, 3) * 0.8**k, f"body_{k}"
        plan.add("component", _body(name, mass, size, [0.0, 0.0, z + size[2] / 2]))
        _held(plan, name, before, z, size, mass, wanted // levels)
        z, before, mass = z + size[2], name, mass * rng.uniform(0.25, 0.6)
    tip = _tool(plan, before, z, mass)
    return tip if rng.random() < 0.5 else _against_table(plan, tip, z)


def _body(name: str, mass: float, size: Array, centre: list[float]) -> Document:
    squared = size**2
    inertia = mass / 12 * np.array([squared[1] + squared[2], squared[0] + squared[2], squared[0] + squared[1]])
    return {"name": name, "kind": "rigid", "mass": mass, "inertia": inertia.tolist(), "centre": centre}


def _held(plan: Plan, name: str, before: str, z: float, size: Array, mass: float, wanted: int) -> None:
    """What a body stands on: single contacts at its feet, or guides with a screw."""
    whole = plan.between(2e8, 2e9)
    a, b = 0.45 * size[0], 0.45 * size[1]
    if before == "ground" or wanted < 16 or plan.rng.random() < 0.3:
        feet = max(wanted // 3, 3)
        for i, turn in enumerate(2 * np.pi * np.arange(feet) / feet):
            for axis, direction in zip("xyz", ROWS, strict=True):
                entry: Document = {"between": [name, before], "at": [a * np.cos(turn), b * np.sin(turn), z]}
                entry["joint"] = plan.joint(whole / feet * plan.rng.uniform(0.5, 1.5), mass / feet)
                plan.add("connection", {"name": f"{name}_foot_{i}{axis}", "direction": list(direction), **entry}, 1)
        return
    feet_at = [[-a, -b, z], [a, -b, z], [-a, b, z], [a, b, z]]
    along, points = list(ROWS[int(plan.rng.integers(2))]), max(wanted // 16, 1)
    damping = 2 * plan.rng.uniform(0.01, 0.06) * np.sqrt(whole * mass)
    guide: Document = {"name": f"{name}_guide", "kind": "linear-guide", "between": [name, before], "at": feet_at}
    guide |= {"axes": [along, [0, 0, 1]], "preload": plan.between(500, 4000), "stiffness": whole / 4, "points": points}
    guide |= {"width": 0.03, "height": 0.01, "length": 0.08, "damping": damping / 4}
    plan.add("bundle", guide, 16 * points)
    screw: Document = {"name": f"{name}_screw", "kind": "ball-screw", "between": [name, before], "at": [0.0, 0.0, z]}
    screw |= {"axes": [along], "diameter": 0.035, "position": 0.4, "length": 0.9, "damping": float(damping / 2)}
    screw |= {"nut_stiffness": plan.between(2e8, 1e9), "bearing_stiffness": plan.between(2e8, 1e9)}
    plan.add("bundle", screw, 1)


def _tool(plan: Plan, before: str, z: float, mass: float) -> tuple[str, str]:
    """A tool of steel, a beam, on springs; or a slender mass of its own, along x and y."""
    rng = plan.rng
    length, diameter = rng.uniform(0.05, 0.15), rng.uniform(0.012, 0.03)
    if rng.random() < 0.6:
        holder = {"length": 0.06, "diameter": 2.5 * diameter}
        tool: Document = {"name": "tool", "kind": "beam", "start": [0.0, 0.0, z], "axis": [0, 0, 1], "up_to": 4000.0}
        tool |= {"tolerance": 0.08, "material": [STEEL], "segment": [holder, {"length": length, "diameter": diameter}]}
        tool["station"] = [{"name": "clamp", "at": 0.03}, {"name": "tip", "at": "end"}]
        plan.add("component", tool)
        for level in (z, z + 0.06):  # two rings of three springs round the holder, and one along it
            for axis, direction in zip("xy", ROWS, strict=False):
                entry: Document = {"between": ["tool", before], "at": [0.0, 0.0, level], "direction": list(direction)}
                entry["joint"] = plan.joint(plan.between(5e7, 4e8), 1.0)
                plan.add("connection", {"name": f"clamp_{axis}_{1000 * (level - z):.0f}", **entry}, 1)
        for axis, r in (("z", 0.0), ("turn", 0.02)):
            entry = {"between": ["tool", before], "at": [r, 0.0, z + 0.03], "direction": [0, 1, 0] if r else [0, 0, 1]}
            plan.add(
                "connection", {"name": f"clamp_{axis}", **entry, "joint": plan.joint(plan.between(5e7, 4e8), 1.0)}, 1
            )
        return "tool.tip.x", "tool.tip.y"
    plan.document["component"][-1]["point"] = [{"name": "nose", "at": [0.0, 0.0, z]}]
    tip_mass = plan.between(0.2, 2)
    plan.add(
        "component", {"name": "tool", "kind": "lumped", "dofs": ["x", "y"], "mass": np.diag([tip_mass] * 2).tolist()}
    )
    for axis in "xy":
        stiffness = (2 * np.pi * plan.between(300, 3000)) ** 2 * tip_mass
        entry = {"between": [f"tool.{axis}", f"{before}.nose.{axis}"], "joint": plan.joint(stiffness, tip_mass)}
        plan.add("connection", {"name": f"clamp_{axis}", **entry}, 1)
    return "tool.x", "tool.y"


def _against_table(plan: Plan, tip: tuple[str, str], z: float) -> tuple[str, str]:
    """A table with the workpiece, on feet of its own; what cuts is the tool against it."""
    mass, size = plan.between(50, 800), plan.rng.uniform(0.3, 0.8, 3)
    table = _body("table", mass, size, [0.0, 2.0, size[2] / 2])
    plan.add("component", {**table, "point": [{"name": "cut", "at": [0.0, 2.0, float(size[2])]}]})
    for i, (x, y) in enumerate(((-1, -1), (1, -1), (0, 1))):
        for axis, direction in zip("xyz", ROWS, strict=True):
            at = [0.45 * x * size[0], 2.0 + 0.45 * y * size[1], 0.0]
            joint = plan.joint((2 * np.pi * plan.between(40, 250)) ** 2 * mass / 3, mass / 3)
            entry = {"between": ["table", "ground"], "at": at, "direction": list(direction), "joint": joint}
            plan.add("connection", {"name": f"table_foot_{i}{axis}", **entry}, 1)
    return f"{tip[0]} - table.cut.x", f"{tip[1]} - table.cut.y"


# ---- the cut --------------------------------------------------------------------------------------------------------


def _axes(plan: Plan, x: str, y: str) -> dict[str, str]:
    """Mostly both directions of the tool, at times one."""
    word = plan.rng.choice(["xy", "xy", "xy", "x", "y"])
    return {axis: dof for axis, dof in (("x", x), ("y", y)) if axis in word}


def _cutting(plan: Plan) -> Document:
    """Milling of all sorts, or turning; turning looks along x, so it turns with it where only y moves."""
    rng, speed = plan.rng, [plan.between(500, 3000), plan.between(6000, 24000)]
    if rng.random() < 0.25:
        angle = 0.0 if "x" in plan.document["tool"] else np.pi / 2
        specific = plan.between(4e8, 3e9)
        return {
            "process": "turning",
            "specific": specific,
            "feed_direction": angle,
            "speed": [speed[0] / 5, speed[1] / 5],
        }
    tangential, mode = plan.between(4e8, 3e9), str(rng.choice(["up", "down", "slot"]))
    cut: Document = {"process": "milling", "teeth": int(rng.integers(1, 7)), "tangential": tangential, "mode": mode}
    cut |= {"normal": tangential * rng.uniform(0.1, 0.6), "speed": speed, "feed": 1e-4}
    return cut if mode == "slot" else cut | {"immersion": plan.between(0.05, 1.0)}


# ---- wrong turns ----------------------------------------------------------------------------------------------------


def mutations(machine: Machine, seed: int) -> Iterator[tuple[str, Machine]]:
    """The machine with one thing changed at a time, with a word for what; one that cannot be is left out."""
    rng = np.random.default_rng([seed, 21])
    low, high = felt_band(machine)
    first = 3 * low
    one = machine.connections[int(rng.integers(len(machine.connections)))].name if machine.connections else ""
    made = {
        "no band": lambda: replace(machine, frequency=None),
        "band too narrow": lambda: replace(machine, frequency=(0.5 * first, 1.2 * first)),
        "band too low": lambda: replace(machine, frequency=(0.02 * first, 0.3 * first)),
        "band too high": lambda: replace(machine, frequency=(high, 2 * high)),
        "band far too wide": lambda: replace(machine, frequency=(1e-3 * low, 1e3 * high)),
        "no damping": lambda: damped(machine, 0.0),
        "hardly damped": lambda: damped(machine, 1e-4),
        "one joint in N/mm": lambda: stiffened(machine, 1e-3, one),
        "one joint 1e3 times": lambda: stiffened(machine, 1e3, one),
        "one joint 1e6 times": lambda: stiffened(machine, 1e6, one),
        "all joints 1e3 times": lambda: stiffened(machine, 1e3),
        "a mass in g": lambda: _heavier(machine, 1e-3, rng),
        "a mass in t": lambda: _heavier(machine, 1e3, rng),
        "a free part": lambda: _loose(machine),
        "a part beside it": lambda: _beside(machine),
        "cutting in N/mm2": lambda: _softer_cut(machine),
    }
    for name, make in made.items():
        try:
            yield name, make()
        except (InputError, _NotHere):
            continue


class _NotHere(Exception):
    """The machine has nothing of this kind to change."""


def stiffened(machine: Machine, factor: float, connection: str | None = None) -> Machine:
    """The joint of a connection, or of all, with its stiffnesses times a factor and its damping with the root."""
    chosen = [c for c in machine.flexible if connection in (None, c.name)]
    if not chosen:
        raise _NotHere
    for c in chosen:
        machine = machine.with_joint(c.name, _scaled(c.joint, {Role.STIFFNESS: factor, Role.DAMPING: factor**0.5}))
    return machine


def damped(machine: Machine, factor: float) -> Machine:
    """All damping of joints, lumped and modal parts times a factor; that of materials stays."""
    joints = [replace(c, joint=_scaled(c.joint, {Role.DAMPING: factor})) if c.joint else c for c in machine.connections]
    return replace(machine, components=tuple(_calmed(c, factor) for c in machine.components), connections=tuple(joints))


def _calmed(component: Any, factor: float) -> Any:
    if isinstance(component, Modal):
        return replace(component, damping_ratio=factor * component.damping_ratio)
    if isinstance(component, Lumped) and component.damping is not None:
        return replace(component, damping=factor * component.damping)
    return component


def _scaled(joint: Joint | None, factors: dict[Role, float]) -> Joint:
    assert joint is not None
    laws = []
    for law in joint.laws:
        new: dict[str, Any] = {
            p.name: np.multiply(getattr(law, p.name), factors[p.role]).tolist()
            for p in parameters_of(law)
            if p.role in factors
        }
        laws.append(replace(law, **new) if new else law)  # type: ignore[type-var]
    return replace(joint, laws=tuple(laws), covariance=None)


def _heavier(machine: Machine, factor: float, rng: np.random.Generator) -> Machine:
    """One rigid body whose mass and inertia are off by a unit."""
    bodies = [c for c in machine.components if isinstance(c, Rigid)]
    if not bodies:
        raise _NotHere
    one = bodies[int(rng.integers(len(bodies)))]
    new = replace(one, mass=factor * one.mass, inertia=factor * one.inertia, dofs=one.dofs[:6])
    return replace(machine, components=tuple(new if c is one else c for c in machine.components))


def _loose(machine: Machine) -> Machine:
    """Without what holds its first part to the ground: the machine floats."""
    kept = tuple(c for c in machine.connections if "ground" not in c.between)
    if len(kept) == len(machine.connections):
        raise _NotHere
    return replace(machine, connections=kept)


def _beside(machine: Machine) -> Machine:
    """With a mass on a spring of its own that touches nothing of it."""
    part = Lumped("beside", ("x",), np.array([[3.0]]))
    held = Connection("beside", ("beside.x", "ground"), Joint((Linear(1e7), Viscous(50.0))))
    return replace(machine, components=(*machine.components, part), connections=(*machine.connections, held))


def _softer_cut(machine: Machine) -> Machine:
    """Coefficients a thousand times too large, as N/m² written where N/mm² was meant and multiplied twice."""
    if machine.cutting is None:
        raise _NotHere
    cut = {k: 1e3 * v if k in ("tangential", "normal", "specific") else v for k, v in machine.cutting.items()}
    return replace(machine, cutting=cut)
