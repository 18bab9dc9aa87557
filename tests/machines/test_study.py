"""Studies: every configuration is worth what the commands say of the machine it stands for; ranking as by hand."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from jointlib import write_joint
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.laws.jenkins import Jenkins
from jointlib.system import processes
from machines import Beam, Rigid, frozen_receptance, lobes_at_amplitude, read_machine
from machines.cutting.amplitude.pocket import limit_of, pocket, removal_rate
from machines.lobes import Cutting
from machines.study import run
from machines.study.evaluation import Evaluation
from machines.study.findings.verdict import judge
from machines.study.inputs import inputs, inputs_hash
from machines.study.run import begin, evaluate_all, identity
from machines.study.study import Study
from machines.study.study_file import read_study
from machines.study.variants import Variant

LIBRARY = Path("machines/library").resolve()

STUDY = f"""
schema = "jointlib/study/1"
base = "{LIBRARY}/two_mass.toml"
[[factor]]
path = "connection.guide.joint.linear.stiffness"
range = ["500 N/um", "700 N/um"]
levels = 3
[[factor]]
name = "base"
path = "component.base.mass[0][0]"
values = [1.8, "2.2 kg"]
[[factor]]
path = "cutting.specific"
values = [1e9, 2e9]
[conditions]
speed = [2000, 9000]
[[objective]]
quantity = "removal-rate"
goal = "max"
[[objective]]
quantity = "weight"
goal = "min"
[[constraint]]
quantity = "minimum-depth"
at_least = "1 um"
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    text = (LIBRARY / "two_mass.toml").read_text().replace("two_mass.joint.toml", f"{LIBRARY}/two_mass.joint.toml")
    cut = '\n[cutting]\nprocess = "turning"\nspecific = 1e9\nfeed = "0.2 mm"\ndiameter = "80 mm"\n'
    (tmp_path / "lathe.toml").write_text(text + cut)
    (tmp_path / "s.study.toml").write_text(STUDY.replace(f"{LIBRARY}/two_mass.toml", "lathe.toml"))
    return tmp_path


def opened(folder: Path, *changes: tuple[str, str]) -> Study:
    text = (folder / "s.study.toml").read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    (folder / "changed.study.toml").write_text(text)
    return read_study(folder / "changed.study.toml")


def test_a_configuration_is_worth_what_the_command_says_of_its_machine(folder: Path) -> None:
    study = opened(folder, ('"weight"', '"static-compliance"'))
    found = Evaluation(study.source)(0, 12)
    for row in (0, 3, 6, 11):
        stiffness, mass, specific = study.numbers()[row]
        changes = {"component.base.mass[0][0]": [1.8, 2.2][int(mass)], "cutting.specific": [1e9, 2e9][int(specific)]}
        machine = read_machine(study.base, changes)
        joint = machine.connections[0].joint
        assert joint is not None
        machine = machine.with_joint("guide", joint.with_parameters({"linear.stiffness": 1e6 * float(stiffness)}))
        chart = lobes_at_amplitude(machine, np.linspace(2000, 9000, 100), 0.0, "turning")
        best = pocket([chart], Cutting(**(machine.cutting or {})), limit_of(machine, [0.0], "turning"))
        assert best is not None
        assert found["minimum-depth"][row] == pytest.approx(chart.minimum_depth, rel=1e-6)
        assert found["removal-rate"][row] == pytest.approx(best.removal_rate, rel=1e-6)
        assert found["pocket-speed"][row] == best.speed
        compliance = abs(frozen_receptance(machine, 0.1, 0.0).receptance[0, 0, 0])
        assert found["static-compliance"][row] == pytest.approx(compliance, rel=1e-6)


def test_blocks_do_not_depend_on_what_was_computed_before(folder: Path) -> None:
    study = opened(folder)
    whole = Evaluation(study.source)(0, 12)
    fresh = Evaluation(study.source)
    for first, end in ((8, 12), (0, 3), (3, 8)):
        for name, values in fresh(first, end).items():
            assert np.array_equal(values, whole[name][first:end])


def test_vibrating_joints_are_judged_at_their_amplitude(folder: Path) -> None:
    study = opened(folder, ("speed = [2000, 9000]", 'speed = [2000, 9000]\namplitude = [0, "20 um"]'))
    found = Evaluation(study.source)(0, 1)
    machine = read_machine(study.base, {"component.base.mass[0][0]": 1.8})
    joint = machine.connections[0].joint
    assert joint is not None
    machine = machine.with_joint("guide", joint.with_parameters({"linear.stiffness": 500e6}))
    lowest = [lobes_at_amplitude(machine, [3000.0], A).minimum_depth for A in (0.0, 20e-6)]
    assert found["minimum-depth"][0] == pytest.approx(min(lowest), rel=1e-4)
    assert lowest[1] < lowest[0]


