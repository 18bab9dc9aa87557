"""What a trace of a machine leaves behind: a machine file that can be used, and a page that can be read."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from jointlib.errors import InputError
from jointlib.io.joint_file import joint_table
from jointlib.joint import Covariance
from jointlib.laws.coulomb import Coulomb
from jointlib.loop.answer.report import Estimate, Status, Verdict
from machines import Machine, frozen_receptance, read_machine
from machines.loop.close import check_target, write_trace
from machines.loop.records import LevelFRF
from machines.loop.report import MachineCandidate, MachineRival, MachineTrace
from machines.report import Page
from machines.report.machine_trace_section import machine_trace_section

LIBRARY = Path(__file__).parents[2] / "machines" / "library"
LINES = np.linspace(80.0, 600.0, 60)


def level(force: float, response: str = "spindle.x", sealed: bool = False) -> LevelFRF:
    H = 1e-8 / (1 - (LINES / 300) ** 2 + 0.05j)
    name = f"{response}_{force:g}N.csv"
    return LevelFRF(name, "spindle.x", response, force, LINES, H, 0.01 * np.abs(H), "file", sealed, "0" * 64)


def traced(machine: Machine, mended: Machine, place: str | None, frfs: Sequence[LevelFRF] = ()) -> MachineTrace:
    """A report made by hand."""
    records = tuple(frfs) or (level(5.0), level(20.0), level(10.0, sealed=True))
    refit = MachineCandidate(
        place or "guide",
        "refit",
        "",
        {"viscous.damping": Estimate(900.0, "N s/m", 10.0, (880.4, 919.6))},
        {"viscous.damping": -2.0},
        1e4,
        {"5 N": 4e3, "20 N": 6e3},
        0.98,
        1,
        Status.ACCEPTED,
        "it explains most <on> what was left out",
    )
    other = replace(refit, place="foot", family="coulomb", rank=2, status=Status.REJECTED, share_of_current=-0.1)
    rival = MachineRival("foot", "coulomb", "coulomb", 0.97, "Drive base.x at 30 N: 12 deviations apart.", 12.0)
    rows = [{"name": r.name, "force": r.force, "relative": 0.05, "chi2": 25.0} for r in records]
    before = {"relative": 0.05, "in_sample": 0.06, "where": "sealed", "chi2": 25.0, "per_record": rows}
    after = before if place is None else {**before, "relative": 0.01, "in_sample": 0.01, "chi2": 1.0}
    plots = {}
    for i, r in enumerate(r for r in records if not r.sealed):
        values = (LINES, r.receptance, 1.05 * r.receptance, r.receptance, r.deviation)
        for key, value in zip(("frequency", "measured", "before", "after", "deviation"), values, strict=True):
            plots[f"{key}_{i}"] = value
    return MachineTrace(
        Verdict.NOTHING_MISSING if place is None else Verdict.AMBIGUOUS,
        "The FRFs point to <something>.",
        machine,
        mended,
        place,
        None if place is None else refit,
        (refit, other),
        () if place is None else (rival,),
        {"foot": {"stiffness": 0.2, "damping": 0.1, "amplitude": 0.0}, "guide": {"stiffness": 0.0, "damping": 1.0}},
        before,
        after,
        {"relative": 0.01},
        (),
        "Drive base.x.",
        ({"family": "quadratic", "why": "it is even", "needs": "second harmonics"},),
        {"seed": 0, "version": "0"},
        records,
        plots,
    )


def three_joints() -> Machine:
    return read_machine(LIBRARY / "three_joints.toml")


def tables(machine: Machine) -> list[dict[str, object]]:
    """Joints with all they hold, as files have them."""
    return [joint_table(joint) for joint in machine.joints()]


def mended(machine: Machine, names: Sequence[str]) -> Machine:
    """Friction and a covariance in the named connections; those that shared a joint go on sharing it."""
    changed = {}
    for name in names:
        old = next(c.joint for c in machine.flexible if c.name == name)
        assert old is not None
        covariance = Covariance(("viscous.damping",), np.array([[25.0]]))
        changed.setdefault(id(old), replace(old + Coulomb(3.0, 1e-4), covariance=covariance))
        machine = machine.with_joint(name, changed[id(old)])
    return machine


@pytest.mark.thorough
def test_a_mended_connection_reads_back_in_another_folder(tmp_path: Path) -> None:
    machine = three_joints()
    new = mended(machine, ["guide"])
    paths, _ = write_trace(traced(machine, new, "guide"), tmp_path / "out")
    assert {p.name for p in paths} == {"trace.json", "trace.npz", "machine.toml", "joint.toml"}
    found = read_machine(tmp_path / "out" / "machine.toml")
    assert tables(found) == tables(new)
    a, b = (frozen_receptance(m, LINES, 1e-6).receptance for m in (new, found))
    np.testing.assert_allclose(a, b, rtol=1e-12)
    assert json.loads((tmp_path / "out" / "trace.json").read_text())["place"] == "guide"


def test_a_joint_file_of_another_place_is_found_from_the_new_folder(tmp_path: Path) -> None:
    machine = three_joints()
    new = mended(machine, ["foot"])
    write_trace(traced(machine, new, "foot"), tmp_path / "deep" / "out")
    assert tables(read_machine(tmp_path / "deep" / "out" / "machine.toml")) == tables(new)


def test_files_of_components_are_found_from_the_new_folder(tmp_path: Path) -> None:
    (tmp_path / "in" / "data").mkdir(parents=True)
    np.savetxt(
        tmp_path / "in" / "data" / "modes.csv",
        [[100.0, 0.02, 30.0, 1.0]],
        delimiter=",",
        header="frequency,damping_ratio,modal_mass,x",
        comments="",
    )
    text = """schema = "jointlib/machine/1"
    [[component]]
    name = "frame"
    kind = "modal"
    dofs = ["x"]
    file = "data/modes.csv"
    [[connection]]
    name = "foot"
    between = ["frame.x", "ground"]
    joint = { law = [{ kind = "linear", stiffness = "3 N/um" }, { kind = "viscous", damping = 90 }] }
    """
    (tmp_path / "in" / "machine.toml").write_text(text)
    machine = read_machine(tmp_path / "in" / "machine.toml")
    new = mended(machine, ["foot"])
    write_trace(traced(machine, new, "foot"), tmp_path / "out")
    found = read_machine(tmp_path / "out" / "machine.toml")
    assert tables(found) == tables(new)
    assert found.components[0].receptance(2 * np.pi * LINES) == pytest.approx(
        machine.components[0].receptance(2 * np.pi * LINES)
    )


def test_a_mended_bundle_is_written_out_as_its_rows_and_that_is_said(tmp_path: Path) -> None:
    machine = read_machine(LIBRARY / "carriage.toml")
    rows = [c.name for c in machine.flexible if c.name.startswith("guide.")]
    new = mended(machine, rows)
    _, report = write_trace(traced(machine, new, "guide"), tmp_path / "out")
    assert f"written out as its {len(rows)} rows" in report.warnings[-1]
    found = read_machine(tmp_path / "out" / "machine.toml")
    theirs = {c.name: c for c in found.flexible}
    assert set(theirs) == {c.name for c in new.flexible}
    for c in new.flexible:
        assert theirs[c.name].joint is not None
        assert theirs[c.name].joint.parameters == c.joint.parameters  # type: ignore[union-attr]
        assert theirs[c.name].row(found.components) == pytest.approx(c.row(new.components), abs=1e-15)


def test_a_mended_connection_of_a_parts_file_is_mended_in_the_new_machine(tmp_path: Path) -> None:
    machine = read_machine(LIBRARY / "column_mill_a.toml")
    new = mended(machine, ["mount_1.z"])
    write_trace(traced(machine, new, "mount_1.z"), tmp_path / "out")
    assert tables(read_machine(tmp_path / "out" / "machine.toml")) == tables(new)


def test_where_nothing_is_named_the_machine_stays_as_it_is(tmp_path: Path) -> None:
    machine = three_joints()
    paths, _ = write_trace(traced(machine, machine, None), tmp_path / "out")
    assert "joint.toml" not in {p.name for p in paths}
    assert tables(read_machine(tmp_path / "out" / "machine.toml")) == tables(machine)


def test_the_files_of_the_machine_are_never_replaced(tmp_path: Path) -> None:
    machine = three_joints()
    write_trace(traced(machine, mended(machine, ["guide"]), "guide"), tmp_path / "out")
    check_target(LIBRARY / "three_joints.toml", tmp_path / "out")
    with pytest.raises(InputError, match=r"its machine.toml belongs to the machine to be traced"):
        check_target(tmp_path / "out" / "machine.toml", tmp_path / "out")
    text = (tmp_path / "out" / "machine.toml").read_text()
    (tmp_path / "out" / "mine.toml").write_text(text)
    (tmp_path / "out" / "machine.toml").unlink()
    with pytest.raises(InputError, match=r"its joint.toml belongs to the machine to be traced"):
        check_target(tmp_path / "out" / "mine.toml", tmp_path / "out")


def page(report: MachineTrace) -> str:
    section = machine_trace_section(report)
    return Page("T", report.sentence, [], [section], [], [], report.warnings, "x", "0").html()


@pytest.mark.slow
def test_the_page_answers_each_question_and_takes_no_text_for_markup() -> None:
    machine = three_joints()
    frfs = [level(f, r) for r in ("spindle.x", "base.x") for f in (20.0, 5.0)]
    html = page(traced(machine, mended(machine, ["guide"]), "guide", frfs))
    assert html.count("<svg") == 5
    for said in (
        "The FRFs point to &lt;something&gt;.",
        "&lt;on&gt;",
        "driving point spindle.x",
        "base.x from spindle.x",
        "Drive base.x at 30 N: 12 deviations apart.",
        "coulomb.slip_force",
        "spindle.x_20N.csv",
        "second harmonics",
    ):
        assert said in html
    assert html == page(traced(machine, mended(machine, ["guide"]), "guide", frfs))


@pytest.mark.thorough
def test_a_page_without_a_name_shows_no_model_after() -> None:
    machine = three_joints()
    html = page(traced(machine, machine, None))
    assert html.count("<svg") == 3
    assert "The mended joint" not in html
    assert "Nothing missing" in html


@pytest.mark.slow
def test_many_levels_are_thinned_and_that_is_said() -> None:
    machine = three_joints()
    html = page(traced(machine, machine, None, [level(float(f)) for f in range(1, 21)]))
    assert "more are in trace.npz" in html
