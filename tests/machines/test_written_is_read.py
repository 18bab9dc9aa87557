"""What the program writes it can read, whatever values and names stand in it, and no fit leaves the range of a law."""

from __future__ import annotations

import dataclasses
import json
import math
import tomllib
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from repeats import repeats

from jointlib import read_joint
from jointlib.corrections import faults
from jointlib.io.joint_file import joint_table, write_joint
from jointlib.io.measurement_file import read_measurement
from jointlib.io.measurement_write import write_measurement
from jointlib.joint import Covariance, Joint
from jointlib.law import JointLaw
from jointlib.laws.linear import Linear
from jointlib.measurement import Correction
from jointlib.parameter import Parameter, parameters_of
from jointlib.registry import laws
from machines import read_machine
from machines.answers.new import new
from machines.components.connection import Connection
from machines.components.lumped import Lumped
from machines.files.component_file import read_component
from machines.files.machine_writer import write_machine
from machines.loop.explanations.hypothesis import refit
from machines.loop.explanations.places import places_of
from machines.model.machine import Machine
from machines.study.study_file import read_study
from machines.uncoupling.spindle_end import write_spindle

LIBRARY = Path(__file__).parents[2] / "machines" / "library"
SLOW = settings(deadline=None, max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])
NAMES = st.text(st.characters(exclude_categories=["Cs"]), max_size=30)
SIZES, WIDE = st.floats(-12.0, 12.0), st.floats(-9.0, 9.0)
ANY = st.lists(SIZES, min_size=4, max_size=6)


def inside(p: Parameter, size: float) -> float:
    """A value in the range of a parameter, its ends among them."""
    value = math.copysign(10.0**size, 1.0)
    low = p.lower if math.isfinite(p.lower) else p.above if math.isfinite(p.above) else -math.inf
    if size <= -11.5 and math.isfinite(p.lower):
        return p.lower
    if math.isfinite(p.upper):
        share = 1 / (1 + 10.0**-size)
        return p.upper if size >= 11.5 else (0.0 if not math.isfinite(low) else low) * (1 - share) + p.upper * share
    return value if not math.isfinite(low) else low + value


def law_of(kind: str, sizes: list[float]) -> JointLaw:
    """A law with values anywhere in the ranges of its parameters."""
    cls, values = laws()[kind], {}
    for k, p in enumerate(parameters_of(cls)):
        value = inside(p, sizes[k % len(sizes)])
        if p.table:
            values[p.name] = ((0.0, value), (1e6 + value, -value))
        elif p.listed:
            values[p.name] = (value, 2 * value if 2 * value <= p.upper else value)
        else:
            values[p.name] = value
    return cls(**values)


@pytest.mark.parametrize("kind", sorted(laws()))
@SLOW
@given(sizes=st.lists(SIZES, min_size=4, max_size=6), name=NAMES, said=st.dictionaries(NAMES, NAMES, max_size=2))
def test_a_joint_comes_back_as_it_was_written(
    kind: str, sizes: list[float], name: str, said: dict[str, str], tmp_path: Path
) -> None:
    try:
        law = law_of(kind, sizes)
    except ValueError:  # parameters that exclude each other
        return
    joint = Joint((law, law), name, validity={"amplitude": (0.0, 1e-5)}, provenance=said)
    told = list(joint.parameters)
    matrix = np.diag([value**2 for value in joint.parameters.values()])
    joint = dataclasses.replace(joint, fixed=frozenset(told[:1]) - {n for n in told if "[" in n})
    if np.all(np.isfinite(matrix)) and np.all((np.diag(matrix) == 0) | (np.diag(matrix) > 1e-75)):
        joint = dataclasses.replace(joint, covariance=Covariance(tuple(told), matrix))
    path = tmp_path / "j.joint.toml"
    write_joint(path, joint)
    assert joint_table(read_joint(path)) == joint_table(joint)


def machine_on(joint: Joint) -> Machine:
    """A mass on a joint."""
    part = Lumped("slide", ("x",), np.array([[2.0]]))
    return Machine((part,), (Connection("guide", ("slide.x", "ground"), joint),), "one", {"x": "slide.x"})


