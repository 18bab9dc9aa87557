"""The joints of a run: identified from their records, doubted, mended, described."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from .piece import Piece, Step

if TYPE_CHECKING:
    from jointlib.joint import Joint
    from jointlib.loop.answer.report import TraceReport

    from .. import Machine
    from .run import Run

_AGAIN = 2
"""Most further traces of a joint from the output of the one before."""


def joint_pieces(machine: Machine, amplitudes: Sequence[float] = ()) -> list[Piece]:
    """Every joint that the machine file leaves open is identified and traced; every joint is described."""
    pieces = []
    for connection in machine.connections:
        name, given = connection.name, connection.identify
        if given is not None:
            records = " ".join(str(path) for path in given.records)
            pieces += [
                Piece(
                    "identify",
                    f"Identification of {name}",
                    partial(_identify, name=name),
                    f"`jointlib inspect` tells what each of its records holds: {records}. Or name a joint file in the "
                    "machine file, `joint` instead of `identify`.",
                    name,
                ),
                Piece(
                    "trace",
                    f"What {name} leaves unexplained",
                    partial(_close_the_loop, name=name),
                    f"What follows uses {name} as identified. `jointlib trace MEASUREMENT --joint "
                    f"{name}.identified.joint.toml -o DIR` repeats this step alone.",
                    name,
                    (f"identify {name}",),
                ),
            ]
        elif connection.joint is None or first_like(machine, name) != name:
            continue
        pieces.append(
            Piece(
                "df",
                f"Describing function of {name}",
                partial(_describe, name=name),
                "`jointlib df JOINT --amplitude A --frequency F` computes it alone.",
                name,
                () if given is None else (f"identify {name}",),
            )
        )
    return pieces


def first_like(machine: Machine, name: str) -> str:
    """The first connection that carries the same joint as this one, so that nothing is drawn or exported twice."""
    laws = {c.name: c.joint.laws for c in machine.connections if c.joint is not None}
    return next(other for other, same in laws.items() if same == laws[name])


def _identify(road: Run, name: str) -> None:
    from jointlib import identify, read_joint, read_measurement, write_joint
    from jointlib.identification.summary import identified
    from jointlib.units import with_error

    from ..report.sections import identification_section

    given = next(c.identify for c in road.machine.connections if c.name == name)
    assert given is not None
    tests = [read_measurement(path) for path in given.records]
    road.tests += tests
    road.starts += [] if given.start is None else [given.start]
    with road.progress.step(f"identifying {name} from {', '.join(t.source.name for t in tests)}"):
        found = identify(tests, start=None if given.start is None else read_joint(given.start))
    road.assumptions += [
        f"{name}: {key} = {with_error(p.value, 0.0, p.unit)}, no record tells it."
        for key, p in found.parameters.items()
        if p.status == "assumed"
    ]
    write_joint(road.path(f"{name}.identified.joint.toml"), found.joint)
    road.json(f"{name}.identified.json", identified(found))
    road.identifications[name] = found
    road.use(name, found.joint)
    road.shown[name] = {"as identified": found.joint}
    errors = {e.measurement: e.rms for e in found.errors}
    road.steps.append({"step": "identify", "joint": name, "rms": errors, "messages": list(found.messages)})
    road.sections.append(identification_section(found, any(t.simulated for t in tests)))


def _close_the_loop(road: Run, name: str) -> None:
    """Trace on each test of motion; while something is named, go on from what was written, as a user would."""
    from jointlib import read_measurement, trace
    from jointlib.loop.answer.report import Verdict

    given = next(c.identify for c in road.machine.connections if c.name == name)
    assert given is not None
    joint = road.joint(name)
    for path in given.records:
        test = next(t for t in road.tests if t.source == path)
        if test.kind not in ("rig", "path"):
            continue
        with road.progress.step(f"tracing what {name} leaves unexplained of {test.source.name}"):
            report = trace(test, joint)
        road.traces[name] = report
        _keep(road, name, report)
        road.steps.append({"step": "trace", "joint": name, "verdict": report.verdict.value})
        joint = _mended(road, name, report)
        for _ in range(_AGAIN):
            if report.verdict not in (Verdict.IDENTIFIED, Verdict.AMBIGUOUS):
                break
            mended = road.folder / f"{name}.trace" / "measurement.toml"
            test = read_measurement(mended) if report.corrections else test
            with road.progress.step(f"tracing {name} again from there"):
                report = trace(test, joint)
            road.said.append(f"traced again from there: {report.verdict.value}")
            road.steps.append({"step": "trace again", "joint": name, "verdict": report.verdict.value})
            if report.verdict in (Verdict.IDENTIFIED, Verdict.AMBIGUOUS):
                _keep(road, name, report)
                joint = _mended(road, name, report)


def _keep(road: Run, name: str, report: TraceReport) -> None:
    """Write a trace, tell its words and add its section."""
    from jointlib.loop.answer.words import words
    from jointlib.loop.close import write_trace

    from ..report.sections import trace_section

    road.written += [p for p in write_trace(report, road.folder / f"{name}.trace") if p not in road.written]
    road.said += words(report)
    road.warnings += report.warnings
    section = trace_section(report)
    road.sections.append(replace(section, text=[*section.text, report.sentence]))


def _mended(road: Run, name: str, report: TraceReport) -> Joint:
    road.use(name, report.mended)
    road.shown[name] |= {"mended": report.mended}
    return report.mended


def _describe(road: Run, name: str) -> None:
    """Describing functions; the last joint is the one that is used."""
    from jointlib.describing import DescribingFunction

    from ..report.sections import gain_section

    joints = road.shown.get(name) or {"as given": road.joint(name)}
    low, high = road.machine.frequency or (100.0, 1000.0)
    frequency = np.array([low, (low * high) ** 0.5, high])
    *earlier, used = joints.values()
    A = np.geomspace(0.01, 1.0, 40) * used.validity.get("amplitude", (0.0, 5e-6))[1]
    data: dict[str, Any] = {"amplitude": A, "frequency": frequency}
    for word, joint in (("", used), *(("_as_identified", j) for j in earlier)):
        G = DescribingFunction(joint)(A[:, None], 2 * np.pi * frequency)
        data |= {f"gain_real{word}": G.real, f"gain_imag{word}": G.imag}
    road.json(f"{name}.df.json", data)
    road.steps.append({"step": "df", "joint": name})
    section = gain_section(name, joints, float(frequency[1]), (low, high))
    (road.sections if name in road.shown else road.behind).append(section)


STEP = Step("joints", joint_pieces, after=())
