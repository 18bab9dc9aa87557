"""Several tools of one machine file side by side: each as if it were asked for alone."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from tool_files import CUT, HOLDER, SIZES, TOOL, TWO, machine, written

from jointlib.cli.main import cli
from machines import lobes, lobes_over_range, read_machine, run

SPEEDS = ("--speed", "9000")


def shown(*words: str) -> str:
    done = CliRunner().invoke(cli, list(words), catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done.stdout


def told(*words: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(shown(*words, "--json"))
    return found


@pytest.fixture
def both(tmp_path: Path) -> Path:
    written(tmp_path, "a.tool.toml", f"{TOOL}{SIZES}{CUT}")
    written(tmp_path, "a.holder.toml", HOLDER)
    return machine(tmp_path, tool=TWO)


@pytest.mark.parametrize(
    "more",
    [
        pytest.param(SPEEDS, marks=pytest.mark.slow),
        pytest.param(("--method", "zero-order"), marks=pytest.mark.thorough),
        (*SPEEDS, "--method", "zero-order"),
    ],
)
def test_lobes_tells_of_every_tool_what_it_tells_when_asked_for_it(both: Path, more: tuple[str, ...]) -> None:
    rows = told("lobes", str(both), *more)["tools"]
    assert [row["tool"] for row in rows] == ["short", "long"]
    assert rows[0]["minimum_depth"] != rows[1]["minimum_depth"]
    for row in rows:
        alone = told("lobes", str(both), "--tool", row["tool"], *more)
        assert "tools" not in alone
        for key in ("minimum_depth", "speed", "depth"):
            assert row[key] == alone[key]
        assert row["pocket"] == alone.get("pocket")


@pytest.mark.slow
def test_with_amplitudes_there_is_a_table_for_each(both: Path) -> None:
    asked = ("--amplitude", "2 um", "--amplitude", "5 um", "--method", "zero-order")
    rows = told("lobes", str(both), *asked, *SPEEDS)["tools"]
    named = [(row["tool"], row["amplitude"]) for row in rows]
    assert named == [("short", 2e-6), ("long", 2e-6), ("short", 5e-6), ("long", 5e-6)]
    for row in rows:
        at = ("--amplitude", f"{row['amplitude']}", "--method", "zero-order", *SPEEDS)
        alone = told("lobes", str(both), "--tool", row["tool"], *at)
        assert row["depth"] == alone["depth"][0]
    lines = shown("lobes", str(both), *asked, *SPEEDS).splitlines()
    first, second = (lines.index(f"at a tool-point amplitude of {size} um:") for size in (2, 5))
    assert lines[first + 2].startswith("short")
    assert lines[second + 3].startswith("long")


def test_the_table_of_tools_shows_the_same_digits(both: Path) -> None:
    found = re.findall(
        r"(?m)^(short|long) +(\S+) +(\S+) +(\S+) +(\S+)$", shown("lobes", str(both), "--method", "zero-order")
    )
    assert [row[0] for row in found] == ["short", "long"]
    for name, least, frequency, speed, depth in found:
        alone = shown("lobes", str(both), "--tool", name, "--method", "zero-order")
        assert f"below {least} mm (chatter at {frequency} Hz)" in alone
        assert f"recommended: {speed} rpm, {depth} mm," in alone


@pytest.mark.slow
def test_the_picture_has_a_curve_for_every_tool(both: Path, tmp_path: Path) -> None:
    one = told("lobes", str(both), "--tool", "short", "--method", "zero-order", "-o", str(tmp_path / "one.svg"))
    shown("lobes", str(both), "--method", "zero-order", "-o", str(tmp_path / "both.svg"))
    red = "#b91c1c"
    assert red not in (tmp_path / "one.svg").read_text()
    assert red in (tmp_path / "both.svg").read_text()
    found = lobes(both, method="zero-order")
    lines = {line.get_label(): np.asarray(line.get_ydata()) for line in found.plot().get_lines()}
    np.testing.assert_allclose(lines["onset of chatter"], 1e3 * np.array(one["depth"]))
    long = told("lobes", str(both), "--tool", "long", "--method", "zero-order")
    np.testing.assert_allclose(lines["long"], 1e3 * np.array(long["depth"]))


def test_a_tool_that_has_no_chart_is_told_and_the_others_stay(both: Path) -> None:
    text = both.read_text().replace("cutting = { teeth = 2 }", "cutting = { teeth = 2, helix = 30 }")
    both.write_text(text)
    rows = told("lobes", str(both), "--method", "zero-order")["tools"]
    assert rows[0]["failed"] is None
    assert rows[1]["minimum_depth"] is None
    assert rows[1]["failed"]


LUMPED = """
schema = "jointlib/machine/1"
[[component]]
name = "spindle"
kind = "modal"
dofs = ["x", "y"]
frequency = [600, 800]
damping_ratio = [0.03, 0.03]
shapes = [[1.0, 0.1], [0.1, 1.2]]
[[tools]]
name = "soft"
x = "spindle.x"
y = "spindle.y"
cutting = { specific = 1e9 }
[[tools]]
name = "hard"
x = "spindle.x"
y = "spindle.y"
[cutting]
process = "turning"
specific = 2e9
speed = [6000, 12000]
"""


@pytest.mark.parametrize("more", [(), ("--speed", "7000", "--speed", "9000", "--amplitude", "0", "--amplitude", "1um")])
def test_the_file_of_a_chart_holds_the_depths_of_every_tool(more: tuple[str, ...], tmp_path: Path) -> None:
    path = written(tmp_path, "mill.toml", LUMPED)
    rows = told("lobes", str(path), *more, "-o", str(tmp_path / "chart.npz"))["tools"]
    shown("lobes", str(path), *more, "-o", str(tmp_path / "chart.csv"))
    with np.load(tmp_path / "chart.npz") as file:
        arrays = dict(file)
    lines = (tmp_path / "chart.csv").read_text("utf-8").splitlines()
    table = list(csv.DictReader(lines[1:]))
    assert {row["tool"] for row in rows} == {"soft", "hard"}
    for row in rows:
        name, A = f"depth_{row['tool']}", row.get("amplitude", 0.0)
        here = arrays[name][arrays["amplitude"].tolist().index(A)]
        # A speed that only the other tool has is empty.
        assert (
            dict(zip(arrays["tool_speed"].tolist(), here.tolist(), strict=True)).items()
            >= dict(zip(row["speed"], row["depth"], strict=True)).items()
        )
        assert np.count_nonzero(~np.isnan(here)) == len(row["speed"])
        listed = [(float(r["speed"]), float(r[name])) for r in table if float(r["amplitude"]) == A and r[name]]
        np.testing.assert_allclose(listed, np.transpose([row["speed"], row["depth"]]), rtol=1e-9)
    own = [float(r["depth"]) for r in table if r["depth"]]
    np.testing.assert_allclose(own, np.ravel(arrays["depth"]), rtol=1e-9)


def test_a_run_tells_of_every_tool_what_lobes_tells_of_it(tmp_path: Path) -> None:
    path = written(tmp_path, "mill.toml", LUMPED)
    road = run(path, tmp_path / "out", steps=["cutting"], amplitudes=(0.0,))
    assert not road.failed
    (rows,) = (
        step["tools"] for step in json.loads((tmp_path / "out" / "run.json").read_text())["steps"] if "tools" in step
    )
    speeds = np.linspace(6000.0, 12000.0, 100)
    for row in rows:
        alone = lobes_over_range(read_machine(path, {"tool.use": row["tool"]}), speeds)
        assert row["minimum_depth"] == alone.minimum_depth
        assert row["depth"] == alone.depth.tolist()
    assert [row["tool"] for row in rows] == ["soft", "hard"]
    page = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert "What each tool cuts" in page
    assert any(line.startswith("hard ") for line in road.said)


def test_a_run_of_one_tool_is_of_it_alone(tmp_path: Path) -> None:
    path = written(tmp_path, "mill.toml", LUMPED)
    road = run(path, tmp_path / "out", steps=["cutting"], amplitudes=(0.0,), tool="hard")
    assert not road.failed
    assert "What each tool cuts" not in (tmp_path / "out" / "report.html").read_text("utf-8")
    assert "tools" not in {step["step"] for step in road.steps}


def test_the_budget_is_that_of_all_tools_and_each_is_told_when_it_is_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from machines.answers import lobes as verb
    from machines.answers.told import lobes_of_tools

    path, lines, seen = written(tmp_path, "mill.toml", LUMPED), list[str](), list[tuple[float, bool]]()
    real = lobes_of_tools.charts_by_amplitude

    def charts(*of: Any) -> Any:
        seen.append((of[-1], any(line.startswith("soft ") for line in lines)))
        return real(*of)

    def said(so_far: Any) -> None:
        lines[:] = so_far

    for module in (verb, lobes_of_tools):
        monkeypatch.setattr(module, "charts_by_amplitude", charts)
    lobes(path, budget=40.0, said=said)
    (first, before), (second, after) = seen
    assert first == 20.0
    assert 0 < second <= 40.0
    assert (before, after) == (False, True)
    assert [line.split()[0] for line in lines if line.startswith(("soft ", "hard "))] == ["soft", "hard"]