@pytest.mark.parametrize(
    "kind", repeats(sorted(laws()), lambda kind: kind in ("bouc-wen", "stribeck"), lambda kind: kind < "d")
)
@SLOW
@given(sizes=st.lists(WIDE, min_size=4, max_size=6), u=st.lists(WIDE, min_size=9, max_size=9))
def test_no_refit_of_a_machine_leaves_the_range_of_a_law(kind: str, sizes: list[float], u: list[float]) -> None:
    """An exponent of 1 is the least there is: a tenth of it once stood in a trace of what a trace had written."""
    try:
        joint = Joint((Linear(1e7), law_of(kind, sizes)))
    except ValueError:
        return
    machine = machine_on(joint)
    (place,) = places_of(machine)
    hypothesis = refit(machine, place)
    asked = np.resize(np.array(u), len(hypothesis.coordinates))
    for x in (asked, hypothesis.bounded(asked), hypothesis.bounded(asked) - 1e-5, hypothesis.bounded(asked) + 1e-5):
        (found,) = hypothesis.joints(x, exact=True)
        for law in found.laws:
            for p in parameters_of(law):
                value = np.asarray(getattr(law, p.name), dtype=float)
                assert np.all((value >= p.lower) & (value <= p.upper) & (value > p.above))


def test_a_refit_ends_where_two_parameters_would_exclude_each_other() -> None:
    """Sliding friction cannot rise above that at rest: of 2 N and 5 N it is let up to 5 N, and no further."""
    joint = Joint((Linear(1e7), laws()["stribeck"](slip_force=2.0, static_force=5.0, stribeck_velocity=0.01)))
    hypothesis = refit(machine_on(joint), *places_of(machine_on(joint)))
    at = [c.name for c in hypothesis.coordinates].index("stribeck.slip_force")
    u = np.zeros(len(hypothesis.coordinates))
    for factor, expected in ((2.0, 4.0), (2.5, 5.0), (4.0, 5.0)):
        u[at] = np.log(factor)
        (found,) = hypothesis.joints(u, exact=True)
        assert found.parameters["stribeck.slip_force"] == pytest.approx(expected, rel=1e-9)
        assert found.parameters["stribeck.static_force"] == pytest.approx(5.0, rel=1e-12)


RIG = """schema = "jointlib/measurement/1"
kind = "rig"
sample_rate = 1000
period = 100
driven = "a"
provenance = { who = "me" }
[bodies]
a = 1.0
b = 2.0
[[channel]]
name = "a1"
quantity = "acceleration"
body = "a"
[[channel]]
name = "a2"
quantity = "acceleration"
body = "b"
[[channel]]
name = "P"
quantity = "force"
[[record]]
file = "r.csv"
"""


@pytest.mark.parametrize("family", sorted(faults("rig")))
@SLOW
@given(sizes=st.lists(st.floats(-8.0, 2.0), min_size=3, max_size=3))
def test_corrections_come_back_as_they_were_written(family: str, sizes: list[float], tmp_path: Path) -> None:
    source = tmp_path / "in.measurement.toml"
    source.write_text(RIG, "utf-8")
    (tmp_path / "r.csv").write_text("a1,a2,P\n1,2,3\n2,3,4\n")
    fault = faults("rig")[family]
    on = getattr(fault, "on", "channel")
    values = {name: 10.0**size for name, size in zip(fault.parameters, sizes * 3, strict=False)}
    site = {"channel": ("a2", None), "body": (None, "a")}.get(on, (None, None))
    correction = Correction(family, *site, values)
    target = tmp_path / "out.measurement.toml"
    write_measurement(target, read_measurement(source), [correction])
    (found,) = read_measurement(target).corrections
    assert (found.family, found.channel, found.body) == (family, *site)
    assert dict(found.parameters) == values
    assert tomllib.loads(target.read_text("utf-8"))["provenance"]["who"] == "me"


