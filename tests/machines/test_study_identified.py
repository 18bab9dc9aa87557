"""What an identification left open travels to the results of a study: they spread as those of the sampled machines."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from jointlib.arrays import Array
from jointlib.errors import InputError
from machines import lobes_at_amplitude, read_machine
from machines.study.evaluation import Evaluation
from machines.study.findings.verdict import judge
from machines.study.run import begin, evaluate_all
from machines.study.study import Study
from machines.study.study_file import read_study
from machines.uncertainty.drawn_machines import sampled_machines

STIFFNESS, DAMPING, COUNT = 1e7, 950.0, 12
MACHINE = """
schema = "jointlib/machine/1"
connection = [{ name = "guide", between = ["slide.x", "ground"], joint = "guide.joint.toml" }]
tool = { x = "slide.x" }
response = { frequency = [60, 200] }
cutting = { process = "turning", specific = 1e9 }
[[component]]
name = "slide"
kind = "lumped"
dofs = ["x"]
mass = [[25.0]]
"""
JOINT = f"""
schema = "jointlib/joint/1"
name = "guide"
law = [{{ kind = "linear", stiffness = {STIFFNESS} }}, {{ kind = "viscous", damping = {DAMPING} }}]
"""
COVARIANCE = """
[covariance]
names = ["linear.stiffness", "viscous.damping"]
matrix = [[1e10, -1e6], [-1e6, 2500.0]]
"""
STUDY = """
schema = "jointlib/study/1"
base = "lathe.toml"
factor = [
    { path = "component.slide.mass[0][0]", values = [25.0, 26.0] },
    { path = "identification", role = "uncertain" },
]
conditions = { speed = [2000, 3000], speeds = 5 }
objective = [{ quantity = "minimum-depth", goal = "max" }]
"""


def written(folder: Path, joint: str = JOINT + COVARIANCE, study: str = STUDY, machine: str = MACHINE) -> Study:
    (folder / "lathe.toml").write_text(machine)
    (folder / "guide.joint.toml").write_text(joint)
    (folder / "s.study.toml").write_text(study + f"[sampling]\nsamples = {COUNT}\n")
    return read_study(folder / "s.study.toml")


def depths(study: Study) -> Array:
    return Evaluation(study.source)(0, len(study.numbers()))["minimum-depth"].reshape(2, COUNT)


def test_the_depths_of_a_study_are_those_of_the_sampled_machines(tmp_path: Path) -> None:
    study = written(tmp_path)
    found = depths(study)
    for mass, row in zip((25.0, 26.0), found, strict=True):
        machine = read_machine(study.base, {"component.slide.mass[0][0]": mass})
        sampled, _ = sampled_machines(machine, COUNT)
        wanted = [lobes_at_amplitude(m, np.linspace(2000, 3000, 5)).minimum_depth for m in sampled]
        assert np.ptp(wanted) > 0.05 * np.mean(wanted)
        np.testing.assert_allclose(np.sort(row), np.sort(wanted), rtol=1e-6)


def test_designs_are_compared_over_the_same_draws(tmp_path: Path) -> None:
    """More mass moves every draw by nearly as much: the ranking is sure where the two distributions overlap widely."""
    study = written(tmp_path)
    found = depths(study)
    assert abs(np.diff(found.mean(axis=1)))[0] < np.std(found[0])
    assert np.all(found[1] > found[0]) or np.all(found[1] < found[0])
    assert judge(study, {"minimum-depth": found.ravel()}).surer == 1.0


def test_a_parameter_that_is_chosen_is_taken_as_chosen_and_the_others_vary(tmp_path: Path) -> None:
    chosen = STUDY.replace("component.slide.mass[0][0]", "connection.guide.joint.linear.stiffness")
    study = written(tmp_path, study=chosen.replace("[25.0, 26.0]", "[9e6, 11e6]"))
    found = depths(study)
    for stiffness, row in zip((9e6, 11e6), found, strict=True):
        sampled, _ = sampled_machines(read_machine(study.base), COUNT)
        wanted = []
        for machine in sampled:
            (joint,) = machine.joints()
            machine = machine.with_joint("guide", joint.with_parameters({"linear.stiffness": stiffness}))
            wanted.append(lobes_at_amplitude(machine, np.linspace(2000, 3000, 5)).minimum_depth)
        np.testing.assert_allclose(np.sort(row), np.sort(wanted), rtol=1e-6)


@pytest.mark.thorough
def test_the_scatter_of_a_measured_receptance_travels_too(tmp_path: Path) -> None:
    """A mass on a spring as a record with noise: one line's relative error σ gives the peak about the same error."""
    f = np.arange(40.0, 240.0, 1.0)
    w = 2 * np.pi * f
    H = 1 / (STIFFNESS - 25.0 * w**2 + 1j * DAMPING * w)
    deviation = 0.01 * np.abs(H)
    np.savetxt(
        tmp_path / "slide.csv",
        np.stack([f, H.real, H.imag, deviation**2], axis=1),
        delimiter=",",
        header="f,re,im,variance",
        comments="",
    )
    head = MACHINE[: MACHINE.index("[[component]]")].replace(
        'connection = [{ name = "guide", between = ["slide.x", "ground"], joint = "guide.joint.toml" }]\n', ""
    )
    record = """[[component]]
name = "slide"
kind = "frf"
interpolation = "spline"
dofs = ["x"]
record = [{ file = "slide.csv", drive = "x", response = "x", quantity = "receptance" }]
"""
    values = '{ path = "cutting.specific", values = [1e9, 2e9] }'
    study = written(
        tmp_path,
        machine=head + record,
        study=STUDY.replace('{ path = "component.slide.mass[0][0]", values = [25.0, 26.0] }', values)
        .replace('"minimum-depth"', '"peak-receptance"')
        .replace('"max"', '"min"'),
    )
    peaks = Evaluation(study.source)(0, 2 * COUNT)["peak-receptance"].reshape(2, COUNT)
    np.testing.assert_array_equal(peaks[0], peaks[1])
    # The largest of a few lines near the peak, each with a deviation of 1 %/√2 in its size.
    assert 0.002 < np.std(peaks[0]) / np.abs(H).max() < 0.01
    assert np.mean(peaks[0]) == pytest.approx(np.abs(H).max(), rel=0.02)


@pytest.mark.parametrize(
    ("joint", "study", "said"),
    [
        (JOINT, STUDY, "no joint has a covariance and no measured FRF a variance"),
        (JOINT + COVARIANCE, STUDY.replace(', role = "uncertain"', ""), 'expected role = "uncertain"'),
        (JOINT + COVARIANCE, STUDY.replace(', role = "uncertain"', ', role = "uncertain", values = [1]'), "no values"),
    ],
)
def test_where_nothing_is_known_of_errors_it_is_said(tmp_path: Path, joint: str, study: str, said: str) -> None:
    def computed() -> None:
        opened = written(tmp_path, joint, study)
        evaluate_all(opened, begin(opened, tmp_path / "r"), {}, workers=1)

    with pytest.raises(InputError, match=said):
        computed()
