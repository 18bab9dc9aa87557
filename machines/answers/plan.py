"""What to measure so that effects can be told apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from jointlib.answers.given import File, Quantity, joint_of, measurement_of, one
from jointlib.errors import InputError
from jointlib.io.atomic import given_target
from jointlib.io.toml_file import schema_of
from jointlib.measurement import Measurement
from jointlib.planning.noise import noise_of
from jointlib.planning.plan import SIZE, Plan, plan_rig
from jointlib.planning.setup import RIG_CHANNELS, setup_of
from jointlib.planning.told import as_json, sentences
from jointlib.planning.written import write_plan
from jointlib.shown.pictures import axes_of
from jointlib.shown.progress import Progress, Silent
from jointlib.shown.result import Columns, Shown

from ..files.opened import machine_of
from ..planning.plan import SIZE as MACHINE_SIZE
from ..planning.plan import MachinePlan, plan_machine
from ..planning.probe import bench_of
from ..planning.told import as_json as machine_as_json
from ..planning.told import sentences as machine_sentences
from ..planning.written import write_plan as write_machine_plan
from ..road.open_joints import with_joints


@dataclass(frozen=True, eq=False, repr=False)
class RigPlan(Shown):
    """The test of a rig that decides, what it leaves open, and the files of it."""

    plan: Plan
    files: tuple[Path, ...]

    def finding(self) -> str:
        """The test and what it decides."""
        return " ".join(sentences(self.plan))

    def columns(self) -> Columns:
        """A row per effect in question: what it is told from, and what stays beside it."""
        return _columns(self.plan)

    def plot(self, ax: Any = None) -> Any:
        """What may be named (across) where an effect is hidden (down)."""
        return _drawn(self.plan, ax)

    def as_json(self) -> dict[str, Any]:
        """What ``jointlib plan --json`` prints."""
        return {**as_json(self.plan), "files": [str(p) for p in self.files]}

    def words(self) -> list[str]:
        """What ``jointlib plan`` prints."""
        return sentences(self.plan)


@dataclass(frozen=True, eq=False, repr=False)
class MachineTest(Shown):
    """The frequency responses of a machine that decide, what they leave open, and the files of them."""

    plan: MachinePlan
    files: tuple[Path, ...]

    def finding(self) -> str:
        """The test and what it decides."""
        return " ".join(machine_sentences(self.plan))

    def columns(self) -> Columns:
        """A row per effect in question: what it is told from, and what stays beside it."""
        return _columns(self.plan)

    def plot(self, ax: Any = None) -> Any:
        """What may be named (across) where an effect is hidden (down)."""
        return _drawn(self.plan, ax)

    def as_json(self) -> dict[str, Any]:
        """What ``jointlib plan --json`` prints."""
        return {**machine_as_json(self.plan), "files": [str(p) for p in self.files]}

    def words(self) -> list[str]:
        """What ``jointlib plan`` prints."""
        return machine_sentences(self.plan)


def _columns(plan: Plan | MachinePlan) -> Columns:
    told = plan.decides
    return {
        "effect": (list(told), ""),
        "told from": ([", ".join(told[e]) for e in told], ""),
        "beside": ([", ".join(sorted(plan.ends[e] - {e})) for e in told], ""),
        "size": ([plan.sizes[e] for e in told], ""),
    }


def _drawn(plan: Plan | MachinePlan, ax: Any) -> Any:
    axes = axes_of(ax)
    hidden = list(plan.ends)
    named = sorted({n for ends in plan.ends.values() for n in ends})
    axes.imshow(np.array([[n in plan.ends[h] for n in named] for h in hidden]), cmap="Greys", vmin=0, vmax=1.5)
    axes.set_xticks(range(len(named)), named, rotation=60, ha="right")
    axes.set_yticks(range(len(hidden)), [h or "nothing" for h in hidden])
    axes.set(xlabel="named", ylabel="hidden")
    return axes


def plan(
    file: File,
    *,
    rig: Measurement | File | None = None,
    effects: Sequence[str] = (),
    noise: Sequence[str] = (),
    amplitude: Quantity | None = None,
    force: Quantity | None = None,
    size: str | None = None,
    rate: Quantity | None = None,
    seed: int = 0,
    folder: File,
    tool: str | None = None,
    progress: Progress | None = None,
) -> RigPlan | MachineTest:
    """Say which test of a joint or machine decides between the effects in question, and write it: ``jointlib plan``.

    Parameters
    ----------
    file
        The file of a joint, which a rig is planned for, or of a machine, whose joints frequency responses are planned
        for.
    rig
        A measurement of a rig like the one that is there, whose records are not opened; None: one is assumed, and said.
    effects
        Families of the catalogue, members of one, or faults; none: everything that a joint may lack.
    noise
        Rms of a sample with its unit, as ``"0.02 m/s^2"``, ``"P=0.1 N"`` or ``"60 dB"``.
    amplitude
        How far the joint may be moved, m or with its unit; None: as far as it is valid, or short of lift-off.
    force
        Of a machine: the largest that is safe, N or with its unit; None: that of its file.
    size
        Share of the joint force from which an effect counts, 2 % by default; of a machine's response, 5 %.
    rate
        Sample rate, Hz or with its unit; None: that of ``rig``, or as the joint asks.
    seed
        Of phases, noise and what is hidden.
    folder
        Where the files are written; it must be new or empty.
    tool
        Which of several named tools is in the machine.
    progress
        Told of every part.
    """
    target = given_target(folder, where="-o", folder=True) or Path(folder)
    if target.exists() and any(not path.name.startswith(".") for path in target.iterdir()):
        raise InputError(f"-o {target}: the folder is not empty, expected a new one")
    path = Path(file)
    if _kind(path) == "machine":
        return _of_machine(
            path, rig, effects, noise, amplitude, rate, force, _share(size, MACHINE_SIZE), seed, target, tool, progress
        )
    for word, of_machine in (("--force", force), ("--tool", tool)):
        if of_machine is not None:
            raise InputError(f"{word}: given with a joint, expected with a machine alone")
    share = _share(size, SIZE)
    joint = joint_of(path)
    declared = None if rig is None else measurement_of(rig)
    if declared is not None and declared.kind != "rig":
        raise InputError(f"{declared.source}: kind is {declared.kind!r}, expected a rig")
    sizes, decibel = noise_of(noise, RIG_CHANNELS)
    reach, hertz = one(amplitude, "m", "amplitude", 0.0), one(rate, "Hz", "rate", 0.0)
    setup = setup_of(joint, declared, sizes, reach, hertz, decibel)
    found = plan_rig(setup, joint, effects, share, seed, progress or Silent())
    return RigPlan(found, write_plan(found, target, str(path)))


def _of_machine(
    file: Path,
    rig: Measurement | File | None,
    effects: Sequence[str],
    noise: Sequence[str],
    amplitude: Quantity | None,
    rate: Quantity | None,
    force: Quantity | None,
    size: float,
    seed: int,
    folder: Path,
    tool: str | None,
    progress: Progress | None,
) -> MachineTest:
    for word, given in (("--rig", rig), ("--amplitude", amplitude), ("--rate", rate)):
        if given is not None:
            raise InputError(f"{word}: given with a machine, expected with a joint alone")
    sizes, decibel = noise_of(noise, {"response": "m/N"})
    below = None if decibel is None else float(10 ** (-decibel / 20))
    model, _ = with_joints(machine_of(file, tool))
    bench = bench_of(model, one(force, "N", "force", 0.0), below, sizes.get("response"))
    found = plan_machine(bench, effects, size, seed, progress or Silent())
    return MachineTest(found, write_machine_plan(found, folder, str(file)))


def _kind(file: Path) -> str:
    """The kind that a file declares."""
    if not file.is_file():
        raise InputError(f"{file}: a folder, expected a file" if file.is_dir() else f"{file}: no such file")
    parts = schema_of(file).split("/")
    kind = parts[1] if len(parts) == 3 else "joint"
    if kind not in ("joint", "machine"):
        raise InputError(f"{file}: a {kind}, expected a joint or a machine")
    return kind


def _share(text: str | None, default: float) -> float:
    """``2%`` or ``0.02``."""
    if text is None:
        return default
    number = text.strip().removesuffix("%")
    try:
        found = float(number) / (100 if text.strip().endswith("%") else 1)
    except ValueError:
        raise InputError(f"--size: {text!r}, expected a share as 2%") from None
    if not 1e-4 <= found <= 0.3:
        raise InputError(f"--size: {text!r}, expected 0.01% to 30%")
    return found
