"""Machines with a joint that is not what its file says, and the frequency responses they would show.

A machine is drawn from a seed: four to six masses in a row (or a slide that rocks on two of its joints) with three or
four flexible joints. In one of them stiffness, damping, preload or hardening is changed, or a force is hidden; its size
is set so that the frequency responses change by a drawn share, by equivalent linear joints. What is "measured" is
integrated in time (`machine_steps`); noise is complex, Gaussian and the same on all lines.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from machine_forces import HIDDEN, Array, ComplexArray, Term, cubic, friction, guide
from machine_steps import Structure, equivalent, first_harmonics

DECIBEL = 40.0
WARM, REGAINED = 1e-3, 1e-2
"""Deviations of the natural frequencies and of the level from record to record, relative."""
_CHANGE = (0.05, 0.25)
"""Share by which an alteration changes the responses, rms over rms, mean over the forces."""
_LARGEST = {
    "stiffness": 1.6,
    "damping": 4.0,
    "preload": 3.0,
    "hardening": 6.0,
    "cubic": 0.35,
    "coulomb": 0.15,
    "gap": 0.05,
    "contact-loss": 0.5,
    "quadratic-damping": 0.3,
    "hysteresis": 0.3,
}
"""Factor on a parameter, or hidden force over k z at the largest motion."""


@dataclass(frozen=True)
class JointTruth:
    """A joint with everything in it; SI."""

    name: str
    sides: str
    """The keys of the machine file that place it."""
    row: Array
    stiffness: float
    damping: float
    kind: str = "linear"
    """"linear", "cubic", "guide" or "friction"."""
    more: Mapping[str, float] | None = None
    hidden: Term | None = None

    @property
    def straight(self) -> float:
        """Stiffness that is no part of a term."""
        return 0.0 if self.kind == "guide" else self.stiffness

    @property
    def terms(self) -> tuple[Term, ...]:
        m = self.more or {}
        own: dict[str, Callable[[], Term]] = {
            "cubic": lambda: cubic(m["stiffness3"]),
            "guide": lambda: guide(m["preload"], m["kappa"]),
            "friction": lambda: friction(m["slip_force"], m["smoothing_velocity"]),
        }
        parts = [own[self.kind]()] if self.kind in own else []
        return (*parts, self.hidden) if self.hidden is not None else tuple(parts)

    def laws(self) -> str:
        """Its inline table, without what is hidden."""
        m = {key: f"{value:.9g}" for key, value in (self.more or {}).items()}
        laws = [] if self.kind == "guide" else [f'{{ kind = "linear", stiffness = {self.stiffness:.9g} }}']
        laws.append(f'{{ kind = "viscous", damping = {self.damping:.9g} }}')
        word = {"cubic": "cubic", "guide": "hertz-guide", "friction": "coulomb"}.get(self.kind)
        if word:
            laws.append("{ " + ", ".join([f'kind = "{word}"', *(f"{k} = {v}" for k, v in m.items())]) + " }")
        return "{ law = [" + ", ".join(laws) + "] }"


@dataclass(frozen=True)
class Plant:
    """Masses and joints; n coordinates."""

    mass: Array
    stiffness: Array
    """Of the components alone."""
    damping: Array
    joints: tuple[JointTruth, ...]
    components: str
    """Their part of the machine file."""
    dofs: Mapping[str, Array]
    """Rows of the coordinates, by name."""
    drive: str

    def structure(self) -> Structure:
        K, C = self.stiffness.copy(), self.damping.copy()
        for joint in self.joints:
            outer = np.outer(joint.row, joint.row)
            K += joint.straight * outer
            C += joint.damping * outer
        rows = np.array([j.row for j in self.joints])
        return Structure(self.mass, C, K, rows, tuple(j.terms for j in self.joints), self.dofs[self.drive])

    def with_joint(self, index: int, joint: JointTruth) -> Plant:
        return replace(self, joints=tuple(joint if i == index else j for i, j in enumerate(self.joints)))


@dataclass(frozen=True)
class Case:
    """A machine as its file has it, as it is, and the test that is made."""

    seed: int
    declared: Plant
    actual: Plant
    place: str | None
    what: str
    """Parameter or effect; empty where nothing is altered."""
    size: float
    """Factor, or N at the largest motion."""
    change: float
    frequency: Array
    """Hz."""
    forces: Array
    """N, peak."""
    responses: tuple[str, ...]
    sealed: int | None
    """Index of the force whose records are sealed."""


def chain(rng: np.random.Generator) -> Plant:
    """Masses in a row from the grounded base to the tool; one pair of neighbours may be one component."""
    n = int(rng.integers(4, 7))
    mass = np.geomspace(rng.uniform(60, 200), rng.uniform(3, 10), n) * rng.uniform(0.7, 1.4, n)
    inner = {int(i) for i in rng.choice(np.arange(1, n), size=max(0, n - 5), replace=False)}
    K, joints = np.zeros((n, n)), []
    base = rng.uniform(0.6, 2.0) * 1e8
    K[0, 0] += base
    parts: list[list[int]] = [[0]]
    for i in range(1, n):
        k = float(np.exp(rng.uniform(np.log(0.25e8), np.log(2e8))))
        row = np.zeros(n)
        row[i], row[i - 1] = 1.0, -1.0
        if i in inner:
            K += k * np.outer(row, row)
            parts[-1].append(i)
        else:
            parts.append([i])
            joints.append((i, k, row))
    where = {i: f"m{p}.x{q}" for p, part in enumerate(parts) for q, i in enumerate(part)}
    C = 2 * 0.012 * _lowest(np.diag(mass), K, [(k, row) for _, k, row in joints]) * np.diag(mass)
    C[0, 0] += 0.0
    text = ""
    for p, part in enumerate(parts):
        pick = np.ix_(part, part)
        dofs = [f"x{q}" for q in range(len(part))]
        text += f'[[component]]\nname = "m{p}"\nkind = "lumped"\ndofs = {_words(dofs)}\n'
        text += f"mass = {_matrix(np.diag(mass)[pick])}\ndamping = {_matrix(C[pick])}\nstiffness = {_matrix(K[pick])}\n"
    made = tuple(
        JointTruth(f"j{p}", f'between = ["{where[i]}", "{where[i - 1]}"]', row, k, 0.0)
        for p, (i, k, row) in enumerate(joints, start=1)
    )
    dofs = {name: np.eye(n)[i] for i, name in where.items()}
    return Plant(np.diag(mass), K, C, made, text, dofs, where[n - 1])


def rocking(rng: np.random.Generator) -> Plant:
    """A slide that is a rigid body on two joints (front, rear) over a grounded base, and a tool on its overhang.

    Coordinates: slide up, slide pitch, base, tool. Pitch ry moves a point at x by −x ry.
    """
    m, base, tool = rng.uniform(25, 60), rng.uniform(60, 200), rng.uniform(3, 10)
    length, reach = rng.uniform(0.15, 0.3), rng.uniform(0.15, 0.35)
    inertia = m * (2 * length) ** 2 / rng.uniform(8, 14)
    front, rear = length * rng.uniform(0.7, 1.0), -length * rng.uniform(0.7, 1.0)
    mass = np.diag([m, inertia, base, tool])
    K = np.zeros((4, 4))
    K[2, 2] = rng.uniform(1.0, 3.0) * 1e8
    rows = {
        "front": np.array([1.0, -front, -1.0, 0.0]),
        "rear": np.array([1.0, -rear, -1.0, 0.0]),
        "head": np.array([-1.0, reach, 0.0, 1.0]),
    }
    k = {name: float(np.exp(rng.uniform(np.log(0.3e8), np.log(1.5e8)))) for name in rows}
    k["head"] *= 0.4
    lowest = _lowest(mass, K, [(k[name], rows[name]) for name in rows])
    C = np.zeros((4, 4))
    C[2, 2], C[3, 3] = 2 * 0.02 * lowest * base, 2 * 0.012 * lowest * tool
    text = f'[[component]]\nname = "slide"\nkind = "rigid"\nmass = {m:.17g}\n'
    text += f"inertia = [{inertia:.17g}, {inertia:.17g}, {inertia:.17g}]\n"
    for name, i in (("base", 2), ("tool", 3)):
        text += f'[[component]]\nname = "{name}"\nkind = "lumped"\ndofs = ["z"]\nmass = [[{mass[i, i]:.17g}]]\n'
        text += f"damping = [[{C[i, i]:.17g}]]\nstiffness = [[{K[i, i]:.17g}]]\n"
    for dof in ("ux", "uy", "rx", "rz"):
        text += f'[[connection]]\nname = "hold_{dof}"\nbetween = ["slide.{dof}", "ground"]\nrigid = true\n'
    sides = {
        "front": f'between = ["slide", "base.z"]\nat = [{front:.17g}, 0, 0]\ndirection = [0, 0, 1]',
        "rear": f'between = ["slide", "base.z"]\nat = [{rear:.17g}, 0, 0]\ndirection = [0, 0, 1]',
        "head": f'between = ["tool.z", "slide"]\nat = [{reach:.17g}, 0, 0]\ndirection = [0, 0, 1]',
    }
    joints = tuple(JointTruth(name, sides[name], rows[name], k[name], 0.0) for name in rows)
    dofs = {"slide.uz": np.eye(4)[0], "base.z": np.eye(4)[2], "tool.z": np.eye(4)[3]}
    return Plant(mass, K, C, joints, text, dofs, "tool.z")


def _lowest(mass: Array, K: Array, springs: list[tuple[float, Array]]) -> float:
    return float(_frequencies(mass, K, springs)[0])


def _frequencies(mass: Array, K: Array, springs: list[tuple[float, Array]]) -> Array:
    """rad/s, ascending."""
    whole = K + sum(k * np.outer(row, row) for k, row in springs)
    root = np.sqrt(np.diag(mass))
    return np.asarray(np.sqrt(np.linalg.eigvalsh(whole / root[:, None] / root)))


def _matrix(m: Array) -> str:
    return "[" + ", ".join("[" + ", ".join(f"{x:.17g}" for x in row) + "]" for row in m) + "]"


def _words(words: list[str]) -> str:
    return "[" + ", ".join(f'"{w}"' for w in words) + "]"


def draw(seed: int, altered: bool = True) -> Case:
    """The case of a seed; the same machine with nothing altered where ``altered`` is False."""
    rng = np.random.default_rng([seed, 77])
    plant = rocking(rng) if rng.random() < 0.25 else chain(rng)
    frequencies = _frequencies(plant.mass, plant.stiffness, [(j.stiffness, j.row) for j in plant.joints])
    middle = float(np.exp(np.mean(np.log(frequencies[:3]))))
    joints = [replace(j, damping=2 * rng.uniform(0.01, 0.035) * j.stiffness / middle) for j in plant.joints]
    plant = replace(plant, joints=tuple(joints))
    top = frequencies[min(len(frequencies) - 1, 3)] / 2 / np.pi
    lines = np.geomspace(0.55 * frequencies[0] / 2 / np.pi, 1.2 * top, int(rng.integers(110, 190)))
    lines = np.round(lines, 4)
    # The force that moves the joint that moves most by a few micrometres, were all joints straight.
    x = equivalent(plant.structure(), 2 * np.pi * lines, np.ones(len(lines)))
    reached = np.max(np.abs(x @ np.array([j.row for j in joints]).T), axis=0)
    largest = rng.uniform(4e-6, 9e-6) / float(np.max(reached))
    kinds = rng.choice(["linear", "cubic", "guide", "friction"], size=len(joints), p=[0.35, 0.25, 0.25, 0.15])
    kinds[int(np.argmax(reached))] = rng.choice(["cubic", "guide"])
    for i, (joint, kind) in enumerate(zip(joints, kinds, strict=True)):
        z = largest * float(reached[i])
        joints[i] = replace(joint, kind=str(kind), more=_shape(rng, str(kind), joint.stiffness, z, z * middle))
    plant = replace(plant, joints=tuple(joints))
    forces = np.geomspace(largest / rng.uniform(6, 25), largest, int(rng.integers(3, 6)))
    forces = np.array([float(f"{f:.4g}") for f in forces])
    others = [name for name in plant.dofs if name != plant.drive]
    responses = (plant.drive, str(rng.choice(others))) if rng.random() < 0.4 else (plant.drive,)
    sealed = int(rng.integers(1, len(forces))) if len(forces) > 3 and rng.random() < 0.5 else None
    case = Case(seed, plant, plant, None, "", 0.0, 0.0, lines, forces, responses, sealed)
    return _altered(case, largest * reached, middle, rng) if altered else case


def _shape(rng: np.random.Generator, kind: str, k: float, z: float, v: float) -> Mapping[str, float]:
    """What a joint that is not straight has beside its stiffness; z and v are its largest motion."""
    if kind == "cubic":
        return {"stiffness3": rng.uniform(0.03, 0.15) * k / z**2}
    if kind == "guide":
        # Rows part at 1.2 to 2.2 times z; K0 = 6 sin²φ P0/d0 with d0 = κ P0^(2/3).
        rest = rng.uniform(1.2, 2.2) * z * np.sin(np.pi / 4)
        preload = k * rest / 3
        return {"preload": preload, "kappa": rest / preload ** (2 / 3)}
    if kind == "friction":
        return {"slip_force": rng.uniform(0.01, 0.04) * k * z, "smoothing_velocity": rng.uniform(0.03, 0.08) * v}
    return {}


def _altered(case: Case, reached: Array, middle: float, rng: np.random.Generator) -> Case:
    """One joint is another than declared, by a size that matters in the responses."""
    base = _responses(case.declared, case)
    for _ in range(40):
        i = int(rng.integers(len(case.declared.joints)))
        joint = case.declared.joints[i]
        own = {"guide": ["preload"], "cubic": ["stiffness", "hardening"]}.get(joint.kind, ["stiffness"])
        hidden = [name for name in HIDDEN if not (name == "cubic" and joint.kind == "cubic")]
        what = str(rng.choice([*own, "damping"])) if rng.random() < 0.45 else str(rng.choice(hidden))
        way, shape = float(rng.choice([-1.0, 1.0])), int(rng.integers(2**31))
        wanted = float(np.exp(rng.uniform(*np.log(_CHANGE))))
        z = float(reached[i])

        made = partial(_with, joint, what, way, shape, z, middle)
        found = _sized(replace(case, place=joint.name, what=what), i, made, wanted, base)
        if found is not None:
            return found
    raise RuntimeError(f"seed {case.seed}: no alteration that matters")


def _sized(
    case: Case, index: int, made: Callable[[float], tuple[JointTruth, float]], wanted: float, base: ComplexArray
) -> Case | None:
    """The case with a joint altered so that responses change as wanted, or as its size allows; None if little."""

    def change(share: float) -> float:
        return _apart(_responses(case.declared.with_joint(index, made(share)[0]), case), base)

    most = change(1.0)
    if most < _CHANGE[0]:
        return None
    low, high = 0.0, 1.0
    for _ in range(6 if most > wanted else 0):
        share = 0.5 * (low + high)
        low, high = (low, share) if change(share) > wanted else (share, high)
    joint, size = made(high)
    return replace(case, actual=case.declared.with_joint(index, joint), size=size, change=change(high))


def _with(
    joint: JointTruth, what: str, way: float, shape: int, z: float, middle: float, share: float
) -> tuple[JointTruth, float]:
    """The joint with an alteration of a share of the largest size, and that size."""
    if what in HIDDEN:
        sign = (1.0 if way > 0 else -0.4) if what == "cubic" else 1.0
        size = sign * share * _LARGEST[what] * joint.stiffness * z
        term = HIDDEN[what](size, z, z * middle, np.random.default_rng(shape))
        return replace(joint, hidden=term), size
    factor = _LARGEST[what] ** (way * share)
    more = dict(joint.more or {})
    if what == "preload":
        more["preload"] *= factor
    elif what == "hardening":
        more["stiffness3"] *= factor
    else:
        return replace(joint, **{what: getattr(joint, what) * factor}), factor  # type: ignore[arg-type]
    return replace(joint, more=more), factor


def _responses(plant: Plant, case: Case) -> ComplexArray:
    """What equivalent linear joints would show, on every fourth line at the lowest, middle and largest force."""
    lines = 2 * np.pi * case.frequency[::4]
    forces = case.forces[[0, len(case.forces) // 2, -1]]
    x = equivalent(plant.structure(), np.tile(lines, 3), np.repeat(forces, len(lines)))
    pick = np.array([plant.dofs[name] for name in case.responses])
    return np.asarray((x / np.repeat(forces, len(lines))[:, None]) @ pick.T).reshape(3, len(lines), -1)


def _apart(a: ComplexArray, b: ComplexArray) -> float:
    return float(np.sqrt(np.mean(np.sum(np.abs(a - b) ** 2, axis=1) / np.sum(np.abs(b) ** 2, axis=1))))


@dataclass(frozen=True)
class Records:
    """Receptances [force, line, response] of a case in m/N, with and without noise, and the noise of each record."""

    exact: ComplexArray
    noisy: ComplexArray
    deviation: Array
    """[force, response], √(E|error|²)."""
    repeats: float
    """Largest change over the last periods, relative."""
    forces: Array | None = None
    """[force, line], N, where the force varies within a record."""


def measure(case: Case, decibel: float = DECIBEL, drifting: bool = False) -> Records:
    """Integrate, and add noise that is so many decibels below the rms of each record.

    ``drifting``: the machine is not quite the same from record to record, and the shaker gives what it can.
    """
    pick = np.array([case.actual.dofs[name] for name in case.responses])
    structure, omega = case.actual.structure(), 2 * np.pi * case.frequency
    forces = None
    if drifting:
        rng = np.random.default_rng([case.seed, 79])
        frequency, level = (s * rng.standard_normal(len(case.forces)) for s in (WARM, REGAINED))
        forces = case.forces[:, None] * _profile(case, rng)
        parts = [first_harmonics(structure, omega / (1 + d), F[None]) for d, F in zip(frequency, forces, strict=True)]
        H = np.concatenate([x @ pick.T for x, _ in parts]) / forces[:, :, None] * (1 + level)[:, None, None]
        repeats = max(worst for _, worst in parts)
    else:
        x, repeats = first_harmonics(structure, omega, case.forces)
        H = x @ pick.T / case.forces[:, None, None]
    rng = np.random.default_rng([case.seed, 78])
    deviation = np.sqrt(np.mean(np.abs(H) ** 2, axis=1)) * 10 ** (-decibel / 20)
    noise = (rng.standard_normal(H.shape) + 1j * rng.standard_normal(H.shape)) / np.sqrt(2)
    return Records(H, H + noise * deviation[:, None, :], deviation, repeats, forces)


def _profile(case: Case, rng: np.random.Generator) -> Array:
    """Force over the one that was asked for, (lines,): a shaker loses up to two fifths of it at the resonances."""
    x = equivalent(case.actual.structure(), 2 * np.pi * case.frequency, np.ones(len(case.frequency)))
    reach = np.abs(x @ case.actual.dofs[case.actual.drive])
    return np.asarray(1 - rng.uniform(0.2, 0.4) * reach / np.max(reach))


def machine_file(plant: Plant, case: Case) -> str:
    """The machine as declared, as a file."""
    text = 'schema = "jointlib/machine/1"\nname = "drawn"\n' + plant.components
    for joint in plant.joints:
        text += f'[[connection]]\nname = "{joint.name}"\n{joint.sides}\njoint = {joint.laws()}\n'
    low, high = case.frequency[0], case.frequency[-1]
    text += f'[tool]\nx = "{plant.drive}"\n[response]\nforce = {[float(f) for f in case.forces]}\n'
    return text + f"frequency = [{low:.6g}, {high:.6g}]\n"


def write(case: Case, records: Records, folder: Path) -> tuple[Path, Path]:
    """The machine file and the measurement file, with a CSV per force and response."""
    machine, measurement = folder / "machine.toml", folder / "test.measurement.toml"
    machine.write_text(machine_file(case.declared, case))
    text = 'schema = "jointlib/measurement/1"\nkind = "frf"\nsimulated = true\n'
    for i, force in enumerate(case.forces):
        for r, response in enumerate(case.responses):
            name, H = f"{response.replace('.', '_')}_{i}.csv", records.noisy[i, :, r]
            columns, header = [case.frequency, H.real, H.imag], "frequency,re,im"
            if records.forces is not None:
                columns, header = [*columns, records.forces[i]], f"{header},force [N]"
            np.savetxt(folder / name, np.column_stack(columns), "%.9g", ",", header=header, comments="")
            role = "sealed" if i == case.sealed else "fit"
            text += f'[[record]]\nfile = "{name}"\ndrive = "{case.declared.drive}"\nresponse = "{response}"\n'
            text += f'quantity = "receptance"\nforce = {float(force)!r}\nrole = "{role}"\n'
    measurement.write_text(text)
    return machine, measurement