@pytest.mark.parametrize("zeta", [0.002, 0.02, 0.2])
def test_the_largest_receptance_of_a_mode_is_that_of_its_resonance(folder: Path, zeta: float) -> None:
    """Largest |G| of one mode is 1/(2kζ√(1 − ζ²)), wherever the lines stand."""
    (folder / "one.toml").write_text(
        f"""schema = "jointlib/machine/1"
tool = {{ x = "tip.x" }}
response = {{ frequency = [20, 400] }}
[[component]]
name = "tip"
kind = "modal"
dofs = ["x"]
frequency = [123.4]
damping_ratio = [{zeta}]
modal_mass = [2.0]
shapes = [[1.0]]
"""
    )
    (folder / "one.study.toml").write_text(
        """schema = "jointlib/study/1"
base = "one.toml"
factor = [{ path = "component.tip.modal_mass[0]", values = [2.0, 4.0] }]
objective = [{ quantity = "peak-receptance", goal = "min" }]
"""
    )
    found = Evaluation(folder / "one.study.toml")(0, 2)["peak-receptance"]
    stiffness = np.array([2.0, 4.0]) * (2 * np.pi * 123.4) ** 2
    np.testing.assert_allclose(found, 1 / (2 * stiffness * zeta * np.sqrt(1 - zeta**2)), rtol=2e-5)


def results(study: Study, **values: list[float]) -> dict[str, np.ndarray]:
    names = {"rate": "removal-rate", "weight": "weight", "depth": "minimum-depth"}
    return {names[key]: np.array(v) for key, v in values.items()}


def test_ranking_front_and_constraints_are_those_by_hand(folder: Path) -> None:
    study = opened(folder)
    rate = [1.0, 5.0, 4.0, 3.0, 2.0, 9.0, 4.0, np.nan, 0.0, 0.0, 0.0, 0.0]
    weight = [1.0, 4.0, 3.0, 3.5, 2.0, 0.5, 3.0, 0.1, 9.0, 9.0, 9.0, 9.0]
    depth = [1.0, 1.0, 1.0, 1.0, 1.0, 1e-7, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]
    verdict = judge(study, results(study, rate=rate, weight=weight, depth=depth))
    assert verdict.best is not None
    assert verdict.best.number == 1
    assert (verdict.designs, verdict.feasible) == (12, 10)
    assert [d.number for d in verdict.leading] == [1, 2, 6, 3, 4]
    assert sorted(d.number for d in verdict.front) == [0, 1, 2, 4, 6]
    assert verdict.best.factors == {"stiffness": "500 N/um", "base": "1.8", "specific": "2000000000.0"}


def test_uncertain_factors_are_averaged_over_the_same_samples(folder: Path) -> None:
    uncertain = """path = "cutting.specific"
role = "uncertain"
distribution = { kind = "normal", mean = 1.5e9, deviation = 1e8 }"""
    study = opened(
        folder,
        ('path = "cutting.specific"\nvalues = [1e9, 2e9]', uncertain),
        ("[[constraint]]", "[sampling]\nsamples = 4\n[[constraint]]"),
    )
    numbers = study.numbers()
    assert numbers.shape == (24, 3)
    assert np.array_equal(numbers[:4, 2], numbers[20:, 2])
    rate = np.tile([1.0, 2.0, 3.0, 4.0], 6)
    rate[4:8] = [2.0, 3.0, 4.0, 3.0]  # the mean is higher, in three of four samples
    depth = np.ones(24)
    verdict = judge(study, {"removal-rate": rate, "weight": np.ones(24), "minimum-depth": depth})
    assert verdict.best is not None
    assert verdict.best.number == 1
    assert verdict.surer == 0.75
    assert verdict.best.results["removal-rate"] == 3.0
    assert verdict.best.spread["removal-rate"] == pytest.approx(np.std([2.0, 3.0, 4.0, 3.0]))
    depth[4] = 0.0  # one of four samples breaks the constraint
    verdict = judge(study, {"removal-rate": rate, "weight": np.ones(24), "minimum-depth": depth})
    assert verdict.best is not None
    assert verdict.best.number == 0


