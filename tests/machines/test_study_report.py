"""What a study says of its results: shares of the variance, what separates designs, what is nearest, and the page."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import machines
from jointlib.arrays import Array
from machines import frozen_receptance, read_machine
from machines.report.study_report import answer, study_page
from machines.report.study_sections import front_section, leading_section
from machines.study import words
from machines.study.evaluation import Evaluation
from machines.study.factors import Factor
from machines.study.findings.best import write_best
from machines.study.findings.contrast import contrast
from machines.study.findings.effects import effects
from machines.study.findings.verdict import judge, rivals
from machines.study.study import Study
from machines.study.study_file import read_study

LIBRARY = Path("machines/library").resolve()
STUDY = f"""
schema = "jointlib/study/1"
base = "{LIBRARY}/two_mass.toml"
[[factor]]
name = "guide"
path = "connection.guide.joint.linear.stiffness"
values = ["500 N/um", "700 N/um"]
[[factor]]
name = "base"
path = "component.base.stiffness[0][0]"
values = ["100 N/um", "200 N/um"]
[[factor]]
name = "damping"
path = "component.base.damping[0][0]"
role = "uncertain"
distribution = {{ kind = "log-normal", median = "200 N s/m", deviation = 0.3 }}
[[objective]]
quantity = "static-compliance"
goal = "min"
[[objective]]
quantity = "peak-receptance"
goal = "min"
[sampling]
samples = 3
"""


def study(folder: Path, *changes: tuple[str, str]) -> Study:
    text = STUDY
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "s.study.toml").write_text(text)
    return read_study(folder / "s.study.toml")


def test_shares_of_a_factorial_are_those_of_its_polynomial() -> None:
    """y = a + 3 b + a b with a = ±1 and b = −1, 0, 1: variances 1, 6 and 2/3 of a, b and both together."""
    factors = [Factor("a", "a", (-1, 1)), Factor("b", "b", (-1, 0, 1))]
    index = np.array([[i, j] for i in range(2) for j in range(3)], dtype=float)
    a, b = 2 * index[:, 0] - 1, index[:, 1] - 1
    of_a, of_b = effects(factors, index, a + 3 * b + a * b, "factorial")
    whole = 1 + 6 + 2 / 3
    assert [of_a.first, of_b.first] == pytest.approx([1 / whole, 6 / whole])
    assert [of_a.total, of_b.total] == pytest.approx([(1 + 2 / 3) / whole, (6 + 2 / 3) / whole])
    np.testing.assert_allclose(of_a.mean, [-1, 1], atol=1e-12)
    np.testing.assert_allclose(of_b.mean, [-3, 0, 3], atol=1e-12)


def test_bins_tell_the_share_of_a_factor_and_nothing_of_one_without_effect() -> None:
    """A ramp cut into 6 bins keeps 1 − 1/36 of its variance."""
    rng = np.random.default_rng(3)
    factors = [Factor(name, name, low=0.0, high=1.0) for name in "abc"]
    u = (np.array([rng.permutation(400) for _ in factors]).T + 0.5) / 400
    of_a, of_b, of_c = effects(factors, u, u[:, 0] + 0.5 * u[:, 1], "latin-hypercube")
    spread = 4 / np.sqrt(400)
    assert of_a.first == pytest.approx(0.8 * (1 - 1 / 36), abs=spread)
    assert of_b.first == pytest.approx(0.2 * (1 - 1 / 36), abs=spread)
    assert of_c.first < spread / 4
    assert of_a.total is None
    assert np.all(np.diff(of_a.mean) > 0)


def test_designs_without_a_result_take_no_part_in_its_effects() -> None:
    factors = [Factor("a", "a", (1, 2)), Factor("b", "b", (1, 2))]
    index = np.array([[0, 0], [0, 1], [1, 0], [1, 1]], dtype=float)
    of_a, _ = effects(factors, index, np.array([1.0, np.nan, 4.0, 4.0]), "factorial")
    np.testing.assert_allclose(of_a.mean, [1.0, 4.0])
    assert of_a.total is None
    assert effects(factors, index, np.full(4, 2.0), "factorial") == []


def test_springs_in_series_separate_designs_each_by_its_own_compliance(tmp_path: Path) -> None:
    opened = study(tmp_path)
    evaluate = Evaluation(opened.source)
    verdict = judge(opened, evaluate(0, 12))
    assert verdict.best is not None
    assert verdict.best.factors == {"guide": "700 N/um", "base": "200 N/um"}
    found = contrast(opened, evaluate, verdict.ranking, verdict.best, verdict.leading[-1])
    thinned = replace(verdict.ranking, numbers=verdict.ranking.numbers + 9 * np.isin(np.arange(4), (1, 2))[:, None])
    assert contrast(opened, evaluate, thinned, verdict.best, verdict.leading[-1]) == found
    changes = {e.factor: e.change for e in found.exchanges}
    assert changes["guide"] == pytest.approx(1 / 500e6 - 1 / 700e6, rel=1e-6)
    assert changes["base"] == pytest.approx(1 / 100e6 - 1 / 200e6, rel=1e-6)
    assert abs(found.remainder) < 1e-6 * found.second
    (rival,) = rivals(opened, verdict)
    assert rival.number == verdict.leading[1].number


def test_the_best_machine_is_worth_what_its_file_says(tmp_path: Path) -> None:
    """Its compliance is that of springs in series, its peak that of the file; what is uncertain is at its median."""
    opened = study(tmp_path)
    evaluate = Evaluation(opened.source)
    verdict = judge(opened, evaluate(0, 12))
    assert verdict.best is not None
    best = write_best(opened, evaluate, {}, verdict.ranking, verdict.best, tmp_path / "out" / "best.toml")
    machine = read_machine(best.files[0])
    assert best.results["static-compliance"] == pytest.approx(1 / 700e6 + 1 / 200e6, rel=1e-5)
    lines = np.linspace(1150.0, 1400.0, 25001)
    peak = np.max(np.abs(frozen_receptance(machine, lines, 0.0).receptance))
    assert best.results["peak-receptance"] == pytest.approx(peak, rel=1e-4)
    assert machine.components[1].second_order().damping[0, 0] == pytest.approx(200.0)  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("value", "digits", "said"),
    [
        (190.0, 2, "190"),
        (12345.6, 4, "12346"),
        (0.0321, 2, "0.032"),
        (0.00321, 4, "0.00321"),
        (9.9996, 4, "10"),
        (2.30e-7, 4, "2.3e-07"),
        (0.0, 4, "0"),
        (-1999.9, 2, "-2000"),
    ],
)
def test_numbers_are_told_without_powers_of_ten(value: float, digits: int, said: str) -> None:
    assert words.plain(value, digits) == said


def test_designs_that_differ_by_rounding_are_told_as_equal(tmp_path: Path) -> None:
    """Neither leads, none of them beats the other, and no factor explains what does not vary."""
    opened = study(tmp_path)
    one = np.repeat([1e-8, 1e-8 * (1 + 1e-13), 1.1e-8, 1e-8 * (1 - 1e-13)], 3)
    verdict = judge(opened, {"static-compliance": one, "peak-receptance": np.repeat([1.0, 1.0, 2.0, 1.0], 3) * 1e-6})
    assert answer(opened, verdict).endswith(
        "its tool point yields 0.01 µm/N; the second does as well. "
        "In static compliance and peak receptance together 3 designs are beaten by no other."
    )
    assert len(verdict.front) == 3
    same = np.repeat([1e-8, 1e-8 * (1 + 1e-13), 1e-8, 1e-8], 3)
    assert judge(opened, {"static-compliance": same, "peak-receptance": one}).sensitivity.keys() == {"peak-receptance"}


def test_a_best_value_at_the_end_of_its_range_is_named(tmp_path: Path) -> None:
    values = 'values = ["500 N/um", "700 N/um"]'
    opened = study(tmp_path, (values, 'range = ["500 N/um", "700 N/um"]\nlevels = 3'))
    verdict = judge(opened, Evaluation(opened.source)(0, opened.total))
    (_, said) = leading_section(opened, verdict).text
    assert said == "The best guide, 700 N/um, is the highest looked at. There may be better ones beyond."


@pytest.mark.thorough
def test_a_design_far_from_the_front_does_not_press_the_picture_of_it_flat(tmp_path: Path) -> None:
    opened = study(tmp_path)
    compliance, peak = np.array([1.0, 2.0, 90.0, 1.5]) * 1e-8, np.array([2.0, 1.0, 1.5, 1.5]) * 1e-6
    results = {"static-compliance": np.repeat(compliance, 3), "peak-receptance": np.repeat(peak, 3)}
    shown = front_section(opened, judge(opened, results)).figures[0].caption
    assert shown.endswith("Outside the picture, far worse: 1 of 4 designs.")
    results["static-compliance"][6:9] = 2.2e-8
    assert "Outside" not in front_section(opened, judge(opened, results)).figures[0].caption


def test_a_design_that_a_plan_holds_twice_counts_once(tmp_path: Path) -> None:
    """Sobol's plan of lists repeats designs: six rows of a list of two are two designs, and the second is another."""
    opened = study(
        tmp_path,
        ("[sampling]", '[sampling]\nmethod = "sobol"\ncount = 4'),
    )
    verdict = judge(opened, Evaluation(opened.source)(0, opened.total))
    distinct = {tuple(row) for row in opened.numbers()[:: opened.repeats, :2]}
    assert len(distinct) < opened.total // opened.repeats
    assert (verdict.designs, verdict.feasible) == (len(distinct), len(distinct))
    assert len({tuple(design.factors.values()) for design in verdict.leading}) == len(verdict.leading)


