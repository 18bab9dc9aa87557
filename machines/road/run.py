"""The whole road for a machine: its steps taken one after the other, what they leave, and the report made of it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

from jointlib import write_joint
from jointlib.answers.given import Quantities, several
from jointlib.identification import Identification
from jointlib.io.atomic import sha256, write_text
from jointlib.joint import Joint
from jointlib.loop.answer.head import assumptions_of, inputs_of, trace_numbers
from jointlib.loop.answer.report import TraceReport
from jointlib.measurement import Measurement
from jointlib.shown.json_values import plain
from jointlib.shown.progress import Progress, Silent
from jointlib.shown.result import Columns, Shown

from ..cutting.amplitude.pocket import Pocket
from ..cutting.process.chart import StabilityLobes, draw_charts
from ..cutting.rest.chart_file import default_speeds
from ..files.opened import machine_of, tool_names
from ..forced_response.response import Response
from ..harmonic_balance.linear_check import LinearCheck
from ..model.machine import Machine
from ..ranges import LARGEST_AMPLITUDE
from ..report.page import Page, Section, gathered
from .each_tool import ToolLobes
from .mistakes import beside
from .open_joints import look_ahead
from .piece import Piece, Step, chosen_steps, walk

AMPLITUDES = (0.0, 2e-6, 5e-6, 10e-6)
"""Tool-point amplitudes of the lobes in m where none are given; onset first."""


def run(
    machine: Machine | Path | str,
    folder: Path | str,
    progress: Progress | None = None,
    steps: Sequence[Step | str] | None = None,
    *,
    amplitudes: Quantities = AMPLITUDES,
    command: str = "",
    tool: str | None = None,
) -> Run:
    """The whole road for a machine: identify, trace, mend, couple, check, cut, export, and one report in ``folder``.

    What fails leaves its reason and a section of the report, and ends nothing else.

    Parameters
    ----------
    machine
        As read, or the path of its file.
    progress
        Told of every part that takes long.
    steps
        The steps to take, in this order: those that `machines.steps` lists or steps of one's own, an installed one also
        by its name. All that are installed where none are given.
    amplitudes
        Of the tool point, m or with units, at which lobes are computed.
    command
        What the report says made it.
    tool
        Which of several named tools is in the machine; none: that of the file, and what each of them cuts beside it.
    """
    taken = chosen_steps(steps)
    model, sizes = (
        machine_of(machine, tool),
        tuple(sorted(several(amplitudes, "m", "amplitudes", 0, LARGEST_AMPLITUDE))),
    )
    look_ahead(model)
    if model.cutting is not None and any(step.name == "cutting" for step in taken):
        default_speeds(model)
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    made = Run(model, target, progress or Silent(), command or f"machines.run({str(model.source)!r}, {str(folder)!r})")
    made.tools = tool_names(machine, tool)
    made.warnings += model.remarks()
    if bare := ", ".join(model.without_equations):
        made.warnings.append(f"Only FRFs are known of {bare}: not checked against python-control.")
    walk([piece for step in taken for piece in step.pieces(model, sizes)], made)
    made.data = made.close()
    return made


@dataclass(repr=False)
class Run(Shown):
    """What a run has found, step by step."""

    machine: Machine
    """With its joints as they are used, identified and mended."""
    folder: Path
    progress: Progress
    command: str
    data: dict[str, Any] = field(default_factory=dict)
    """What ``jointlib run --json`` prints: ``steps``, ``report``, ``verdict``, errors before and after."""
    identifications: dict[str, Identification] = field(default_factory=dict)
    """By connection."""
    check: LinearCheck | None = None
    """Against python-control."""
    responses: list[Response] = field(default_factory=list)
    """Forced response, one per direction of the tool."""
    exports: dict[str, Any] = field(default_factory=dict)
    """Of joints that were exported: what the export says of itself."""
    steps: list[dict[str, Any]] = field(default_factory=list)
    front: list[Section] = field(default_factory=list)
    """Sections that a reader wants first: lobes, then responses."""
    sections: list[Section] = field(default_factory=list)
    behind: list[Section] = field(default_factory=list)
    """Sections on what the file gave: joints that nothing was identified of."""
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
    near_pocket: dict[float, str] = field(default_factory=dict)
    """What is known where a chart would take too long, by amplitude in m: the limit near the recommended speed."""
    pocket: Pocket | None = None
    """The cut that is recommended."""
    tools: tuple[str, ...] = ()
    """Tools of the file to be compared, by name."""
    tool_lobes: tuple[ToolLobes, ...] = ()
    """What each of them cuts, for small vibrations."""

    def finding(self) -> str:
        """What to set, else what was found, and what was not computed."""
        first = [*self.advice, *self._found()][0]
        return f"{first}\nnot computed: {', '.join(self.failed)}" if self.failed else first

    def columns(self) -> Columns:
        """A row per step: of which joint or part, and why it failed where it did."""
        return {
            "step": ([step["step"] for step in self.steps], ""),
            "of": ([step.get("joint", step.get("of", "")) for step in self.steps], ""),
            "failed": ([step.get("failed", "") for step in self.steps], ""),
        }

    def plot(self, ax: Any = None) -> Any:
        """The stability lobes by amplitude of the tool; the response where there are none, else the machine."""
        if not self.charts:
            return self.responses[0].plot(ax) if self.responses else self.machine.plot(ax)
        return draw_charts(self.charts.items(), ax)

    def joint(self, name: str) -> Joint:
        """The joint of a connection as it is used by now."""
        found = next(c.joint for c in self.machine.connections if c.name == name)
        assert found is not None
        return found

    def use(self, name: str, joint: Joint) -> None:
        """Put a joint into the machine, and write it as the one that is used from here on."""
        write_joint(self.path(f"{name}.joint.toml"), joint)
        self.machine = self.machine.with_joint(name, joint)

    def lost(self, piece: Piece, why: str, unexpected: bool = False) -> None:
        """A piece that failed: its reason in the steps, a section that says why and what to do."""
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
            sections=gathered(beside([*self.front, *self.sections, *self.behind], self.mistakes)),
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
        write_text(self.path(name), json.dumps(plain(data), indent=1, allow_nan=False) + "\n")