def test_a_changed_study_machine_or_joint_is_another_study(folder: Path) -> None:
    study = opened(folder)
    before = identity(study)
    evaluate_all(study, begin(study, folder / "r"), {}, workers=1)
    assert identity(opened(folder, ("levels = 3", "levels = 4")))["study"] != before["study"]
    machine = folder / "lathe.toml"
    machine.write_text(machine.read_text() + "# changed\n")
    changed = identity(opened(folder))
    assert changed["inputs"] != before["inputs"]
    with pytest.raises(InputError, match="another study"):
        begin(opened(folder), folder / "r")


def test_results_of_another_release_are_not_mixed_in(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study = opened(folder)
    evaluate_all(study, begin(study, folder / "r"), {}, workers=1)
    monkeypatch.setattr(run, "_code", lambda: "other")
    with pytest.raises(InputError, match=r"another study \(it differs in the release of jointlib\)"):
        begin(study, folder / "r")


@pytest.mark.slow
def test_one_worker_computes_elsewhere_where_this_process_has_many_threads(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study, pools = opened(folder), []

    def noted(workers: int) -> object:
        pools.append(workers)
        return processes.process_pool(workers)

    monkeypatch.setattr(run, "process_pool", noted)
    for threads, computed in ((True, []), (False, [1])):
        monkeypatch.setattr(run, "single_threaded", lambda threads=threads: threads)
        store = begin(study, folder / f"threads {threads}")
        evaluate_all(study, store, {}, workers=1)
        assert not store.missing()
        assert pools == computed


def test_machines_that_are_alternatives_are_compared(folder: Path) -> None:
    (folder / "b.toml").write_text((folder / "lathe.toml").read_text().replace("2.2", "4.4"))
    base = '[[factor]]\npath = "base"\nvalues = ["lathe.toml", "b.toml"]\n'
    study = opened(
        folder, ('[[factor]]\nname = "base"\npath = "component.base.mass[0][0]"\nvalues = [1.8, "2.2 kg"]\n', base)
    )
    found = Evaluation(study.source)(0, 12)
    assert np.unique(np.round(found["weight"], 6)).tolist() == [3.142, 5.342]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("connection.guide.joint.lin", "connection.giude.joint.lin"), "no joint at 'giude', did you mean 'guide'"),
        (("linear.stiffness", "linear.stifness"), "no parameter 'linear.stifness', did you mean 'linear.stiffness'"),
        (("component.base.mass", "component.bass.mass"), "no component 'bass', did you mean 'base'"),
        (('["500 N/um", "700 N/um"]', '["500 N", "700 N"]'), "unit 'N' does not fit"),
        (('["500 N/um", "700 N/um"]', '["700 N/um", "500 N/um"]'), "range from 700 to 500 is empty"),
        (('"weight"', '"wieght"'), "quantity is 'wieght', did you mean 'weight'"),
        (('goal = "max"', 'goal = "most"'), "goal is 'most'"),
        (('at_least = "1 um"', ""), "no limit given"),
        (('name = "base"', 'name = "specific"'), "two factors have the name 'specific'"),
        (("speed = [2000, 9000]", "speed = [9000, 2000]"), "not ascending"),
        (("levels = 3", ""), "a list or levels"),
        (("levels = 3", "levels = 3\nscal = 'log'"), "unknown key 'scal', did you mean 'scale'"),
        (("levels = 3", "levels = 9000000000"), "asks for 36,000,000,000 configurations, expected"),
        (("[1e9, 2e9]", "[1e9, 1e9]"), "values names 1000000000.0 twice"),
        (("[1e9, 2e9]", '[1e9, 2e9]\nwords = ["a", "a"]'), "words names 'a' twice"),
        (("[1e9, 2e9]", "[1e9, 2e9]\nlevels = 4"), "levels and values given"),
        (('name = "base"', 'name = " "'), "name is ' ', expected a word"),
        (('name = "base"', 'name = "case"'), "a factor has the name 'case', a column that tables have anyway"),
        (
            ('path = "cutting.specific"\nvalues = [1e9, 2e9]', 'path = "component.base.mass"\nvalues = [[[1.0]]]'),
            ("factor 'mass' puts its values over component.base.mass[0][0] of factor 'base'"),
        ),
        (('quantity = "weight"', 'quantity = "removal-rate"'), "two objectives ask for 'removal-rate'"),
        (('at_least = "1 um"', 'at_least = "2 um"\nat_most = "1 um"'), "expected at_least below at_most"),
        (("speed = [2000, 9000]", "speed = [2000, 9000]\nspeeds = 90000000000"), "expected at most 10,000"),
        (("speed = [2000, 9000]", "speed = [2000, 9000]\nspeeds = 20"), "expected speeds = 4"),
        pytest.param(
            *(("speed = [2000, 9000]", "speed = [2000, 2010]"), "expected a wider range of speeds"),
            marks=pytest.mark.slow,
        ),
        (("speed = [2000, 9000]", "speed = [2000, 9000]\nlobes = 'zero-order'"), "is about turning"),
        (
            ("[[constraint]]", '[sampling]\nmethod = "sobol"\ncount = 100\n[[constraint]]'),
            "power of two",
        ),
    ],
)
def test_studies_without_sense_are_refused_in_a_sentence(folder: Path, change: tuple[str, str], said: str) -> None:
    def computed() -> None:
        study = opened(folder, change)
        evaluate_all(study, begin(study, folder / "r"), {}, workers=1)

    with pytest.raises(InputError, match=re.escape(said)):
        computed()