FILES = (
    'q"uote',
    "back\\slash",
    "sing'le",
    "#x",
    "{x}",
    "ü",
    "<img src=x onerror=alert(1)>",
    "a b",
    '"""',
    "new\nline",
)


@pytest.mark.parametrize("name", FILES)
def test_a_mended_measurement_finds_its_records_whatever_they_are_called(name: str, tmp_path: Path) -> None:
    (tmp_path / "r.csv").write_text("a1,a2,P\n1,2,3\n2,3,4\n")
    (tmp_path / "r.csv").rename(tmp_path / f"{name}.csv")
    source, target = tmp_path / "in.measurement.toml", tmp_path / name / "out.measurement.toml"
    source.write_text(RIG.replace('"r.csv"', json.dumps(f"{name}.csv")), "utf-8")
    write_measurement(target, read_measurement(source), [])
    (record,) = read_measurement(target).records
    assert record.file.samefile(tmp_path / f"{name}.csv")


@pytest.mark.parametrize("name", FILES)
def test_what_a_user_begins_with_is_read_whatever_it_is_called(name: str, tmp_path: Path) -> None:
    machine, joint, measurement, study = (
        tmp_path / f"{name}{end}.toml" for end in ("", ".joint", ".measurement", ".study")
    )
    for kind, path in (("machine", machine), ("joint", joint), ("measurement", measurement)):
        new(kind, path)
    new("study", study, machine=machine)
    assert read_machine(machine).tool
    assert read_joint(joint).laws
    assert read_measurement(measurement).records[0].file.is_file()
    assert read_study(study).base.samefile(machine)


@SLOW
@given(
    lines=st.lists(st.floats(1.0, 1e4), min_size=8, max_size=12, unique=True),
    sizes=st.tuples(st.floats(4.0, 10.0), st.floats(-3.0, 4.0), st.floats(0.0, 5.0), st.floats(-3.0, 1.0)),
    place=st.lists(st.floats(-10.0, 10.0).map(lambda size: round(size, 6)), min_size=3, max_size=3),
    said=st.lists(NAMES, max_size=2),
)
def test_the_end_of_a_spindle_comes_back_as_it_was_written(
    lines: list[float], sizes: tuple[float, ...], place: list[float], said: list[str], tmp_path: Path
) -> None:
    f = np.array(sorted(lines))
    stiffness, mass, damping, lever = (10.0**size for size in sizes)
    one = 1 / (stiffness - mass * (2 * np.pi * f) ** 2 + 2j * np.pi * f * damping)
    H = one[:, None, None] * np.array([[1.0, lever], [lever, lever**2]])
    found = SimpleNamespace(
        frequency=f,
        receptance=H,
        variance=1e-6 * np.abs(H) ** 2,
        dofs=("nose.x", "nose.ry"),
        position=np.array(place),
        weak_bands=[(f[0], f[1])],
        notes=tuple(said),
    )
    path = tmp_path / "end.component.toml"
    write_spindle(path, found, [])  # type: ignore[arg-type]
    part = read_component(path, "spindle")
    assert part.dofs == found.dofs
    np.testing.assert_allclose(part.receptance(2 * np.pi * f), found.receptance, rtol=1e-9)


@SLOW
@given(
    name=NAMES,
    mass=st.floats(1e-6, 1e6),
    kind=st.sampled_from(sorted(laws())),
    sizes=st.lists(SIZES, min_size=4, max_size=6),
)
def test_a_machine_comes_back_as_it_was_written(
    name: str, mass: float, kind: str, sizes: list[float], tmp_path: Path
) -> None:
    try:
        joint = Joint((Linear(1e7), law_of(kind, sizes)))
    except ValueError:
        return
    target = tmp_path / "m.toml"
    changes = {"component.slide.mass[0][0]": mass, "name": name}
    write_machine(LIBRARY / "two_mass.toml", changes, target, joints={"guide": joint})
    found = read_machine(target)
    assert found.name == name
    assert found.components[0].mass[0, 0] == mass  # type: ignore[attr-defined]
    (connection,) = found.connections
    assert connection.joint is not None
    assert connection.joint.parameters == joint.parameters
