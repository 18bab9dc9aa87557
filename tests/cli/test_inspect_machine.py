"""``jointlib inspect`` of machines: masses, stiffness, modes, contacts summed up, and what looks wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from command_line import jointlib

from machines import natural_modes, read_machine

LIBRARY = Path("machines/library")


def test_it_sums_contacts_up_and_shows_each_on_request(here: Path) -> None:
    said = jointlib(f"inspect {LIBRARY / 'lathe.toml'}").out
    every = jointlib(f"inspect {LIBRARY / 'lathe.toml'} --contacts").out
    assert "connection z_guide (linear-guide): slide – bed, hertz-contact + viscous, 16 contacts" in said
    assert "connection z_guide_1.upper_left_1: slide – bed" in every
    assert every.count("\nconnection ") == len(read_machine(LIBRARY / "lathe.toml").connections)
    assert said.count("\nconnection ") < 12


def test_it_weighs_the_parts_and_tells_stiffness_and_modes(here: Path) -> None:
    data = jointlib(f"inspect {LIBRARY / 'lathe.toml'} --json").json
    lines = data["lines"]
    machine = read_machine(LIBRARY / "lathe.toml")
    assert data["warnings"] == []
    (whole,) = [line for line in lines if line.startswith("whole: ")]
    spindle = machine.components[1]
    weight = spindle.weight(np.array([0.0, 0.0, 1.0]))
    assert weight is not None
    down = sum(w for w, dof in zip(weight, spindle.dofs, strict=True) if dof.endswith(".z"))
    assert float(whole.split()[1]) == float(f"{1600 + 160 + 130 + down:.4g}")
    (guide,) = [line.split() for line in lines if line.startswith("x_guide  ") and " to " not in line]
    # Four carriages of 520 N/um along the normal; at 45 degrees as much sideways, nothing along the travel.
    assert [float(word) for word in guide[1:4]] == [0.0, 2080.0, 2080.0]
    first = natural_modes(machine).frequency[0]
    assert any(line.startswith(f"{first:.5g} ") for line in lines)
    assert "1 free motion, which nothing holds" in lines


def test_what_looks_wrong_stands_first_and_among_the_warnings_of_lobes(here: Path) -> None:
    text = (LIBRARY / "two_mode_tool.toml").read_text()
    Path("m.toml").write_text(text.replace('"20 mm"', "20"))
    done = jointlib("inspect m.toml")
    assert done.status == 0
    assert done.out.splitlines()[1].startswith("looks wrong: [cutting]: diameter is 2e+04 mm")
    (warning,) = jointlib("inspect m.toml --json").json["warnings"]
    assert warning in jointlib("lobes m.toml --speed 9000 --json").json["warnings"]


def test_a_beam_of_kilometres_is_said_and_not_computed(here: Path) -> None:
    text = (
        (LIBRARY / "lathe.toml").read_text().replace("mount.joint.toml", str((LIBRARY / "mount.joint.toml").resolve()))
    )
    Path("m.toml").write_text(text.replace('length = "420 mm"', 'length = "420 m"'))
    done = jointlib("inspect m.toml")
    assert done.status == 0
    assert "spindle: it is 420.3 m long" in done.out


def test_of_a_study_it_tells_what_is_varied_and_what_counts(here: Path) -> None:
    said = jointlib(f"inspect {LIBRARY / 'guide_mill.study.toml'}").out.splitlines()
    assert said[0] == "study 'preload and cutter' of guide_mill.toml: 168 configurations, factorial"
    assert any(line.split()[:2] == ["preload", "connection.guide.joint.hertz_guide.preload"] for line in said)
    assert any("short, medium, long" in line for line in said)
    assert said[-2:] == [
        "wanted: removal rate large and static compliance small",
        "needed: minimum depth of at least 0.5 mm",
    ]


TOOLS = """[tool.plain]
x = "cutter.x"
y = "cutter.y"

[tool.uneven]
x = "cutter.x"
y = "cutter.y"
cutting = {{ {} }}
"""


def two_tools(cutting: str) -> Path:
    text = (LIBRARY / "two_mode_tool.toml").read_text()
    tool = '[tool]\nx = "cutter.x"\ny = "cutter.y"\n'
    assert tool in text
    file = Path("tools.toml")
    file.write_text(text.replace(tool, TOOLS.format(cutting)))
    return file


def test_a_fault_in_a_tool_that_is_not_in_use_is_told(here: Path) -> None:
    for pitch, words in (("[120, 120, 114]", "pitch is 354 degrees in all"), ("[180, 180]", "pitch has 2 angles")):
        file = two_tools(f"pitch = {pitch}")
        done = jointlib(f"inspect {file}")
        assert done.status == 2
        assert f"{file}: [tool.uneven]: [cutting]: {words}" in done.err
        assert "(line " in done.err
        assert jointlib(f"inspect {file} --tool plain").status == 0


def test_what_looks_wrong_with_a_tool_that_is_not_in_use_is_told(here: Path) -> None:
    file = two_tools("diameter = 20")
    (warning,) = jointlib(f"inspect {file} --json").json["warnings"]
    assert warning.startswith("with tool 'uneven': [cutting]: diameter is 2e+04 mm")
    assert f"looks wrong: {warning}" in jointlib(f"inspect {file}").out
    assert jointlib(f"inspect {file} --tool plain --json").json["warnings"] == []