def test_no_objective_or_no_factor_is_told(folder: Path) -> None:
    text = (folder / "s.study.toml").read_text()
    (folder / "x.toml").write_text(text.split("[[objective]]", maxsplit=1)[0])
    with pytest.raises(InputError, match=r"no \[\[objective\]\], expected at least one of minimum-depth"):
        read_study(folder / "x.toml")
    bare = folder / "lathe.toml"
    bare.write_text(bare.read_text().split("[cutting]")[0])
    (folder / "y.toml").write_text(
        text.replace("cutting.specific", "response.drive").replace("[1e9, 2e9]", '["slide.x"]')
    )
    with pytest.raises(InputError, match=r"'minimum-depth' needs a cut, but .*lathe.toml has no \[cutting\]"):
        begin(read_study(folder / "y.toml"), folder / "r")


def test_weight_is_that_of_the_parts() -> None:
    """Bodies by their mass, a steel beam by ρAL; the cutter of the column mill stands in its modules file."""
    machine = read_machine(LIBRARY / "column_mill_a.toml")
    bodies = sum(c.mass for c in machine.components if isinstance(c, Rigid))
    beams = [c for c in machine.components if isinstance(c, Beam)]
    volume = sum(s.length * s.profile.area * s.material.density for beam in beams for s in beam.segments)
    assert Variant(machine).weight == pytest.approx(bodies + volume, rel=1e-9)


CASES = """position = { x = ["-200 mm", 0.2], z = [0.1] }
[[conditions.material]]
name = "steel"
specific = 2e9
[[conditions.material]]
name = "aluminium"
specific = "700 N/mm^2"
feed = "0.1 mm"
speed = [6000, 9000]"""
WITH_CASES = (
    ("[[objective]]", CASES + "\n[[objective]]"),
    ('path = "cutting.specific"\nvalues = [1e9, 2e9]', 'path = "cutting.diameter"\nvalues = [0.08]'),
)


def test_conditions_are_the_product_of_positions_and_materials(folder: Path) -> None:
    study = opened(folder, *WITH_CASES)
    names = ["x -200 mm, steel", "x -200 mm, aluminium", "x 200 mm, steel", "x 200 mm, aluminium"]
    assert [case.name for case in study.cases] == names
    assert study.cases[1].position == {"x": -0.2, "z": 0.1}
    assert study.cases[0].changes == {"axis.x.position": -0.2, "axis.z.position": 0.1, "cutting.specific": 2e9}
    assert study.cases[3].changes["cutting.specific"] == 7e8
    assert study.repeats == 4
    assert len(study.numbers()) == 24
    assert [study.case(row).name for row in range(4)] == names
    assert study.case(9) is study.cases[1]
    assert [case.name for case in opened(folder).cases] == [""]


def test_rows_run_over_designs_then_cases_then_samples(folder: Path) -> None:
    text = CASES.replace("specific = 2e9", "exponent = 0.9").replace('specific = "700 N/mm^2"', "exponent = 0.8")
    uncertain = 'path = "cutting.specific"\nrole = "uncertain"\nrange = [1e9, 2e9]'
    study = opened(
        folder,
        ('path = "cutting.specific"\nvalues = [1e9, 2e9]', uncertain),
        ("[[objective]]", text + "\n[sampling]\nsamples = 3\n[[objective]]"),
    )
    numbers = study.numbers()
    assert study.shaped(np.arange(72.0)).shape == (6, 4, 3)
    assert study.shaped(np.arange(72.0))[1, 2].tolist() == [18, 19, 20]
    drawn = study.shaped(numbers[:, 2])
    assert np.all(drawn == drawn[0, 0])
    assert len(set(drawn[0, 0])) == 3
    stiffness = study.shaped(numbers[:, 0])
    assert np.all(stiffness == stiffness[:, :1, :1])
    assert [study.case(row) for row in (0, 3, 6, 9, 12)] == [*study.cases, study.cases[0]]