def test_the_speed_of_a_pocket_is_one_that_a_condition_has(tmp_path: Path) -> None:
    """In two samples the worst one has its pocket at 7500 rpm, in one at 11700: between them nobody should cut."""
    text = STUDY.replace("static-compliance", "removal-rate").replace('goal = "min"', 'goal = "max"', 1)
    (tmp_path / "s.study.toml").write_text(text)
    opened = read_study(tmp_path / "s.study.toml")
    speeds = np.array([7500.0, 11700.0, 7500.0])
    rate = np.repeat([4e-6, 3e-6, 2e-6, 1e-6], 3)
    results = {"removal-rate": rate, "peak-receptance": rate, "pocket-speed": np.tile(speeds, 4)}
    verdict = judge(opened, results)
    assert "it removes 240 cm³/min at 7500 rpm (by condition at 7500 to 11700 rpm); 33 %" in answer(opened, verdict)
    results["pocket-speed"] = np.tile([7500.0, 7550.0, 7600.0], 4)
    assert "it removes 240 cm³/min at 7550 rpm; 33 %" in answer(opened, judge(opened, results))


def test_a_study_of_what_is_uncertain_alone_has_nothing_to_choose(tmp_path: Path) -> None:
    opened = study(tmp_path)
    alone = replace(opened, factors=opened.uncertain)
    results = {"static-compliance": np.full(3, 1e-8), "peak-receptance": np.full(3, 1e-6)}
    said = answer(alone, judge(alone, results))
    assert said == (
        "There is nothing to choose: its tool point yields 0.01 µm/N on average over 3 samples of what is uncertain."
    )


