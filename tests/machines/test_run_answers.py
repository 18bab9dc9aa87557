"""What a run says of its recommended speed, in which order it computes, and what it keeps where time is up."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_held_at_rest import CUBIC, JOINTS, SPRING, mill

from fmu.machine_step import exporting_pieces
from jointlib.shown.progress import Silent
from machines import read_machine, response, run, steps
from machines.answers.told.lobes_forced import forced
from machines.cutting.amplitude.pocket import limit_of, pocket, safe_depth
from machines.cutting.process.cutting import Cutting
from machines.deadline import OutOfTime

LIBRARY = Path(__file__).parents[2] / "machines" / "library"


@pytest.mark.thorough
@pytest.mark.parametrize("file", ["mill", "two_mode_tool"], ids=["very many joints", "no joint"])
def test_run_says_of_the_recommended_cut_what_lobes_says(file: str, tmp_path: Path) -> None:
    """The vibration of the teeth, the wall that it leaves and the quieter setting: for one chart the same sentences."""
    path = mill(tmp_path, SPRING + CUBIC) if file == "mill" else LIBRARY / f"{file}.toml"
    made = run(path, tmp_path / "out", steps=["cutting"], amplitudes=[0.0])
    (chart,) = made.charts.values()
    cutting = Cutting(**dict(made.machine.cutting or {}))
    safe, limit = safe_depth([chart]), limit_of(made.machine, [0.0], chart.method)
    best = pocket([chart], cutting, limit)
    assert best is not None
    assert made.advice[0].startswith(f"Recommended: {best.words()}")
    _, lines, _ = forced(made.machine, chart, (), best, (safe, limit), Silent())
    assert any(line.startswith("There the tooth-passing vibration is ") for line in lines)
    assert any(line.startswith("There the finished wall stands ") for line in lines)
    assert any(f"{JOINTS} joints depend on amplitude" in line for line in lines) == (file == "mill")
    assert [line for line in lines if line not in (*made.advice, *made.doubts)] == []


def test_joints_that_are_identified_or_nonlinear_have_an_fmu_of_their_own_after_all_answers(tmp_path: Path) -> None:
    path = mill(tmp_path, SPRING)
    bent = f"law = [{SPRING.replace('2e+06', '2.03e6')}]"
    text = path.read_text().replace(bent, bent.replace("]", f"{CUBIC}]"))
    path.write_text(text)
    machine = read_machine(path)
    assert [piece.name for piece in exporting_pieces(machine)] == ["fmu j3", "machine fmu", "ssp"]
    guided = read_machine(LIBRARY / "guide_mill.toml")
    assert [piece.name for piece in exporting_pieces(guided)] == ["fmu guide", "machine fmu", "ssp"]
    every = [piece.step for step in steps() for piece in step.pieces(guided, (0.0,))]
    answers, exports = every[:-3], every[-3:]
    assert exports == ["fmu", "machine fmu", "ssp"]
    assert {"frf", "lobes"} <= set(answers)
    assert not set(exports) & set(answers)


def test_a_machine_without_a_force_is_run_without_a_forced_response(tmp_path: Path) -> None:
    text = (LIBRARY / "two_mode_tool.toml").read_text()
    assert "force = " in text
    path = tmp_path / "quiet.toml"
    path.write_text("\n".join(line for line in text.splitlines() if not line.startswith("force = ")))
    made = run(path, tmp_path / "out", steps=["coupling"])
    assert "There is no forced response: [response] gives no force." in made.warnings
    assert not made.failed
    assert not (tmp_path / "out" / "frf.npz").exists()


@pytest.mark.thorough
@pytest.mark.parametrize("lines", [True, False], ids=["on lines", "not at all"])
def test_of_a_response_that_takes_too_long_that_on_lines_or_along_the_other_axis_is_kept(
    lines: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def slow_across(machine: Any, force: Any, band: Any, drive: str, *how: Any, **more: Any) -> Any:
        if drive == "head.y" and (band is None or not lines):
            raise OutOfTime("not done after 8 minutes")
        return response(machine, force, band, drive, *how, **more)

    monkeypatch.setattr("machines.forced_response.each_drive.response", slow_across)
    path = mill(tmp_path, SPRING)
    made = run(path, tmp_path / "out", steps=["coupling"])
    assert [one.drive for one in made.responses] == ["head.x", "head.y"][: 1 + lines]
    assert {"frf.npz", "frf.json"} <= {written.name for written in made.written}
    (failed,) = made.failed
    title = "Peaks and jumps of the forced response along y" if lines else "Forced response along y"
    assert failed.startswith(f"{title}: not done after 8 minutes")
    if lines:
        exact = response(machine=made.machine, frequency=made.responses[1].frfs[0].frequency, drive="head.y")
        assert made.responses[1].frfs[0].receptance == pytest.approx(exact.frfs[0].receptance, rel=1e-9)
        assert np.max(np.abs(exact.frfs[0].receptance)) > 0
    (lost,) = [step for step in made.steps if "failed" in step]
    assert lost["remedy"] == f"`jointlib frf {path} --drive head.y -o frf.npz` computes it alone."
    assert f"{title}: not computed" in (tmp_path / "out" / "report.html").read_text("utf-8")