def test_a_design_counts_with_its_worst_case(folder: Path) -> None:
    """The pocket's speed is that of the worst case; a constraint that one case breaks is broken."""
    study = opened(folder, *WITH_CASES)
    rate = np.array([[5.0, 9.0, 4.0, 7.0], [8.0, 8.0, 3.0, 8.0]] * 3)
    rate[5, 0] = np.nan
    weight = np.array([[1.0, 1.0, 2.0, 1.0]] * 6)
    depth = np.ones((6, 4))
    depth[2, 3] = 1e-7
    speed = np.arange(24.0)
    values = {"removal-rate": rate, "weight": weight, "minimum-depth": depth, "pocket-speed": speed}
    verdict = judge(study, {name: v.ravel() for name, v in values.items()})
    assert verdict.feasible == 4
    assert verdict.best is not None
    assert verdict.best.number == 0
    assert verdict.best.results == {"removal-rate": 4.0, "weight": 2.0, "minimum-depth": 1.0, "pocket-speed": 2.0}
    assert [d.number for d in verdict.leading] == [0, 4, 1, 3]


def test_materials_replace_the_keys_of_the_cut(folder: Path) -> None:
    """Each case is worth what the same machine is worth with its material written into the file, speeds included."""
    text = CASES.replace('position = { x = ["-200 mm", 0.2], z = [0.1] }\n', "")
    study = opened(
        folder, *(change if i else (change[0], text + "\n[[objective]]") for i, change in enumerate(WITH_CASES))
    )
    found = {name: study.shaped(v) for name, v in Evaluation(study.source)(0, 12).items()}
    for case, (low, high), cut in (
        (0, (2000, 9000), {"cutting.specific": 2e9}),
        (1, (6000, 9000), {"cutting.specific": 7e8, "cutting.feed": 1e-4}),
    ):
        machine = read_machine(study.base, {"component.base.mass[0][0]": 1.8, **cut})
        joint = machine.connections[0].joint
        assert joint is not None
        machine = machine.with_joint("guide", joint.with_parameters({"linear.stiffness": 500e6}))
        chart = lobes_at_amplitude(machine, np.linspace(low, high, 100), 0.0, "turning")
        best = pocket([chart], Cutting(**(machine.cutting or {})), limit_of(machine, [0.0], "turning"))
        assert best is not None
        assert found["removal-rate"][0, case, 0] == pytest.approx(best.removal_rate, rel=1e-6)
        assert found["pocket-speed"][0, case, 0] == best.speed


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('\ndiameter = "80 mm"', "", "'removal-rate' needs 'diameter' in [cutting], but"),
        ('\nfeed = "0.2 mm"', "", "'removal-rate' needs 'feed' in [cutting], but"),
        ('[tool]\nx = "slide.x"', "", "'minimum-depth' is that of the tool point, but"),
    ],
)
def test_objectives_without_their_conditions_are_refused_first(folder: Path, old: str, new: str, said: str) -> None:
    machine = folder / "lathe.toml"
    text = machine.read_text()
    assert old in text
    machine.write_text(text.replace(old, new))
    with pytest.raises(InputError, match=re.escape(said)):
        begin(opened(folder), folder / "r")
    assert not (folder / "r").exists()


