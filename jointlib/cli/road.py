"""The road of a run: one method a step, and what the steps leave for the report."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from jointlib.cli.output import Steps
from jointlib.errors import InputError

if TYPE_CHECKING:
    from jointlib.joint import Joint
    from jointlib.loop.report import TraceReport
    from jointlib.measurement import Measurement
    from machines import Machine
    from machines.report import Section


_AGAIN = 2
"""Most further traces of a joint from the output of the one before."""


@dataclass
class Road:
    """The steps of a run and what they have left so far."""

    machine: Machine
    folder: Path
    progress: Steps
    command: str
    steps: list[dict[str, Any]] = field(default_factory=list)
    sections: list[Section] = field(default_factory=list)
    said: list[str] = field(default_factory=list)
    written: list[Path] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    failed: list[str] = field(default_factory=list)
    tests: list[Measurement] = field(default_factory=list)
    traces: dict[str, TraceReport] = field(default_factory=dict)
    numbers: list[tuple[str, str]] = field(default_factory=list)
    advice: list[str] = field(default_factory=list)
    assumptions: list[str] = field(default_factory=list)
    starts: list[Path] = field(default_factory=list)

    def joints(self) -> None:
        """Identify every joint that the machine file leaves open and close the loop on it; describe every joint."""
        for connection in self.machine.connections:
            if connection.identify is not None:
                self._joint(connection.name, connection.identify)
            elif connection.joint is not None and self._first(connection.name) == connection.name:
                self._gains(connection.name, {"as given": connection.joint})

    def _first(self, name: str) -> str:
        """The first connection that carries the same joint as this one, so that nothing is drawn or exported twice."""
        laws = {c.name: c.joint.laws for c in self.machine.connections if c.joint is not None}
        return next(other for other, same in laws.items() if same == laws[name])

    def _joint(self, name: str, identify_from: Any) -> None:
        from jointlib import identify, read_joint, read_measurement, trace, write_joint
        from jointlib.cli.identify import identified
        from jointlib.loop.report import Verdict
        from jointlib.units import with_error
        from machines.report.sections import identification_section

        tests = [read_measurement(path) for path in identify_from.records]
        self.tests += tests
        with self.progress.step(f"identifying {name} from {', '.join(t.source.name for t in tests)}"):
            start = None if identify_from.start is None else read_joint(identify_from.start)
            found = identify(tests, start=start)
        self.starts += [] if identify_from.start is None else [identify_from.start]
        self.assumptions += [
            f"{name}: {key} = {with_error(p.value, 0.0, p.unit)}, no record tells it."
            for key, p in found.parameters.items()
            if p.status == "assumed"
        ]
        write_joint(self._path(f"{name}.identified.joint.toml"), found.joint)
        self._json(f"{name}.identified.json", identified(found))
        errors = {e.measurement: e.rms for e in found.errors}
        self.steps.append({"step": "identify", "joint": name, "rms": errors, "messages": list(found.messages)})
        self.sections.append(identification_section(found, any(t.simulated for t in tests)))
        joint = found.joint
        for test in tests:
            if test.kind not in ("rig", "path"):
                continue
            report = self._traced(name, test, joint)
            joint = report.mended
            for _ in range(_AGAIN):
                if report.verdict not in (Verdict.IDENTIFIED, Verdict.AMBIGUOUS):
                    break
                # Go on from what was written, as a user would: the mended joint, the mended measurement.
                mended = self.folder / f"{name}.trace" / "measurement.toml"
                test = read_measurement(mended) if report.corrections else test
                with self.progress.step(f"tracing {name} again from there"):
                    report = trace(test, joint)
                self.said.append(f"traced again from there: {report.verdict.value}")
                self.steps.append({"step": "trace again", "joint": name, "verdict": report.verdict.value})
                if report.verdict in (Verdict.IDENTIFIED, Verdict.AMBIGUOUS):
                    self._keep(name, report)
                    joint = report.mended
        write_joint(self._path(f"{name}.joint.toml"), joint)
        self._gains(name, {"as identified": found.joint, "mended": joint})
        self.machine = self.machine.with_joint(name, joint)

    def _traced(self, name: str, test: Measurement, joint: Joint) -> TraceReport:
        """The first trace of a joint on a test: its errors and its verdict are those of the run."""
        from jointlib import trace

        with self.progress.step(f"tracing what {name} leaves unexplained of {test.source.name}"):
            report = trace(test, joint)
        self.traces[name] = report
        self._keep(name, report)
        self.steps.append({"step": "trace", "joint": name, "verdict": report.verdict.value})
        return report

    def _keep(self, name: str, report: TraceReport) -> None:
        """Write a trace, tell its words and add its section."""
        from jointlib.cli.trace import words
        from jointlib.loop.close import write_trace
        from machines.report.sections import trace_section

        self.written += [p for p in write_trace(report, self.folder / f"{name}.trace") if p not in self.written]
        self.said += words(report)
        self.warnings += report.warnings
        self.sections.append(trace_section(report))

    def _gains(self, name: str, joints: dict[str, Joint]) -> None:
        """Describing functions; the last joint is the one that is used."""
        from jointlib.describing import DescribingFunction
        from machines.report.sections import gain_section

        low, high = self.machine.frequency or (100.0, 1000.0)
        frequency = np.array([low, (low * high) ** 0.5, high])
        *earlier, used = joints.values()
        A = np.geomspace(0.01, 1.0, 40) * used.validity.get("amplitude", (0.0, 5e-6))[1]
        data: dict[str, Any] = {"amplitude": A, "frequency": frequency}
        for word, joint in (("", used), *(("_as_identified", j) for j in earlier)):
            G = DescribingFunction(joint)(A[:, None], 2 * np.pi * frequency)
            data |= {f"gain_real{word}": G.real, f"gain_imag{word}": G.imag}
        self._json(f"{name}.df.json", data)
        self.steps.append({"step": "df", "joint": name})
        self.sections.append(gain_section(name, joints, float(frequency[1])))

    def couple(self) -> None:
        """Check the linearised machine against python-control, then force it at every level."""
        from jointlib.cli.frf import peak_rows, write_response
        from machines import response
        from machines.report.sections import response_section
        from machines.report.working_point import working_point

        self.warnings += self.machine.remarks()
        if self.machine.static is not None:
            step, section = working_point(self.machine)
            self.steps.append(step)
            self.sections.append(section)
        if bare := ", ".join(self.machine.without_equations):
            self.warnings.append(f"Only FRFs are known of {bare}: not checked against python-control.")
        else:
            self._check()
        with self.progress.step("forced response at each force"):
            result = response(self.machine)
        write_response(self._path("frf.npz"), result)
        self._json("frf.json", {"peaks": peak_rows(result), "file": "frf.npz"})
        outcomes = {f"{f:g} N": o.name.lower() for f, o in zip(result.force, result.outcomes, strict=True)}
        self.steps.append({"step": "frf", "outcomes": outcomes})
        short = [(f, o.value) for f, o in zip(result.force, result.outcomes, strict=True) if o.value]
        self.warnings += [*result.warnings, *(f"Forced response at {f:g} N: {why}" for f, why in short)]
        self.sections.append(response_section(result))
        reached = [p for p in result.peaks if np.isfinite(p.amplitude)]
        if reached and self.machine.cutting is None:
            top = max(reached, key=lambda p: p.amplitude)
            self.advice.append(
                f"At {top.force:g} N the joint {top.connection} moves by up to {top.amplitude * 1e6:.3g} µm, "
                f"at {top.frequency:.5g} Hz."
            )
            self.said += self.advice

    def _check(self) -> None:
        from jointlib.io.atomic import write_npz
        from machines import linear_check
        from machines.report.sections import check_section

        with self.progress.step("checking the coupled machine against python-control"):
            check = linear_check(self.machine)
        excluded = [{"connection": e.connection, "law": e.law, "reason": e.reason} for e in check.excluded]
        size = check.max_relative_difference
        data = {"max_relative_difference": size, "passed": check.passed, "excluded": excluded}
        self._json("check.json", data)
        curves = {"coupled": check.coupled.receptance, "control": check.control.receptance}
        write_npz(self._path("check.npz"), {"frequency": check.frequency, **curves})
        self.steps.append({"step": "check", **data})
        self.sections.append(check_section(check))
        self.said.append(f"check against python-control: {size:.2g} in norm, {'passed' if check.passed else 'FAILED'}")
        self.numbers.append(("coupling against control", f"{size:.1e}"))
        if not check.passed:
            self.failed.append("receptance coupling and python-control differ")

    def cut(self, amplitudes: tuple[float, ...]) -> None:
        """Stability lobes at each tool-point amplitude."""
        from jointlib.cli.lobes import chart_data, default_speeds, write_lobes
        from machines import Cutting, lobes_at_amplitude
        from machines.lobes.advice import advice
        from machines.report.sections import lobes_section

        speeds, charts = default_speeds(self.machine, 100), []
        for A in amplitudes:
            size = f"a tool-point amplitude of {A * 1e6:g} um" if A else "vanishing vibration"
            with self.progress.step(f"stability lobes at {size}"):
                charts.append(lobes_at_amplitude(self.machine, speeds, A))
        write_lobes(self._path("lobes.npz"), charts, speeds, amplitudes)
        self._json("lobes.json", chart_data(charts, speeds, amplitudes))
        lowest = [c.minimum_depth for c in charts]
        self.steps.append({"step": "lobes", "minimum_depth": lowest, "amplitude": list(amplitudes)})
        pairs, cutting = list(zip(amplitudes, charts, strict=True)), Cutting(**(self.machine.cutting or {}))
        self.sections.append(lobes_section(pairs, cutting))
        self.warnings += sorted({w for c in charts for w in c.warnings})
        self.numbers.append(("safe depth at every speed", f"{min(lowest) * 1e3:.3g} mm"))
        self.advice += advice(pairs, cutting)
        self.said += self.advice

    def export(self) -> None:
        """Every joint as a verified FMU."""
        from fmu.export import export_fmu
        from machines.report import Section, Table

        for connection in self.machine.connections:
            if connection.joint is None or self._first(connection.name) != connection.name:
                continue
            path = self._path(f"{connection.name}.fmu")
            try:
                with self.progress.step(f"exporting {connection.name} as an FMU and verifying it"):
                    done = export_fmu(connection.joint, path)
            except InputError as error:
                self.warnings.append(f"{connection.name} is not exported as an FMU: {error}.")
                self.said.append(self.warnings[-1])
                self.written.remove(path)
                continue
            step = "none is safe" if done.max_step is None else f"{done.max_step * 1e6:.3g} µs"
            rows = [
                ("file", path.name),
                ("runtime", done.runtime),
                ("platforms", ", ".join(done.platforms)),
                ("verified with", ", ".join(done.verified_with)),
                ("largest co-simulation step", step),
            ]
            self.steps.append({"step": "fmu", "joint": connection.name, "max_step": done.max_step, "file": path.name})
            text = ["It was validated and replayed its reference run before it was written.", *done.messages]
            self.sections.append(Section(f"{connection.name} as an FMU", text, (), [Table(("", ""), rows)]))
            self.said.append(f"{path.name}: verified with {', '.join(done.verified_with)}")

    def close(self) -> dict[str, Any]:
        """Write the report and the summary, and return the promised keys."""
        from importlib.metadata import version

        from jointlib.cli.trace import assumptions_of, inputs_of, trace_numbers
        from jointlib.io.atomic import sha256
        from machines.report import Page

        main = next(iter(self.traces.values()), None)
        opening = [r.sentence for r in self.traces.values()] or ["Every joint was given; nothing was identified."]
        source, mean = self.machine.source, "zero mean" if self.machine.static is None else "means in static balance"
        inputs = [(file.name, sha256(file)) for file in ([] if source is None else [source]) + self.starts]
        Page(
            title=f"{self.machine.name}: joints, response and stability",
            finding=" ".join([*opening, *self.advice]),
            numbers=[*(trace_numbers(main) if main else []), *self.numbers],
            sections=self.sections,
            inputs=[*inputs, *inputs_of(self.tests)],
            assumptions=[
                *assumptions_of(self.tests),
                *self.assumptions,
                f"Joints are replaced by their describing functions: one harmonic, {mean}.",
                "Bodies and modes are linear; the tool point is reached along the axes named in the machine file.",
            ],
            warnings=list(dict.fromkeys(self.warnings)),
            command=self.command,
            version=version("jointlib"),
        ).write(self._path("report.html"))
        data = {
            "steps": self.steps,
            "report": str(self.folder / "report.html"),
            "verdict": main.verdict.value if main else None,
            "error_before": main.error_before["relative"] if main else None,
            "error_after": main.error_after["relative"] if main else None,
        }
        self._json("run.json", data)
        return data

    def _path(self, name: str) -> Path:
        path = self.folder / name
        self.written.append(path)
        return path

    def _json(self, name: str, data: dict[str, Any]) -> None:
        from jointlib.io.atomic import write_text
        from jointlib.loop.report import plain

        write_text(self._path(name), json.dumps(plain(data), indent=1, allow_nan=False) + "\n")