@pytest.mark.thorough
def test_where_nothing_is_allowed_the_nearest_design_is_named(tmp_path: Path) -> None:
    limit = '[[constraint]]\nquantity = "static-compliance"\nat_most = "0.005 um/N"\n[[objective]]'
    opened = study(tmp_path, ('[[objective]]\nquantity = "static', f'{limit}\nquantity = "static'))
    results = Evaluation(opened.source)(0, 12)
    verdict = judge(opened, results)
    assert (verdict.best, verdict.feasible, verdict.leading) == (None, 0, ())
    assert verdict.nearest is not None
    assert verdict.nearest.factors == {"guide": "700 N/um", "base": "200 N/um"}
    assert answer(opened, verdict) == (
        "None of the 4 designs meets what is asked for: static compliance of at most 0.005 µm/N rules out 4. "
        "Nearest comes guide 700 N/um, base 200 N/um with static compliance 0.006429 µm/N."
    )
    html = study_page(opened, results, verdict, [], None, (), {}, "x").html()
    assert "Nearest to what is asked for comes guide 700 N/um" in html


def in_positions(folder: Path, positions: str) -> tuple[Study, dict[str, Array]]:
    """A study over positions with results by hand: compliance 1 nm/N a mm of x, 2 nm/N a mm of y, less a design."""
    opened = study(folder, ("[sampling]", f"[conditions]\nposition = {positions}\n[sampling]"))
    rows = np.arange(len(opened.numbers()))
    design = rows // opened.repeats
    at = [opened.case(int(row)).position for row in rows]
    value = np.array([1e-6 * p.get("x", 0.0) + 2e-6 * p.get("y", 0.0) for p in at]) + 1e-6 - 1e-8 * design
    return opened, {"static-compliance": value + 1e-10 * (rows % 3), "peak-receptance": 3 * value}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("positions", "pictures", "said"),
    [
        ("{ x = [0, 0.1, 0.2] }", 2, "x 200 mm"),
        ("{ x = [0, 0.1, 0.2], y = [0, 0.3] }", 2, "x 200 mm, y 300 mm"),
        ("{ x = [0.1] }", 0, "one position and one material only"),
    ],
)
def test_the_map_shows_the_worst_place_of_the_working_space(
    tmp_path: Path, positions: str, pictures: int, said: str
) -> None:
    opened, results = in_positions(tmp_path, positions)
    verdict = judge(opened, results)
    assert verdict.best is not None
    assert verdict.best.number == 3
    worst = 1e6 * (max(results["static-compliance"].reshape(4, -1)[3]) - 1e-10)
    html = study_page(opened, results, verdict, [], None, (), {}, "x").html()
    section = html.split(">Over the working space</h2>")[1].split("</section>")[0]
    assert section.count("<svg") == pictures
    assert said in section
    if pictures:
        assert f"{worst:.4g} µm/N" in section