@pytest.mark.parametrize(
    ("conditions", "said"),
    [
        ("position = { x = [0.1] }", "position of axis 'x', which"),
        ("position = { x = [] }", "x is empty, expected at least one position"),
        ("position = { x = [0.1, '100 mm'] }", "x names a position twice"),
        ("position = 3", "position is 3, expected a table"),
        ('material = [{ name = "steel" }]', "says nothing of the cut, expected keys of [cutting]"),
        ('material = [{ name = "steel", specfic = 2e9 }]', "unknown key 'specfic', did you mean 'specific'?"),
        ('material = [{ name = "steel", tangential = 2e9 }]', "material 'steel': "),
        ('material = [{ name = "steel", diameter = "2 kg" }]', "unit 'kg' does not fit"),
        ('material = [{ name = "a", feed = 1e-4 }, { name = "a", feed = 2e-4 }]', "a word of its own"),
        ('material = [{ name = "a", specific = 2e9 }]', "cutting.specific is a factor and stands in [conditions]"),
    ],
)
def test_conditions_without_sense_are_refused_in_a_sentence(folder: Path, conditions: str, said: str) -> None:
    with pytest.raises(InputError, match=re.escape(said)):
        begin(opened(folder, ("speed = [2000, 9000]", f"speed = [2000, 9000]\n{conditions}")), folder / "r")


def test_speeds_must_stand_somewhere(folder: Path) -> None:
    with pytest.raises(InputError, match=r"'minimum-depth' needs speed = \[low, high\] in \[conditions\] or"):
        begin(opened(folder, ("speed = [2000, 9000]", "speeds = 20")), folder / "r")


@pytest.mark.slow
def test_positions_of_axes_are_computed_as_the_machine_that_stands_there(tmp_path: Path) -> None:
    """Static compliance of a column mill at three places: what a machine read at each place has; the worst counts."""
    (tmp_path / "p.study.toml").write_text(f"""
schema = "jointlib/study/1"
base = "{LIBRARY}/column_mill_b.toml"
[[factor]]
path = "bundle.x_guide.preload"
values = ["1500 N", "3 kN"]
[conditions]
position = {{ x = ["-250 mm", 0, "300 mm"] }}
[[objective]]
quantity = "static-compliance"
goal = "min"
""")
    study = read_study(tmp_path / "p.study.toml")
    begin(study, tmp_path / "r")
    rows = Evaluation(study.source)(0, 6)["static-compliance"]
    found = study.shaped(rows)[:, :, 0]
    for i, preload in enumerate((1500, 3000)):
        for j, x in enumerate((-0.25, 0, 0.3)):
            machine = read_machine(study.base, {"axis.x.position": x, "bundle.x_guide.preload": preload})
            G = frozen_receptance(machine, 0.1, 0.0).receptance[0]
            assert found[i, j] == pytest.approx(np.max(np.abs(np.diag(G))), rel=1e-5)
    verdict = judge(study, {"static-compliance": rows})
    assert verdict.best is not None
    assert verdict.best.number == 1
    assert verdict.best.results["static-compliance"] == np.max(found[1])


def test_a_position_beyond_the_travel_is_refused_first(tmp_path: Path) -> None:
    (tmp_path / "p.study.toml").write_text(f"""
schema = "jointlib/study/1"
base = "{LIBRARY}/column_mill_b.toml"
factor = [{{ path = "bundle.x_guide.preload", values = [1500] }}]
conditions = {{ position = {{ z = [0, "400 mm"] }} }}
objective = [{{ quantity = "weight", goal = "min" }}]
""")
    said = "[conditions]: position z is 400 mm, expected -100 to 300 mm, its travel"
    with pytest.raises(InputError, match=re.escape(said)):
        begin(read_study(tmp_path / "p.study.toml"), tmp_path / "r")


