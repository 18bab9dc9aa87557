"""What importers read beside the variables' names: sizes, units to show, bounds, terminals, the picture, the page."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from machine_host import LIBRARY, library_machine
from PIL import Image
from repeats import repeats
from samples import LAWS
from tools import require

import fmu.ssp
from fmu.export import export_fmu
from fmu.loop_step import Master, largest_step
from fmu.members.archive import read_archive
from fmu.members.description import Card, description_text
from fmu.members.documentation import step_notes
from fmu.members.figures import native_figures
from fmu.members.machine_parts import parts_of_machine
from fmu.members.machine_system import system_of_machine
from fmu.members.native import native_variables
from fmu.members.page import documentation_text
from fmu.members.terminals import ICON, TERMINALS, icon, terminals_text
from fmu.system.step_limit import operating_range, step_limit
from fmu.system.system import System, system_of_connection, system_of_joint
from fmu.systems import ssp_notes
from fmu.systems.ssv import ssv_text
from fmu.verify import verify_fmu
from jointlib.errors import InputError
from jointlib.io.joint_file import read_joint
from jointlib.joint import Covariance, Joint
from jointlib.law import JointLaw
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import Connection, Lumped, Machine, Rigid, read_machine

GUIDE = read_joint(LIBRARY / "guide.joint.toml")
both_versions = pytest.mark.parametrize("fmi", [2, 3])
one_version = pytest.mark.parametrize("fmi", repeats([2, 3], lambda fmi: fmi == 3))


def described(system: System, fmi: int, step: float | None = 1e-5) -> ElementTree.Element:
    return ElementTree.fromstring(description_text(system, Card("m", "t", "c", fmi, step, 1.0, ("all.c",), step)))


def reals(root: ElementTree.Element) -> dict[str, ElementTree.Element]:
    """The numbers of each variable by its name."""
    found = {}
    for variable in root.iterfind("ModelVariables/*"):
        real = variable.find("Real")
        found[variable.get("name", "")] = variable if real is None else real
    return found


@both_versions
@pytest.mark.parametrize("law", [law for law in LAWS if law.in_time], ids=lambda law: law.kind)
def test_every_least_value_of_a_parameter_is_allowed(law: JointLaw, fmi: int) -> None:
    joint = Joint((law,))
    for name, real in reals(described(system_of_joint(joint), fmi)).items():
        if name in joint.parameters and real.get("min") is not None:
            declared = joint._flat[name][1]
            least = float(real.get("min", "nan"))
            assert least >= declared.lower
            assert least > declared.above


@both_versions
def test_motions_are_micrometres_and_forces_what_the_joint_gives_at_its_ends(fmi: int) -> None:
    joint = Joint((Linear(2e8), Viscous(300.0)), validity={"amplitude": (0.0, 5e-6), "velocity": (0.0, 0.02)})
    real = reals(described(system_of_joint(joint), fmi))
    sizes = {name: float(real[name].get("nominal", "nan")) for name in ("displacement", "velocity", "force")}
    assert sizes == pytest.approx({"displacement": 5e-6, "velocity": 0.02, "force": 1000.0}, rel=1e-12)
    assert (real["displacement"].get("displayUnit"), real["velocity"].get("displayUnit")) == ("um", "mm/s")
    machine = reals(described(system_of_machine(library_machine("two_mass")), fmi))
    sizes = {name: float(machine[name].get("nominal", "nan")) for name in ("displacement_x", "guide.force", "force_x")}
    assert 1e-9 < sizes["displacement_x"] < 1e-3
    assert sizes["guide.force"] == pytest.approx(654.164e6 * sizes["displacement_x"], rel=1e-6)


@both_versions
def test_unit_to_show_is_a_factor_of_the_unit_in_si(fmi: int) -> None:
    root = described(system_of_joint(GUIDE), fmi)
    shown = {u.get("name"): u.find("DisplayUnit") for u in root.iterfind("UnitDefinitions/Unit")}
    for unit, name, value in (("m", "um", 3e-6 * 1e6), ("rad", "deg", 3e-6 * 180 / np.pi)):
        told = shown[unit]
        assert told is not None
        assert told.get("name") == name
        assert 3e-6 * float(told.get("factor", "nan")) == pytest.approx(value, rel=1e-15)
    names = {d.get("name") for d in shown.values() if d is not None}
    assert {real.get("displayUnit") for real in reals(root).values()} - {None} <= names


@both_versions
@pytest.mark.parametrize("step", [None, 1e-9, 1e-3])
def test_default_experiment_always_has_a_tolerance_and_no_endless_table(step: float | None, fmi: int) -> None:
    told = described(system_of_joint(GUIDE), fmi, step).find("DefaultExperiment")
    assert told is not None
    assert 0 < float(told.get("tolerance", "nan")) < 1e-3
    assert told.get("stepSize") == (None if step is None else repr(step))
    if step is not None:
        assert float(told.get("stopTime", "nan")) <= 5000 * step


def terminals(system: System) -> dict[str, dict[str, str]]:
    root = ElementTree.fromstring(terminals_text(system))
    return {
        str(t.get("name")): {
            str(m.get("memberName")): str(m.get("variableName")) for m in t.iterfind("TerminalMemberVariable")
        }
        for t in root.iterfind("Terminals/Terminal")
    }


def test_a_terminal_holds_displacement_velocity_and_force_of_one_place() -> None:
    plain = {q: q for q in ("displacement", "velocity", "force")}
    assert terminals(system_of_joint(GUIDE)) == {"joint": plain}
    sides = terminals(system_of_connection("guide", GUIDE, 2))
    assert sides == {i: {q: f"{q}_{i}" for q in plain} for i in ("1", "2")}
    mill = system_of_machine(library_machine("guide_mill"))
    found = terminals(mill)
    assert list(found) == ["x", "y", "guide"]
    assert found["guide"] == {q: f"guide.{q}" for q in plain}
    known = {s.name for s in (*mill.inputs, *mill.outputs)}
    assert {name for members in found.values() for name in members.values()} == known


def tilting(name: str = "pivot") -> Machine:
    """A table that tilts on a joint at its foot, driven by a moment there."""
    table = Rigid("table", 60.0, np.array([0.5, 0.8, 1.2]), points={"cut": np.array([0.0, 0.0, 0.06])})
    along = Joint((Linear(1e8), Viscous(3e3)))
    about = Joint(
        (Linear(1e6), Jenkins(2e5, 3.0), Viscous(60.0)),
        "foot",
        validity={"amplitude": (0.0, 1e-5)},
        covariance=Covariance(("linear.stiffness",), np.array([[1e8]])),
    )
    dofs = dict.fromkeys(("ux", "uy", "uz", "rx", "rz"), along)
    held = [Connection(dof, (f"table.{dof}", "ground"), joint) for dof, joint in dofs.items()]
    foot = Connection(name, ("table.ry", "ground"), about)
    return Machine((table,), (*held, foot), "tilting", {"x": "table.cut.x"}, drive="table.ry")


def test_a_joint_that_turns_has_angles_and_moments() -> None:
    system = system_of_machine(tilting())
    for fmi in (2, 3):
        root = described(system, fmi)
        units = {name: real.get("unit") for name, real in reals(root).items()}
        for name, unit in {
            "force_x": "N",
            "force_drive": "N m",
            "displacement_drive": "rad",
            "velocity_drive": "rad/s",
            "pivot.displacement": "rad",
            "pivot.velocity": "rad/s",
            "pivot.force": "N m",
            "pivot.linear.stiffness": "N m/rad",
            "pivot.viscous.damping": "N m s/rad",
            "pivot.jenkins.slip_force": "N m",
            "pivot.jenkins.slider": "rad",
            "ux.displacement": "m",
            "ux.linear.stiffness": "N/m",
            "ux.force": "N",
        }.items():
            assert units[name] == unit, name
        powers = {u.get("name"): dict(u[0].attrib) for u in root.iterfind("UnitDefinitions/Unit")}
        assert powers["N m/rad"] == {"kg": "1", "m": "2", "s": "-2", "rad": "-1"}
        told = root.find(".//Joint[@name='pivot']")
        assert told is not None
        assert [e.get("unit") for e in told] == ["rad", "N m/rad"]
    kinds = {
        t.get("name"): t.get("terminalKind") for t in ElementTree.fromstring(terminals_text(system)).iter("Terminal")
    }
    assert kinds["pivot"] == kinds["drive"] == "org.jointlib.rotation"
    assert kinds["ux"] == kinds["x"] == "org.jointlib.translation"
    page = documentation_text(system, ())
    for said in ("angle, µrad", "N m/µrad", "displacement, µm", "0 to 1e-05 rad", "<td>N m s/rad</td>"):
        assert said in page
    assert "angle of table.ry against ground" in page


def test_a_system_of_fmus_has_angles_and_moments_where_it_turns() -> None:
    parts = parts_of_machine(tilting())
    systems = fmu.ssp._systems(parts)
    signals = {s.name: s.unit for s in (*systems["table"].inputs, *systems["table"].outputs)}
    assert [signals[f"{q}_pivot"] for q in ("force", "displacement", "velocity")] == ["N m", "rad", "rad/s"]
    assert [signals[f"{q}_drive"] for q in ("force", "displacement", "velocity")] == ["N m", "rad", "rad/s"]
    assert [signals[f"{q}_x"] for q in ("force", "displacement", "velocity")] == ["N", "m", "m/s"]
    assert {s.unit for s in (*systems["pivot"].inputs, *systems["pivot"].outputs)} == {"rad", "rad/s", "N m"}
    entries = ElementTree.fromstring(ssv_text("joints", systems)).iterfind("{*}Parameters/{*}Parameter")
    units = {entry.get("name"): entry[0].get("unit") for entry in entries}
    assert (units["pivot.linear.stiffness"], units["ux.linear.stiffness"]) == ("N m/rad", "N/m")
    loop, tangents = fmu.ssp.stiffest_loop(parts)
    said = ssp_notes.step_notes(parts, loop, {master: largest_step(loop, master) for master in Master}, tangents)
    assert "pivot 1.2e+06 N m/rad and 60 N m s/rad" in said[0]
    assert "ux 1e+08 N/m and 3000 N s/m" in said[0]
    joint = systems["pivot"].joints[0][1]
    over = operating_range(joint)
    said = step_notes(systems["pivot"], "c", over, step_limit(joint, over))
    assert "k = 1.2e+06 N m/rad and c = 60 N m s/rad, for abs(z) up to 1e-05 rad" in said[1]


def test_a_connection_that_is_called_as_an_axis_of_the_tool_has_a_terminal_of_its_own() -> None:
    found = terminals(system_of_machine(tilting("x")))
    assert found["x"] == {q: f"{q}_x" for q in ("displacement", "velocity", "force")}
    assert found["x (joint)"] == {q: f"x.{q}" for q in ("displacement", "velocity", "force")}


def test_terminals_keep_to_the_schema_of_fmi_3(tmp_path: Path) -> None:
    import fmpy
    from lxml import etree

    schema = Path(fmpy.__file__).with_name("schema") / "fmi3" / "fmi3TerminalsAndIcons.xsd"
    for system in (system_of_joint(GUIDE), system_of_machine(library_machine("guide_mill"))):
        etree.XMLSchema(file=str(schema)).assertValid(etree.fromstring(terminals_text(system).encode()))


def test_the_picture_shows_a_curve_and_is_the_same_bytes_every_time(tmp_path: Path) -> None:
    drawn = icon(system_of_joint(GUIDE))
    (tmp_path / "a.png").write_bytes(drawn)
    pixels = np.asarray(Image.open(tmp_path / "a.png").convert("RGB"), dtype=int)
    blue = (pixels[..., 2] - pixels[..., 0]) > 60
    rows = [float(np.mean(np.flatnonzero(blue[:, j]))) for j in (14, 30, 66, 80)]
    assert rows == sorted(rows, reverse=True), "the force grows with the displacement"
    assert icon(system_of_joint(GUIDE)) == drawn
    assert icon(system_of_machine(library_machine("guide_mill"))) != drawn


def test_the_page_gives_each_parameter_with_its_error_and_where_the_joint_holds() -> None:
    names = ("linear.stiffness", "viscous.damping")
    joint = Joint(
        (Linear(2e8), Viscous(300.0)),
        "mount",
        validity={"amplitude": (0.0, 5e-6)},
        covariance=Covariance(names, np.diag([4e10, 25.0])),
        provenance={
            "simulated": True,
            "files": [{"file": "r1.csv <sha>", "sha256": "0123456789abcdef"}, {"file": "r2.csv", "sha256": "ab"}],
            "residuals": ["r1: 3 N rms, 0.2 % of the largest"],
        },
    )
    page = documentation_text(system_of_joint(joint), ("One sentence.",), [("made with", "jointlib")])
    for said in ("One sentence.", "made with", "linear.stiffness", "2.0000e8", "± 0.0020e8", "± 5", "5e-06 m"):
        assert said in page
    for said in ("r1.csv &lt;sha&gt; 0123456789ab; r2.csv ab", "<td>yes</td>", "3 N rms, 0.2 % of the largest"):
        assert said in page
    assert "{" not in page.split("<body>")[1]
    assert page.count("<svg") == 2
    assert "<script" not in page


@pytest.mark.slow
def test_what_importers_need_is_in_the_archive_and_a_date_only_where_it_is_set(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    require("cc")
    for fmi in (2, 3):
        members = read_archive(export_fmu(GUIDE, tmp_path / "a.fmu", fmi=fmi, runtime="c").file)
        assert {TERMINALS, ICON[fmi], "documentation/index.html"} <= set(members)
        root = ElementTree.fromstring(members["modelDescription.xml"])
        assert root.get("version")
        assert "BSD-3-Clause" in root.get("license", "")
        assert root.get("generationDateAndTime") is None
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    assert described(system_of_joint(GUIDE), 2).get("generationDateAndTime") == "1970-01-02T00:00:00Z"
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "tomorrow")
    with pytest.raises(InputError, match="SOURCE_DATE_EPOCH is 'tomorrow', expected seconds since 1970"):
        described(system_of_joint(GUIDE), 2)


def test_the_page_says_what_a_step_takes_and_which_clients_integrate_rightly() -> None:
    mill = dict(native_figures(system_of_machine(library_machine("guide_mill"))))
    assert re.fullmatch(r"\d+ multiplications and the laws of 1 joint, where .*", mill["a step takes at least"])
    assert "machines come out wrong" in mill["model exchange"]
    sliding = dict(native_figures(system_of_joint(Joint((Jenkins(4e7, 36.0), Linear(1e8))))))
    assert "laws with kinks (jenkins)" in sliding["model exchange"]
    assert "a step takes at least" not in sliding
    assert native_figures(system_of_joint(GUIDE)) == []


def test_forces_of_a_machine_may_go_on_within_a_step_and_motions_of_a_joint_are_held() -> None:
    for system, told in ((system_of_machine(library_machine("two_mass")), "true"), (system_of_joint(GUIDE), "false")):
        interface = described(system, 2).find("CoSimulation")
        assert interface is not None
        assert interface.get("canInterpolateInputs") == told
        interface = described(system, 3).find("CoSimulation")
        assert interface is not None
        assert interface.get("providesIntermediateUpdate", "false") == told
        asked = {
            v.get("name") for v in described(system, 3).iterfind("ModelVariables/*") if v.get("intermediateUpdate")
        }
        assert asked == ({s.name for s in system.inputs} if told == "true" else set())


@pytest.mark.slow
@one_version
def test_flat_names_are_identifiers_and_compute_the_same(fmi: int, tmp_path: Path) -> None:
    require("cc")
    machine = library_machine("three_joints")
    file = export_fmu(machine, tmp_path / "a.fmu", fmi=fmi, runtime="c", names="flat").file
    assert verify_fmu(file).difference < 1e-6
    members = read_archive(file)
    root = ElementTree.fromstring(members["modelDescription.xml"])
    names = [v.get("name", "") for v in root.iterfind("ModelVariables/*")]
    assert root.get("variableNamingConvention") == "flat"
    assert [name for name in names if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name)] == []
    assert len(set(names)) == len(names)
    own = native_variables(system_of_machine(machine))
    assert len(names) == len(own if fmi == 3 else [v for v in own if v.kind not in {"time", "indicator"}])
    terminals = ElementTree.fromstring(members[TERMINALS]).iterfind("Terminals/Terminal/TerminalMemberVariable")
    assert {str(m.get("variableName")) for m in terminals} <= set(names)


def test_flat_names_that_fall_together_are_refused(tmp_path: Path) -> None:
    joint = Joint((Linear(1e8), Viscous(300.0)))
    part = Lumped("slide", ("x", "y"), np.diag([2.0, 2.0]))
    ends = (("a.b", "slide.x"), ("a_b", "slide.y"))
    machine = Machine(
        (part,), tuple(Connection(n, (at, "ground"), joint) for n, at in ends), name="m", tool={"x": "slide.x"}
    )
    with pytest.raises(InputError, match=r"a_b.displacement and 'a.b'.displacement are both a_b_displacement"):
        export_fmu(machine, tmp_path / "a.fmu", names="flat")
    with pytest.raises(InputError, match="names is 'short', expected 'structured' or 'flat'"):
        export_fmu(machine, tmp_path / "a.fmu", names="short")
    with pytest.raises(InputError, match="names is 'flat', which needs the native runtime"):
        export_fmu(GUIDE, tmp_path / "a.fmu", runtime="python", names="flat")


@both_versions
def test_the_author_of_a_machine_file_is_told(fmi: int, tmp_path: Path) -> None:
    text = (LIBRARY / "two_mass.toml").read_text("utf-8")
    file = tmp_path / "mine.toml"
    (tmp_path / "two_mass.joint.toml").write_bytes((LIBRARY / "two_mass.joint.toml").read_bytes())
    file.write_text(text.replace('schema = "jointlib/machine/1"', 'schema = "jointlib/machine/1"\nauthor = "A < B"'))
    assert described(system_of_machine(read_machine(file)), fmi).get("author") == "A < B"
    assert described(system_of_machine(library_machine("two_mass")), fmi).get("author") is None
    joint = Joint((Linear(2e8),), provenance={"author": "C & D"})
    assert described(system_of_joint(joint), fmi).get("author") == "C & D"
