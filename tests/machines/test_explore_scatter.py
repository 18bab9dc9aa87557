"""The designs of a study beside the sliders: setting the sliders to a design gives what the study found of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from lathe_file import lathe_file

from jointlib.errors import InputError
from machines.explore import Explorer, Scatter
from machines.study.run import begin, evaluate_all
from machines.study.study_file import read_study

LIBRARY = Path(__file__).parents[2] / "machines" / "library"
STIFFNESS, SPECIFIC = "connection.guide.joint.linear.stiffness", "cutting.specific"
STUDY = f"""
schema = "jointlib/study/1"
base = "lathe.toml"
[[factor]]
name = "guide"
path = "{STIFFNESS}"
range = ["100 N/um", "900 N/um"]
levels = 5
[[factor]]
name = "material"
path = "{SPECIFIC}"
values = ["1000 N/mm^2", "2000 N/mm^2"]
[[factor]]
name = "base"
path = "component.base.stiffness"
values = [[["200 N/um"]], [["300 N/um"]]]
words = ["soft", "stiff"]
[[objective]]
quantity = "minimum-depth"
goal = "max"
[[objective]]
quantity = "static-compliance"
goal = "min"
[[constraint]]
quantity = "minimum-depth"
at_least = "1.2 mm"
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("study")
    lathe_file(folder)
    (folder / "s.study.toml").write_text(STUDY)
    study = read_study(folder / "s.study.toml")
    evaluate_all(study, begin(study, folder / "out"), {}, workers=1)
    return folder


@pytest.fixture(scope="module")
def explorer(folder: Path) -> Explorer:
    return Explorer(folder / "lathe.toml", folder / "s.study.toml", folder / "out")


@pytest.fixture(scope="module")
def study(explorer: Explorer) -> Scatter:
    found = explorer.scatter()
    assert found is not None
    return found


def test_factors_and_quantities_stand_in_columns_with_their_units(study: Scatter) -> None:
    assert study.names == ("guide", "material", "base", "minimum depth", "static compliance")
    assert study.units == ("N/µm", "N/mm²", "", "mm", "µm/N")
    assert study.rows.shape == (20, 5)
    assert sorted(set(study.rows[:, 0])) == [100.0, 300.0, 500.0, 700.0, 900.0]
    assert set(study.rows[:, 1]) == {1000.0, 2000.0}
    assert {words["base"]: row[2] for words, row in zip(study.words, study.rows, strict=True)} == {
        "soft": 0,
        "stiff": 1,
    }
    assert study.unset == ("base",)


def test_sliders_set_to_a_design_give_what_the_study_found_of_it(explorer: Explorer, study: Scatter) -> None:
    for number in np.flatnonzero(study.rows[:, 2] == 0)[::3]:
        row, values = study.rows[number], study.values[number]
        assert values == {STIFFNESS: row[0], SPECIFIC: row[1]}
        curves, moment = explorer.curves(values), explorer.moment(values)
        assert row[4] == pytest.approx(1e6 * moment.built.static_compliance, rel=1e-9)
        # The chart has speeds on a grid, the study's minimum is that of every speed.
        assert row[3] <= 1e3 * np.min(curves.depth) <= 1.05 * row[3]


def test_static_compliance_is_that_of_the_springs_in_series(study: Scatter) -> None:
    base = np.where(study.rows[:, 2] == 0, 200.0, 300.0)
    assert study.rows[:, 4] == pytest.approx(1 / study.rows[:, 0] + 1 / base, rel=1e-6)


def test_what_meets_the_constraint_and_what_is_on_the_front_is_marked(study: Scatter) -> None:
    depth, compliance = study.rows[:, 3], study.rows[:, 4]
    assert np.array_equal(study.feasible, depth >= 1.2)
    assert 0 < np.count_nonzero(study.feasible) < len(depth)
    for i in range(len(depth)):
        better = study.feasible & (depth >= depth[i]) & (compliance <= compliance[i])
        beaten = np.any(better & ((depth > depth[i]) | (compliance < compliance[i])))
        assert study.front[i] == (study.feasible[i] and not beaten), i


def test_sliders_reach_every_design(explorer: Explorer, study: Scatter) -> None:
    control = explorer.by_key[STIFFNESS]
    assert (control.low, control.high) == (100.0, 2620.0)
    for values in study.values:
        for key, value in values.items():
            assert explorer.by_key[key].checked(value) == value


def test_a_study_of_another_machine_and_a_folder_without_results_are_refused_in_words(folder: Path) -> None:
    with pytest.raises(InputError, match=r"its base is .*lathe\.toml, expected .*two_mass\.toml"):
        Explorer(LIBRARY / "two_mass.toml", folder / "s.study.toml", folder / "out")
    with pytest.raises(InputError, match="nothing: holds no study"):
        Explorer(folder / "lathe.toml", folder / "s.study.toml", folder / "nothing")
    assert not (folder / "nothing").exists()
    with pytest.raises(InputError, match="expected both or neither"):
        Explorer(folder / "lathe.toml", folder / "s.study.toml")
    assert Explorer(folder / "lathe.toml").scatter() is None


def test_a_design_that_changes_several_keys_together_sets_their_sliders_together(tmp_path: Path) -> None:
    text = f"""
schema = "jointlib/study/1"
base = "{LIBRARY}/carriage.toml"
[[factor]]
name = "screw"
path = "bundle.screw"
values = [{{ diameter = "20 mm", nut_stiffness = "300 N/um" }}, {{ diameter = "32 mm", nut_stiffness = "2.5 kN/um" }}]
words = ["slim", "stout"]
[[objective]]
quantity = "static-compliance"
goal = "min"
"""
    (tmp_path / "s.study.toml").write_text(text)
    study = read_study(tmp_path / "s.study.toml")
    evaluate_all(study, begin(study, tmp_path / "out"), {}, workers=1)
    explorer = Explorer(LIBRARY / "carriage.toml", tmp_path / "s.study.toml", tmp_path / "out")
    found = explorer.scatter()
    assert found is not None
    assert found.unset == ()
    assert found.values == (
        {"bundle.screw.diameter": 20.0, "bundle.screw.nut_stiffness": 300.0},
        {"bundle.screw.diameter": 32.0, "bundle.screw.nut_stiffness": 2500.0},
    )
    assert explorer.by_key["bundle.screw.nut_stiffness"].high == 2500.0  # four times the file's 450 is less
    for row, values in zip(found.rows, found.values, strict=True):
        assert row[1] == pytest.approx(1e6 * explorer.moment(values).built.static_compliance, rel=1e-9)