@pytest.mark.slow
def test_natural_factors_of_a_machine_tool_are_paths(tmp_path: Path) -> None:
    """Parts of another make, guide size, number of carriages, stick-out, joint file: each is the file written so."""
    text = (LIBRARY / "column_mill/modules.toml").read_text().replace("../", f"{LIBRARY}/")
    (tmp_path / "heavy.toml").write_text(text.replace('"260 kg"', '"400 kg"'))
    (tmp_path / "modules.toml").write_text(text)
    mill = (LIBRARY / "column_mill_a.toml").read_text().replace("column_mill/", "")
    (tmp_path / "mill.toml").write_text(mill)
    three = [[-0.3, -0.15, 0.74], [0.3, -0.15, 0.74], [0.0, 0.15, 0.74]]
    joints = LIBRARY / "mount.joint.toml"
    (tmp_path / "s.study.toml").write_text(f"""
schema = "jointlib/study/1"
base = "mill.toml"
[[factor]]
path = "parts[0]"
values = ["modules.toml", "heavy.toml"]
[[factor]]
path = "bundle.x_guide"
values = [{{ preload = "1500 N", stiffness = "700 N/um" }}, {{ preload = "2200 N", stiffness = "1000 N/um" }}]
words = ["size 35", "size 45"]
[[factor]]
path = "bundle.x_guide.at"
values = [{three}, [[-0.3, -0.15, 0.74], [0.3, -0.15, 0.74], [-0.3, 0.15, 0.74], [0.3, 0.15, 0.74]]]
words = ["three", "four"]
[[factor]]
path = "component.cutter.segment[1].length"
range = ["43 mm", "45 mm"]
levels = 2
[[factor]]
path = "connection.mount_1.x.joint"
values = ["{joints}"]
[[objective]]
quantity = "static-compliance"
goal = "min"
[[objective]]
quantity = "weight"
goal = "min"
""")
    study = read_study(tmp_path / "s.study.toml")
    begin(study, tmp_path / "r")
    assert {(tmp_path / "heavy.toml").resolve(), joints} <= set(inputs(study))
    found = Evaluation(study.source)(11, 12)
    assert study.numbers()[11].tolist() == [1, 0, 1, 45, 0]
    machine = read_machine(
        tmp_path / "mill.toml", {"parts[0]": "heavy.toml", "component.cutter.segment[1].length": 0.045}
    )
    G = frozen_receptance(machine, 0.1, 0.0).receptance[0]
    assert found["static-compliance"][0] == pytest.approx(np.max(np.abs(np.diag(G))), rel=1e-5)
    assert found["weight"][0] == pytest.approx(Variant(machine).weight, rel=1e-12)
    softer = Evaluation(study.source)(8, 9)["static-compliance"][0]
    assert softer > found["static-compliance"][0]


@pytest.mark.parametrize("mass", [300.0, 400.0])
def test_a_spindle_that_is_free_to_turn_does_not_keep_a_mill_from_its_modes(mass: float) -> None:
    """No force on the tool across the spindle turns it, so its free motion, ± rounding, is no mode of the tool."""
    machine = read_machine(LIBRARY / "column_mill_a.toml", {"component.table.mass": mass})
    modes = Variant(machine).modes
    assert modes is not None
    assert np.min(np.abs(modes.poles)) > 2 * np.pi * 20
    lines = np.array([1.0, 52.0, 400.0, 862.0, 2000.0])
    G = frozen_receptance(machine, lines, 0.0).receptance
    error = np.linalg.norm(modes(lines) - G, axis=(1, 2))
    assert np.all(error < 1e-6 * np.linalg.norm(G, axis=(1, 2)))


def test_a_pocket_has_one_speed_for_all_samples_and_that_is_the_best_on_average(folder: Path) -> None:
    """Who sets the speed does not know the mass of the slide: no speed removes more on average over its samples."""
    text = (folder / "s.study.toml").read_text()
    kept = text[: text.index('[[factor]]\nname = "base"')]
    (folder / "u.study.toml").write_text(
        f"""{kept}
[[factor]]
name = "base"
path = "component.base.mass[0][0]"
role = "uncertain"
range = [1.6, 2.4]
[conditions]
speed = [2000, 9000]
[[objective]]
quantity = "removal-rate"
goal = "max"
[sampling]
method = "factorial"
samples = 5
"""
    )
    study = read_study(folder / "u.study.toml")
    store = begin(study, folder / "r")
    rows = [store.rows(i, i) for i in range(store.blocks)]
    assert all((part.stop - part.start) % 5 == 0 for part in rows), "the samples of a design are in one block"
    found = {name: study.shaped(v)[:, 0] for name, v in Evaluation(study.source)(0, 15).items()}
    speeds = np.linspace(2000, 9000, 100)
    fine = np.unique(np.concatenate([np.linspace(2000, 9000, 6931), 0.98 * speeds, 1.02 * speeds]))
    near = np.searchsorted(fine, 0.98 * speeds), np.searchsorted(fine, 1.02 * speeds, side="right")
    inside = (speeds * 0.98 >= 2000) & (speeds * 1.02 <= 9000) & (0.04 * speeds > 3 * 7000 / 99)
    for design in range(3):
        worst, cut = [], None
        for sample in range(5):
            stiffness, mass = study.numbers()[5 * design + sample]
            machine = read_machine(study.base, {"component.base.mass[0][0]": float(mass)})
            joint = machine.connections[0].joint
            assert joint is not None
            machine = machine.with_joint("guide", joint.with_parameters({"linear.stiffness": 1e6 * float(stiffness)}))
            depth = lobes_at_amplitude(machine, fine, 0.0, "turning").depth
            lowest = [np.min(depth[low:high]) if ok else 0.0 for low, high, ok in zip(*near, inside, strict=True)]
            worst.append(np.array(lowest))
            cut = Cutting(**(machine.cutting or {}))
        at = int(np.argmax(speeds * np.mean(worst, axis=0)))
        assert np.all(found["pocket-speed"][design] == speeds[at])
        assert cut is not None
        rates = [removal_rate(cut, float(speeds[at]), 0.9 * float(one[at])) for one in worst]
        np.testing.assert_allclose(found["removal-rate"][design], rates, rtol=1e-4)
        alone = [float(speeds[int(np.argmax(speeds * one))]) for one in worst]
        assert len({*alone}) > 1, "each sample by itself would have had another speed"


