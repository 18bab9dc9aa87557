"""Tool files: a machine that names one is the machine with cutter, holder and joint written out."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from tool_files import AXES, CUT, HOLDER, JOINED, JOINT, ONE_PIECE, SECTION, SIZES, SPINDLE, TOOL, TWO, machine, written

from jointlib.cli.main import cli
from jointlib.errors import InputError
from machines import frozen_receptance, lobes_at_amplitude, read_machine
from machines.files.machine_writer import write_machine

LIBRARY = Path(__file__).parents[2] / "machines" / "library"


def printed(path: Path, *more: str) -> str:
    """The table of depths that `lobes` shows."""
    asked = ["lobes", str(path), "--speed", "6000", "--speed", "9000", "--method", "zero-order", *more]
    done = CliRunner().invoke(cli, asked, catch_exceptions=False)
    assert done.exit_code == 0, done.output
    found = re.search(r"(stable at .*\nspeed .*\n.*\n.*\n)", done.stdout)
    assert found is not None, done.stdout
    return found[1]


@pytest.mark.parametrize(("parts", "joint"), [(ONE_PIECE, ""), (JOINED, JOINT)])
@pytest.mark.parametrize("apart", [False, True])
def test_a_tool_file_makes_the_machine_with_the_tool_written_out(
    tmp_path: Path, parts: str, joint: str, apart: bool
) -> None:
    by_hand = printed(machine(tmp_path, parts=parts, tool=AXES, teeth=3))
    behind = 'holder = "a.holder.toml"\n' if apart else f"[[section]]\n{SECTION}{joint}"
    written(tmp_path, "a.holder.toml", HOLDER + joint)
    written(tmp_path, "a.tool.toml", f"{TOOL}{SIZES}{behind}{CUT}")
    path = machine(tmp_path, 'tool = "a.tool.toml"')
    assert printed(path) == by_hand
    write_machine(path, {}, tmp_path / "copy.toml")
    assert "tool.toml" not in (tmp_path / "copy.toml").read_text()
    assert printed(tmp_path / "copy.toml") == by_hand


@pytest.mark.thorough
def test_the_cutter_of_the_library_may_be_a_tool_file(tmp_path: Path) -> None:
    for name in ("end.component.toml", "end.npz"):
        shutil.copy(LIBRARY / name, tmp_path)
    text = (LIBRARY / "end_mill.toml").read_text()
    cutter = text[text.index('[[component]]\nname = "cutter"') : text.index("[tool]")]
    kept = text.replace(cutter, "").replace('[tool]\nx = "cutter.tip.x"\ny = "cutter.tip.y"\n', "")
    sizes = "\n".join(re.findall(r"(?m)^(?:material|diameter|flute|stick|equi|loss).*$", cutter))
    written(tmp_path, "a.tool.toml", f"{TOOL}{sizes}\n")
    path = written(tmp_path, "mill.toml", kept.replace('name = "end-mill"', 'name = "end-mill"\ntool = "a.tool.toml"'))
    assert printed(path) == printed(LIBRARY / "end_mill.toml")


def test_a_joint_of_shank_and_holder_is_a_compliance_in_series(tmp_path: Path) -> None:
    """G = R11 − R12 (R22 + S + J)⁻¹ R21 with the free cutter R, the end S of the holder and J of the joint."""
    lines = np.linspace(300.0, 3000.0, 28)
    written(tmp_path, "a.tool.toml", f"{TOOL}{SIZES}[[section]]\n{SECTION}{JOINT}")
    whole = read_machine(machine(tmp_path, 'tool = "a.tool.toml"'))
    found = frozen_receptance(whole, lines, 0.0).between("cutter.tip.x", "cutter.tip.x")
    free = next(c for c in whole.components if c.name == "cutter")
    parts = JOINED[: JOINED.index('[[connection]]\nname = "shank_x"')]
    empty = machine(
        tmp_path,
        parts=parts[parts.index('[[component]]\nname = "holder"') :],
        tool='[tool]\nx = "holder.front.x"\ny = "holder.front.ry"\n',
    )
    bare = frozen_receptance(read_machine(empty), lines, 0.0)
    ends = ("holder.front.x", "holder.front.ry")
    omega = 2 * np.pi * lines
    rows = [free.dofs.index(dof) for dof in ("tip.x", "shank.x", "shank.ry")]
    unit = np.eye(len(free.dofs))[rows]
    R = free.between(omega, unit, unit)
    S = np.array([[bare.between(a, b) for b in ends] for a in ends]).transpose(2, 0, 1)
    J = np.zeros((len(lines), 2, 2), dtype=complex)
    J[:, 0, 0], J[:, 1, 1] = 1 / (6e7 + 300j * omega), 1 / (2e4 + 0.1j * omega)
    T = np.linalg.inv(R[:, 1:, 1:] + S + J)
    G = R[:, 0, 0] - np.einsum("li,lij,lj->l", R[:, 0, 1:], T, R[:, 1:, 0])
    np.testing.assert_allclose(found, G, rtol=1e-6)


@pytest.mark.thorough
def test_several_tools_by_name_are_those_machines(tmp_path: Path) -> None:
    written(tmp_path, "a.tool.toml", f"{TOOL}{SIZES}{CUT}")
    written(tmp_path, "a.holder.toml", HOLDER)
    both = machine(tmp_path, tool=TWO)
    shown = {name: printed(both, "--tool", name) for name in ("short", "long")}
    assert read_machine(both).tool_name == "short"
    no_holder = ONE_PIECE.partition("[[component.section]]")
    apart = f"{no_holder[0]}[[connection]]{no_holder[2].partition('[[connection]]')[2]}"
    assert shown["short"] == printed(machine(tmp_path, parts=apart, tool=AXES, teeth=3))
    longer = ONE_PIECE.replace('stick_out = "60 mm"', 'stick_out = "80 mm"')
    assert shown["long"] == printed(machine(tmp_path, parts=longer, tool=AXES, teeth=2))


@pytest.mark.thorough
def test_stick_out_holder_and_file_of_the_tool_in_use_are_changed_by_path(tmp_path: Path) -> None:
    written(tmp_path, "a.tool.toml", f"{TOOL}{SIZES}{CUT}")
    written(tmp_path, "b.tool.toml", f"{TOOL}{SIZES.replace('12 mm', '16 mm')}")
    written(tmp_path, "a.holder.toml", HOLDER)
    both, one = machine(tmp_path, tool=TWO), written(tmp_path, "one.toml", "")
    one.write_text(SPINDLE.format(top='tool = "a.tool.toml"', parts="", tool="", teeth=5))
    speeds = [7000.0, 9000.0]

    def depth(path: Path, **changes: object) -> list[float]:
        told = {key.replace("__", "."): value for key, value in changes.items()}
        return lobes_at_amplitude(read_machine(path, told), speeds, 0.0, "zero-order").depth.tolist()

    assert depth(one, tool__stick_out="80 mm", tool__holder="a.holder.toml", cutting__teeth=2) == depth(
        both, tool__use="long"
    )
    assert depth(one, tool__stick_out=0.07) == depth(both, tool__stick_out=0.07)
    assert depth(one, tool__stick_out=0.07) == depth(one, component__cutter__stick_out=0.07)
    assert depth(one, tool__file="b.tool.toml", cutting__teeth=3) == depth(
        one, component__cutter__diameter=0.016, component__cutter__shank=0.016
    )
    assert depth(one, tool__file="b.tool.toml") != depth(one)


BAD = [
    ("a.tool.toml", 'diameter = "12 mm"', 'diametre = "12 mm"', "a.tool.toml: key 'diameter' is missing"),
    ("a.tool.toml", 'flute_length = "30 mm"', 'flute_length = "30 kg"', "a.tool.toml: flute_length"),
    ("a.tool.toml", "teeth = 3", "teth = 3", "a.tool.toml: [cutting]: unknown key 'teth'"),
    ("a.tool.toml", 'bore = "8 mm"', 'bore = "80 mm"', "a.tool.toml: [[section]] 1: bore is 0.08 m"),
    ("a.tool.toml", "rotation = 2e4", "rotation = -2e4", "a.tool.toml: [joint]: rotation is -20000, expected more"),
    ("mill.toml", 'name = "long"', 'nam = "long"', "[[tools]] 2 (a.tool.toml): key 'name' is missing"),
    ("mill.toml", 'stick_out = "80 mm"', 'stick_out = "80 kg"', "): stick_out: unit 'kg'"),
    ("mill.toml", "immersion = 0.5", "immersion = 5", "[cutting]: immersion"),
    ("mill.toml", "teeth = 5", "teeth = 4.5", "[cutting]: teeth is 4.5, expected a whole number"),
    ("mill.toml", 'component = "spindle"', 'component = "spindel"', "[spindle]: component is 'spindel', did you mean"),
]


@pytest.mark.parametrize("seed", range(12))
def test_faults_of_machine_and_tool_file_are_told_together_with_their_lines(seed: int, tmp_path: Path) -> None:
    spindle = '[spindle]\ncomponent = "spindle"\n'
    texts = {
        "a.tool.toml": f"{TOOL}{SIZES}[[section]]\n{SECTION}{JOINT}{CUT}",
        "mill.toml": SPINDLE.format(top="", parts=spindle, tool=TWO, teeth=5).replace('holder = "a.holder.toml"\n', ""),
    }
    three = [BAD[i] for i in np.random.default_rng(seed).permutation(len(BAD))[:3]]
    for name, old, new, _ in three:
        assert texts[name].count(old) == 1
        texts[name] = texts[name].replace(old, new)
    for name, text in texts.items():
        written(tmp_path, name, text)
    with pytest.raises(InputError) as refused:
        read_machine(tmp_path / "mill.toml")
    assert len(refused.value.sentences) == 3, refused.value
    for name, _, new, words in three:
        (said,) = (said for said in refused.value.sentences if words in said)
        (shown,) = re.findall(r"\(line (\d+): (.*)\)$", said)
        assert said.startswith(f"{tmp_path / name}: ")
        assert texts[name].splitlines()[int(shown[0]) - 1].strip() == shown[1]
        assert new == shown[1] or words.endswith("missing")


@pytest.mark.parametrize(
    ("top", "tool", "words"),
    [
        ('tool = "b.tool.toml"', "", r"tool refers to .*b\.tool\.toml, which does not exist \(line 3: tool ="),
        ('tool = "a.holder.toml"', "", r"a\.holder\.toml: schema is .*, expected \"jointlib/tool/1\""),
        ('tool = "a.tool.toml"', "[spindle]\naxis = [0, 0, 0]\n", r"\[spindle\]: axis is \[0.0, 0.0, 0.0\]"),
        (
            'tool = "a.tool.toml"',
            "[spindle]\naxis = [0, 0.1, 1]\n",
            r"axis is \[0.0, 0.1, 1.0\], expected the tool along",
        ),
        ('tool = "a.tool.toml"', '[spindle]\nholds = ["q"]\n', "holds 'q'"),
        ('tool = "a.tool.toml"', "[spindle]\nat = [0, 0, 1]\n", "no node at"),
        ('tool = "loose.tool.toml"', "", r"\[joint\] lies between shank and holder, expected \[\[section\]\]"),
        ('tool = "both.tool.toml"', "", "section stands beside a holder file"),
        ("", "[spindle]\naxis = [0, 0, 1]\n" + AXES.replace("cutter.tip", "spindle.nose"), "unknown key 'spindle'"),
        (
            "",
            '[[tools]]\nname = "a"\nfile = "a.tool.toml"\n[[tools]]\nname = "a"\nfile = "a.tool.toml"\n',
            "of its own",
        ),
        ("tools = 3", "", "tools is 3, expected tables"),
    ],
)
def test_a_tool_that_cannot_be_put_in_is_refused_in_a_sentence(tmp_path: Path, top: str, tool: str, words: str) -> None:
    written(tmp_path, "a.holder.toml", HOLDER)
    written(tmp_path, "a.tool.toml", f"{TOOL}{SIZES}")
    written(tmp_path, "loose.tool.toml", f"{TOOL}{SIZES}{JOINT}")
    written(tmp_path, "both.tool.toml", f'{TOOL}{SIZES}holder = "a.holder.toml"\n[[section]]\n{SECTION}')
    path = machine(tmp_path, top, tool=tool)
    with pytest.raises(InputError, match=words) as refused:
        read_machine(path)
    assert len(refused.value.sentences) == 1, refused.value


def test_a_tool_file_is_inspected_by_itself(tmp_path: Path) -> None:
    written(tmp_path, "a.holder.toml", HOLDER + JOINT)
    path = written(tmp_path, "a.tool.toml", f'{TOOL}holder = "a.holder.toml"\n{SIZES}{CUT}')
    done = CliRunner().invoke(cli, ["inspect", str(path)], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    steel = 7850 * np.pi / 4 * 0.04 * (0.032**2 - 0.008**2)
    carbide = 14450 * np.pi / 4 * (0.030 * 0.0096**2 + 0.030 * 0.012**2)
    assert f"cutter: {carbide:.4g} kg, stations tip, shank" in done.stdout
    assert f"holder: {steel:.4g} kg, stations front, face" in done.stdout
    assert "connection shank_x: 6e+07 N/m, 300 N s/m\n" in done.stdout
    assert "connection shank_ry: 20000 N m/rad, 0.1 N m s/rad\n" in done.stdout
    assert "connection shank_z: rigid\n" in done.stdout
    alone = CliRunner().invoke(cli, ["inspect", str(tmp_path / "a.holder.toml")], catch_exceptions=False)
    assert f"holder: {steel:.4g} kg" in alone.stdout


@pytest.mark.parametrize(
    ("kind", "old", "new", "words"),
    [
        ("tool", 'diameter = "12 mm"', 'diameter = "12 kg"', "diameter: unit 'kg'"),
        ("tool", "teeth = 3", "tooth = 3", "[cutting]: unknown key 'tooth'"),
        ("holder", 'bore = "8 mm"', 'bore = "80 mm"', "[[section]] 1: bore is 0.08 m"),
        ("holder", "length = ", "lenght = ", "[[section]] 1: key 'length' is missing, did you mean it by 'lenght'?"),
        ("holder", "rotation = 2e4", "turn = 2e4", "[joint]: key 'rotation' is missing"),
    ],
)
def test_what_is_wrong_with_a_tool_file_alone_is_told_with_its_line(
    tmp_path: Path, kind: str, old: str, new: str, words: str
) -> None:
    text = HOLDER + JOINT if kind == "holder" else f"{TOOL}{SIZES}{CUT}"
    assert text.count(old) == 1
    path = written(tmp_path, f"a.{kind}.toml", text.replace(old, new))
    with pytest.raises(InputError) as refused:
        CliRunner().invoke(cli, ["inspect", str(path)], catch_exceptions=False)
    (said,) = [said for said in refused.value.sentences if words in said]
    assert said.startswith(f"{path}: ")
    assert "(line " in said


def test_what_turns_is_told_in_units_of_turning(tmp_path: Path) -> None:
    written(tmp_path, "a.holder.toml", HOLDER + JOINT)
    written(tmp_path, "a.tool.toml", f'{TOOL}holder = "a.holder.toml"\n{SIZES}{CUT}')
    top = 'tool = "a.tool.toml"'
    path = written(
        tmp_path, "m.toml", SPINDLE.format(top=top, parts="[static]\ngravity = [0, -9.8, 0]\n", tool="", teeth=4)
    )
    done = CliRunner().invoke(cli, ["inspect", str(path)], catch_exceptions=False)
    rows = [line.split() for line in done.stdout.splitlines()]
    turned = next(i for i, row in enumerate(rows) if row[:4] == ["turned", "by", "the", "load"])
    assert rows[turned][4:] == ["at", "[urad]", "moment", "[N", "m]"]
    assert rows[turned + 1][0] in ("shank_rx", "shank")
    stiff = rows.index(["stiffness", "of", "a", "rotation", "[kN", "m/rad]"])
    assert rows[stiff + 1 : stiff + 3] == [["shank_rx", "20"], ["shank_ry", "20"]]
    along = rows.index(["stiffness", "along", "itself", "[N/um]"])
    assert ["shank_x", "60"] in rows[along + 1 : stiff]
    assert "shank_rx" not in [row[0] for row in rows[along + 1 : stiff]]
