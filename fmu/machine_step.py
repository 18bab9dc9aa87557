"""The joints of a run as verified FMUs."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

from jointlib.errors import InputError
from machines.road.joints import first_like
from machines.road.piece import Piece, Step

if TYPE_CHECKING:
    from machines import Machine
    from machines.road.run import Run


def exporting_pieces(machine: Machine, amplitudes: Sequence[float] = ()) -> list[Piece]:
    """Every joint, once."""
    pieces = []
    for c in machine.connections:
        if c.identify is not None or (c.joint is not None and first_like(machine, c.name) == c.name):
            needs = () if c.identify is None else (f"identify {c.name}",)
            remedy = "`jointlib fmu JOINT -o X.fmu` repeats it alone; `jointlib doctor` says what this computer can do."
            pieces.append(Piece("fmu", f"{c.name} as an FMU", partial(_export, name=c.name), remedy, c.name, needs))
    return pieces


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
    road.sections.append(Section(f"{name} as an FMU", text, (), [Table(("", ""), rows)]))


STEP = Step("fmu", exporting_pieces, after=("cutting",))
