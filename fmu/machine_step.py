"""The joints of a run that are more than springs and dampers, and the machine, whole and in parts, as verified FMUs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from jointlib.errors import InputError
from machines.road.joints import first_like
from machines.road.piece import Piece, Step, open_joints

if TYPE_CHECKING:
    from jointlib.joint import Joint
    from machines import Machine
    from machines.road.run import Run

    from .export import Export
    from .ssp import SspExport


def exporting_pieces(machine: Machine, amplitudes: Sequence[float] = ()) -> list[Piece]:
    """Every joint that was identified or is nonlinear, once; then the machine as one FMU, and as a system of FMUs."""
    pieces = []
    for c in machine.connections:
        bent = c.joint is not None and not is_plain(c.joint) and first_like(machine, c.name) == c.name
        if c.identify is not None or bent:
            needs = () if c.identify is None else (f"identify {c.name}",)
            remedy = "`jointlib fmu JOINT -o X.fmu` repeats it alone; `jointlib doctor` says what this computer can do."
            pieces.append(Piece("fmu", f"{c.name} as an FMU", partial(_export, name=c.name), remedy, c.name, needs))
    every = open_joints(machine)
    for step, title, take in (
        ("machine fmu", "The machine as an FMU", _whole),
        ("ssp", "The machine as an SSP", _parts),
    ):
        verb = "fmu" if take is _whole else "ssp"
        remedy = f"`jointlib {verb} MACHINE -o {_FILES[verb]}` repeats it alone, with the joints of this run put in."
        pieces.append(Piece(step, title, take, remedy, "", every))
    return pieces


def is_plain(joint: Joint) -> bool:
    """Whether a joint is linear: not worth an FMU of its own, as a spring and a damper are two numbers of the file."""
    return all(law.linear for law in joint.laws)


_FILES = {"fmu": "machine.fmu", "ssp": "machine.ssp"}


def _whole(road: Run) -> None:
    from .export import export_fmu

    plain = [c.name for c in road.machine.flexible if c.name not in road.shown and c.joint and is_plain(c.joint)]
    said = "Joints of the file that are linear are in it alone: `jointlib fmu JOINT -o X.fmu` exports the file of one."
    _written(road, "machine fmu", "The machine as an FMU", _FILES["fmu"], export_fmu, [said] if plain else [])


def _parts(road: Run) -> None:
    from .ssp import export_ssp

    _written(road, "ssp", "The machine as a system of FMUs", _FILES["ssp"], export_ssp)


def _written(
    road: Run,
    step: str,
    title: str,
    name: str,
    export: Callable[[Machine, Path], Export | SspExport],
    beside: Sequence[str] = (),
) -> None:
    """The machine with the joints of the run, in one of the two forms, and what is to be said ``beside`` it."""
    from machines.report import Section, Table

    try:
        with road.progress.step(f"exporting {title[0].lower()}{title[1:]} and verifying it"):
            done = export(road.machine, road.folder / name)
    except InputError as error:
        # What a machine is may forbid it: that is known beforehand, and no failure of the run.
        road.said += [f"{title} is not exported: {said}." for said in error.sentences]
        road.sections.append(Section(title, [f"It is not exported: {said}." for said in error.sentences]))
        return
    path = road.path(name)
    # One FMU is integrated inside, whatever the step; between several it decides.
    limit = "largest co-simulation step" if step == "ssp" else "co-simulation step that it proposes"
    rows = [
        ("file", path.name),
        ("platforms", ", ".join(done.platforms)),
        ("verified with", ", ".join(done.verified_with)),
        (limit, "none is safe" if done.max_step is None else f"{done.max_step * 1e6:.3g} µs"),
    ]
    road.steps.append({"step": step, "max_step": done.max_step, "file": path.name})
    road.said.append(f"{path.name}: verified with {', '.join(done.verified_with)}")
    road.sections.append(Section(title, [*done.messages, *beside], (), [Table(("", ""), rows)]))


def _export(road: Run, name: str) -> None:
    from machines.report import Section, Table

    from .export import export_fmu

    target = road.folder / f"{name}.fmu"
    try:
        with road.progress.step(f"exporting {name} as an FMU and verifying it"):
            done = export_fmu(road.joint(name), target)
    except InputError as error:
        # What a joint is may forbid it: that is known beforehand, and no failure of the run.
        road.warnings.append(f"{name} is not exported as an FMU: {error}.")
        road.said.append(road.warnings[-1])
        return
    road.exports[name] = done
    path = road.path(target.name)
    step = "none is safe" if done.max_step is None else f"{done.max_step * 1e6:.3g} µs"
    rows = [
        ("file", path.name),
        ("runtime", done.runtime),
        ("platforms", ", ".join(done.platforms)),
        ("verified with", ", ".join(done.verified_with)),
        ("largest co-simulation step", step),
    ]
    road.steps.append({"step": "fmu", "joint": name, "max_step": done.max_step, "file": path.name})
    road.said.append(f"{path.name}: verified with {', '.join(done.verified_with)}")
    text = ["It was validated and replayed its reference run before it was written.", *done.messages]
    road.sections.append(Section(f"{name} as an FMU", text, (), [Table(("", ""), rows)], kind="Joints as FMUs"))


STEP = Step("fmu", exporting_pieces, after=("cutting",))