@pytest.mark.thorough
def test_at_an_amplitude_a_changed_cut_drives_the_tool(tmp_path: Path) -> None:
    """The force that shakes the joint points along the chatter of the configuration's own cut, not of the file's."""
    write_joint(tmp_path / "slipping.joint.toml", Joint((Jenkins(4e6, 8.0),)))
    (tmp_path / "mill.toml").write_text(
        """
schema = "jointlib/machine/1"
tool = { x = "tip.x", y = "tip.y" }
response = { frequency = [60, 400] }
cutting = { process = "milling", teeth = 3, tangential = 6e8, normal = 2e8, mode = "down", immersion = 0.5 }
[[component]]
name = "tip"
kind = "modal"
dofs = ["x", "y", "joint"]
frequency = [150, 190]
damping_ratio = [0.03, 0.03]
modal_mass = [4.0, 5.0]
shapes = [[1.0, -0.6], [0.5, 1.0], [1.0, 0.8]]
[[connection]]
name = "slip"
between = ["tip.joint", "ground"]
joint = "slipping.joint.toml"
"""
    )
    (tmp_path / "a.study.toml").write_text("""
schema = "jointlib/study/1"
base = "mill.toml"
factor = [{ path = "cutting.mode", values = ["up", "down"] }]
conditions = { speed = [3000, 12000], amplitude = ["6 um"], speeds = 20 }
objective = [{ quantity = "minimum-depth", goal = "max" }, { quantity = "pocket-depth", goal = "max" }]
""")
    found = Evaluation(tmp_path / "a.study.toml")(0, 2)
    for i, mode in enumerate(("up", "down")):
        machine = read_machine(tmp_path / "mill.toml", {"cutting.mode": mode})
        chart = lobes_at_amplitude(machine, np.linspace(3000, 12000, 20), 6e-6, "zero-order")
        assert found["minimum-depth"][i] == pytest.approx(chart.minimum_depth, rel=1e-9)


@pytest.mark.slow
def test_a_spindle_that_turns_freely_stops_no_study(tmp_path: Path) -> None:
    """Its turning is a double pole at zero that rounding splits otherwise in every configuration; no cut sees it."""
    (tmp_path / "l.study.toml").write_text(
        f"""
schema = "jointlib/study/1"
base = "{LIBRARY}/lathe.toml"
factor = [{{ path = "connection.mount_3.y.joint.linear.stiffness", range = ["180 N/um", "420 N/um"], levels = 41 }}]
conditions = {{ speed = [1000, 3000] }}
objective = [{{ quantity = "minimum-depth", goal = "max" }}]
"""
    )
    study = read_study(tmp_path / "l.study.toml")
    found = Evaluation(study.source)(0, 41)["minimum-depth"]
    machine = read_machine(LIBRARY / "lathe.toml")
    for row in (4, 40):
        old = next(c.joint for c in machine.connections if c.name == "mount_3.y")
        assert old is not None
        changed = old.with_parameters({"linear.stiffness": 1e6 * float(study.numbers()[row, 0])})
        chart = lobes_at_amplitude(machine.with_joint("mount_3.y", changed), [2000.0], 0.0, "turning")
        assert found[row] == pytest.approx(chart.minimum_depth, rel=1e-6)


def test_a_file_that_goes_while_a_study_runs_is_no_machine_that_cannot_be(folder: Path) -> None:
    """Its configurations must not be kept as designs without results."""
    study = opened(folder)
    evaluation = Evaluation(study.source, files=inputs_hash(study))
    assert np.all(np.isfinite(evaluation(0, 2)["weight"]))
    (folder / "lathe.toml").unlink()
    fresh = Evaluation(study.source, files=evaluation.files)
    with pytest.raises(InputError, match=r"lathe\.toml: no such file"):
        fresh(0, 2)
