"""``jointlib compare`` of designs of a study: their results, receptances and lobes, and what differs in a sentence."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from command_line import LIBRARY, jointlib

from machines import lobes_at_amplitude, read_machine
from machines.compare.side_by_side import differences
from machines.study.findings.design_sides import design_sides
from machines.study.study_file import read_study

STUDY = f"""
schema = "jointlib/study/1"
base = "{LIBRARY}/two_mode_tool.toml"
[[factor]]
name = "immersion"
path = "cutting.immersion"
values = [0.2, 0.5]
[[factor]]
name = "mass"
path = "component.cutter.modal_mass[0]"
values = [0.3, 0.4]
[[objective]]
quantity = "minimum-depth"
goal = "max"
[conditions]
speeds = 60
"""
UNCERTAIN = """[[factor]]
name = "pressure"
path = "cutting.tangential"
role = "uncertain"
distribution = { kind = "log-normal", median = "600 N/mm^2", deviation = 0.3 }
[[factor]]
name = "friction"
path = "cutting.normal"
values = ["42 N/mm^2", "43 N/mm^2"]
[[objective]]"""


@pytest.fixture
def study(here: Path) -> str:
    Path("s.study.toml").write_text(STUDY, "utf-8")
    assert jointlib("study run s.study.toml -o out --workers 1").status == 0
    return "s.study.toml"


@pytest.mark.slow
def test_designs_are_compared_by_results_resonances_and_lobes(study: str) -> None:
    done = jointlib(f"compare {study} --results out --designs 0 1 -o both.svg --json")
    assert done.status == 0, done.err
    rows = {row["what"]: row for row in done.json["differences"]}
    assert rows["minimum depth"]["against"] == "design 1 (immersion 0.2, mass 0.4)"
    # The mass of the first mode alone differs, so its stiffness in the file's keys does too, not its frequency.
    (compliance,) = (row for what, row in rows.items() if what.endswith("compliance") and what.startswith("tool x"))
    assert compliance["other"] < compliance["first"]
    for number, value in (("0", 0.3), ("1", 0.4)):
        changes = {"cutting.immersion": 0.2, "component.cutter.modal_mass[0]": value}
        machine = read_machine(LIBRARY / "two_mode_tool.toml", changes)
        chart = lobes_at_amplitude(machine, np.linspace(4000.0, 25000.0, 60), 0.0, "zero-order")
        told = rows["minimum depth"]["first" if number == "0" else "other"]
        assert told == pytest.approx(chart.minimum_depth, rel=1e-9)
    assert re.search(r"minimum depth: [+-][\d.]+ %", done.json["sentence"])
    assert "design 1 (immersion 0.2, mass 0.4) against design 0 (immersion 0.2, mass 0.3)" in done.json["sentence"]
    picture = Path("both.svg").read_text()
    assert picture.startswith("<svg")


@pytest.mark.thorough
def test_the_lobes_of_a_design_are_those_its_result_was_read_from(study: str) -> None:
    for side in design_sides(read_study(study), Path("out"), (0, 2, 3), {}):
        assert side.limits is not None
        assert float(np.min(side.limits.depth)) == pytest.approx(side.facts["minimum depth"].value, rel=1e-4)
        assert list(side.curves) == ["tool x", "tool y"]


@pytest.mark.thorough
def test_without_numbers_the_best_and_the_second_are_compared(study: str) -> None:
    best = jointlib("study report s.study.toml -o out --json").json["best"]
    told = jointlib(f"compare {study} --results out")
    assert told.status == 0, told.err
    factors = ", ".join(f"{name} {value}" for name, value in best["factors"].items())
    assert f"against design {best['configuration']} ({factors})" in told.out


@pytest.mark.thorough
def test_samples_in_common_are_no_doubt_about_a_difference(here: Path) -> None:
    """A depth that scatters by a third, and differs between the designs by parts in ten thousand in every sample."""
    text = STUDY[: STUDY.index("[[factor]]")] + STUDY[STUDY.index("[[objective]]") :]
    text = text.replace("[[objective]]", UNCERTAIN) + "[sampling]\nsamples = 40\n"
    Path("u.study.toml").write_text(text, "utf-8")
    assert jointlib("study run u.study.toml -o out --workers 1").status == 0
    first, other = design_sides(read_study("u.study.toml"), Path("out"), (0, 1), {})
    samples = first.facts["minimum depth"].samples
    assert samples is not None
    assert np.std(samples) > 0.2 * np.mean(samples)
    found = [d for d in differences(first, other) if d.what == "minimum depth"]
    assert len(found) == 1
    assert abs(found[0].other / found[0].first - 1) < 1e-3


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("{0} --results out --designs 0 9", "--designs: 9, expected numbers from 0 to 3"),
        ("{0} --results out --designs 1", "expected at least two different numbers"),
        ("{0} --results out --designs 1 1", "expected at least two different numbers"),
        ("{0} --designs 0 1", "expected --results as well"),
        ("{0} --results none", "none holds no study"),
        ("{0} {0} --results out", "expected a study file alone"),
        ("{0}", "expected two files or folders, or a study file with --results"),
        ("{0} {0}", "cannot be compared"),
    ],
)
def test_what_cannot_be_compared_is_said_in_a_sentence(study: str, words: str, said: str) -> None:
    done = jointlib(f"compare {words.format(study)}")
    assert (done.status, done.out) == (2, "")
    assert said in done.err
    assert len(done.err.splitlines()) == 1
