"""The road of a run: what its pieces have left so far, and the report that is made of it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jointlib.cli.output import Steps
from jointlib.cli.steps.coupling import coupling_pieces
from jointlib.cli.steps.cutting import cutting_pieces
from jointlib.cli.steps.exporting import exporting_pieces
from jointlib.cli.steps.joints import joint_pieces
from jointlib.cli.steps.mistakes import beside, mistake_pieces
from jointlib.cli.steps.picture import picture_pieces
from jointlib.cli.steps.piece import Piece

if TYPE_CHECKING:
    from jointlib.joint import Joint
    from jointlib.loop.answer.report import TraceReport
    from jointlib.measurement import Measurement
    from machines import Machine, StabilityLobes
    from machines.report import Section


def pieces_of(machine: Machine, amplitudes: Sequence[float]) -> list[Piece]:
    """The whole road for a machine, with lobes at each tool-point amplitude in m."""
    joints = joint_pieces(machine)
    needs = tuple(piece.name for piece in joints if piece.step == "identify")
    cut = [] if machine.cutting is None else cutting_pieces(machine, needs, amplitudes)
    return [
        *joints,
        *mistake_pieces(machine, needs),
        *picture_pieces(machine, needs),
        *coupling_pieces(machine, needs),
        *cut,
        *exporting_pieces(machine),
    ]


@dataclass
class Road:
    """What a run has found so far."""

    machine: Machine
    folder: Path
    progress: Steps
    command: str
    steps: list[dict[str, Any]] = field(default_factory=list)
    front: list[Section] = field(default_factory=list)
    """Sections that a reader wants first: lobes, then responses."""
    sections: list[Section] = field(default_factory=list)
    advice: list[str] = field(default_factory=list)
    """What the one who sets the machine wants to know, in the order of weight."""
    numbers: list[tuple[str, str]] = field(default_factory=list)
    """The figures of the advice, the one that the doubts concern first."""
    doubts: list[str] = field(default_factory=list)
    """Warnings that bear on the advice."""
    mistakes: tuple[str, ...] = ()
    """What looks wrong in the machine file, a sentence each."""
    said: list[str] = field(default_factory=list)
    """What was found on the way."""
    warnings: list[str] = field(default_factory=list)
    failed: list[str] = field(default_factory=list)
    written: list[Path] = field(default_factory=list)
    assumptions: list[str] = field(default_factory=list)
    tests: list[Measurement] = field(default_factory=list)
    starts: list[Path] = field(default_factory=list)
    traces: dict[str, TraceReport] = field(default_factory=dict)
    shown: dict[str, dict[str, Joint]] = field(default_factory=dict)
    """Of a joint that was identified: as it was, and mended."""
    charts: dict[float, StabilityLobes] = field(default_factory=dict)
    """Stability lobes by tool-point amplitude in m."""

    def joint(self, name: str) -> Joint:
        """The joint of a connection as it is used by now."""
        found = next(c.joint for c in self.machine.connections if c.name == name)
        assert found is not None
        return found

    def use(self, name: str, joint: Joint) -> None:
        """Put a joint into the machine, and write it as the one that is used from here on."""
        from jointlib import write_joint

        write_joint(self.path(f"{name}.joint.toml"), joint)
        self.machine = self.machine.with_joint(name, joint)

    def lost(self, piece: Piece, why: str, unexpected: bool = False) -> None:
        """A piece that failed: its reason in the steps, a section that says why and what to do."""
        from machines.report import Section

        where = {"joint": piece.of} if piece.step in ("identify", "trace", "df", "fmu") else {}
        where |= {"of": piece.of} if piece.of and not where else {}
        remedy = piece.remedy
        if unexpected:
            remedy = f"That is a fault of the program: please report it with the machine file. {remedy}"
        self.steps.append({"step": piece.step, **where, "failed": why, "remedy": remedy})
        self.failed.append(f"{piece.title}: {why}")
        text = [f"{why[0].upper()}{why[1:]}{'' if why.endswith('.') else '.'}", remedy]
        self.sections.append(Section(f"{piece.title}: not computed", text))

    def close(self) -> dict[str, Any]:
        """Write the report and the summary, and return the promised keys."""
        from importlib.metadata import version

        from jointlib.cli.told.trace_head import assumptions_of, inputs_of, trace_numbers
        from jointlib.io.atomic import sha256
        from machines.report import Page

        main = next(iter(self.traces.values()), None)
        first, *answers = [*self.advice, *self._found()]
        answers += [] if self.numbers else [f"Looks wrong: {said}" for said in self.mistakes]
        source, mean = self.machine.source, "zero mean" if self.machine.static is None else "means in static balance"
        inputs = [(file.name, sha256(file)) for file in ([] if source is None else [source]) + self.starts]
        Page(
            title=f"{self.machine.name}: joints, response and stability",
            finding=first,
            answers=answers,
            lost=self.failed,
            numbers=[*self.numbers, *(trace_numbers(main) if main else [])],
            doubts={self.numbers[0][0]: self.doubts} if self.numbers else {},
            sections=beside([*self.front, *self.sections], self.mistakes),
            inputs=[*inputs, *inputs_of(self.tests)],
            assumptions=[
                *assumptions_of(self.tests),
                *self.assumptions,
                f"Joints are replaced by their describing functions: one harmonic, {mean}.",
                "Bodies and modes are linear; the tool point is reached along the axes named in the machine file.",
            ],
            warnings=list(dict.fromkeys([*self.doubts, *self.warnings])),
            command=self.command,
            version=version("jointlib"),
        ).write(self.path("report.html"))
        data = {
            "steps": self.steps,
            "report": str(self.folder / "report.html"),
            "verdict": main.verdict.value if main else None,
            "error_before": main.error_before["relative"] if main else None,
            "error_after": main.error_after["relative"] if main else None,
        }
        self.json("run.json", data)
        return data

    def _found(self) -> list[str]:
        """What the loop found, joint by joint."""
        if any(connection.identify is not None for connection in self.machine.connections) or self.traces:
            return [report.sentence for report in self.traces.values()] or ["Nothing was found of the joints."]
        return ["Every joint was given; nothing was identified."]

    def path(self, name: str) -> Path:
        """A file in the folder, noted among those written."""
        path = self.folder / name
        self.written += [] if path in self.written else [path]
        return path

    def json(self, name: str, data: dict[str, Any]) -> None:
        """Write values as JSON."""
        from jointlib.io.atomic import write_text
        from jointlib.loop.answer.report import plain

        write_text(self.path(name), json.dumps(plain(data), indent=1, allow_nan=False) + "\n")