@pytest.mark.parametrize(
    ("lobes", "said"),
    [
        ("", "at every speed it cuts 2 mm deep without chatter (by zero order, a preview); 33 % more than the second."),
        ('lobes = "zero-order"', "without chatter (by zero order, a preview); 33 % more than the second."),
        ('lobes = "multi-frequency"', "at every speed it cuts 2 mm deep without chatter; 33 % more than the second."),
    ],
)
def test_the_answer_says_that_its_depth_is_a_preview(lobes: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "s.study.toml"
    path.write_text(
        f'schema = "jointlib/study/1"\nbase = "{LIBRARY}/two_mode_tool.toml"\n[[factor]]\nname = "teeth"\n'
        f'path = "cutting.teeth"\nvalues = [2, 3]\n[conditions]\n{lobes}\n'
        '[[objective]]\nquantity = "minimum-depth"\ngoal = "max"\n'
    )
    opened = read_study(path)
    depths = {"minimum-depth": np.array([2e-3, 1.5e-3]), "pocket-speed": np.full(2, np.nan)}
    assert answer(opened, judge(opened, depths)).endswith(said)


@pytest.mark.thorough
def test_the_page_tells_people_units_and_how_sure_it_is(tmp_path: Path) -> None:
    opened, results = in_positions(tmp_path, "{ x = [0, 0.1] }")
    verdict = judge(opened, results)
    assert verdict.surer == 1.0
    said = answer(opened, verdict)
    assert said.startswith(
        "Take guide 700 N/um, base 200 N/um: its tool point yields 1.07 µm/N; 0.93 % less than the second"
    )
    assert "better in all 3 samples of what is uncertain" in said
    html = study_page(opened, results, verdict, [], None, (), {}, "jointlib study run x").html()
    titles = [re.sub(r"<.*?>", "", title) for title in re.findall(r"<h2>(.*?)</h2>", html)]
    assert titles == [
        "The leading designs",
        "One objective against the other",
        "What it depends on",
        "Over the working space",
        "How sure the ranking is",
        "What was ruled out",
        "What this stands on",
    ]
    assert "m/N" not in re.sub(r"µm/N", "", re.sub(r"<svg.*?</svg>", "", html, flags=re.S))


@pytest.mark.slow
def test_the_shipped_comparison_of_the_column_mills(tmp_path: Path) -> None:
    """Thinned to one place. In B the saddle turns on its carriages under a force in x: L²/K softer, 1.54 nm/N."""
    text = (LIBRARY / "column_mill.study.toml").read_text()
    text = text.replace('"column_mill_', f'"{LIBRARY}/column_mill_')
    for old, new in (
        (r"position = .*", 'position = { x = ["0 mm"], z = ["0 mm"] }'),
        (r'values = \["700 N/um", "1000 N/um"\]\nwords = .*', 'values = ["700 N/um"]'),
        (r"samples = \d+", "samples = 1"),
    ):
        assert re.search(old, text)
        text = re.sub(old, new, text)
    (tmp_path / "s.study.toml").write_text(text)
    opened = read_study(tmp_path / "s.study.toml")
    results = Evaluation(opened.source)(0, 6)
    a, b = results["static-compliance"].reshape(2, 3)
    np.testing.assert_allclose(b - a, 0.62**2 / (4 * 1000e6 * 0.25**2), rtol=0.06)
    # More preload makes the bearings stiffer and, with the same grease, the spindle less damped.
    assert np.all(np.diff(a) < 0)
    depth = results["minimum-depth"].reshape(2, 3)
    assert np.all(np.diff(depth[:, 1:]) < 0)
    assert {d.factors["machine"] for d in judge(opened, results).leading} == {"A", "B"}


@pytest.mark.thorough
def test_the_report_warns_of_what_looks_wrong_in_the_base(tmp_path: Path) -> None:
    for joint in LIBRARY.glob("two_mass*.joint.toml"):
        (tmp_path / joint.name).write_text(joint.read_text())
    base = (LIBRARY / "two_mass.toml").read_text().replace("mass = [[0.942]]", "mass = [[0.942e-9]]")
    (tmp_path / "light.toml").write_text(base)
    peak = '[[objective]]\nquantity = "peak-receptance"\ngoal = "min"\n'
    study(tmp_path, (f"{LIBRARY}/two_mass.toml", "light.toml"), ("samples = 3", "samples = 1"), (peak, ""))
    found = machines.study(tmp_path / "s.study.toml", tmp_path / "out", workers=1)
    assert any(said.startswith("light.toml: slide: the mass of x is") for said in found.remarks), found.remarks
    page = (tmp_path / "out" / "report.html").read_text()
    assert "slide: the mass of x is" in page
    assert "No warnings" not in page
