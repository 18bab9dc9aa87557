"""Archives that are damaged, dishonest or hostile."""

from __future__ import annotations

import stat
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from host import GUIDE, exported

from fmu.members import archive
from fmu.members.archive import archive_bytes, read_archive
from fmu.verify import verify_fmu
from jointlib.errors import CheckFailed, InputError

Members = dict[str, bytes]
MANIFEST = "extra/org.fmi-standard.fmi-ls-ref/fmi-ls-manifest.xml"
CSV = "extra/org.fmi-standard.fmi-ls-ref/reference.csv"


def spoiled(tmp_path: Path, change: Callable[[Members], None]) -> Path:
    """The guide's FMU with its members changed."""
    members = read_archive(exported(GUIDE).file)
    change(members)
    file = tmp_path / "spoiled.fmu"
    file.write_bytes(archive_bytes(members))
    return file


def replaced(name: str, old: str, new: str) -> Callable[[Members], None]:
    def change(members: Members) -> None:
        assert old.encode() in members[name]
        members[name] = members[name].replace(old.encode(), new.encode())

    return change


def without(*ends: str) -> Callable[[Members], None]:
    def change(members: Members) -> None:
        for name in [n for n in members if n.endswith(ends)]:
            del members[name]

    return change


def bomb(members: Members) -> None:
    entities = "".join(f'<!ENTITY e{i} "{f"&e{i - 1};" * 10 if i else "x" * 100}">' for i in range(9))
    text = members["modelDescription.xml"].decode()
    head, body = text.split("\n", 1)
    text = f"{head}\n<!DOCTYPE d [{entities}]>\n{body}".replace('modelName="guide"', 'modelName="&e8;"')
    members["modelDescription.xml"] = text.encode()


def wide_bomb(members: Members) -> None:
    bomb(members)
    text = members["modelDescription.xml"].decode().replace('encoding="UTF-8"', 'encoding="UTF-16"')
    members["modelDescription.xml"] = text.encode("utf-16")


def physics(members: Members) -> None:
    name = next(n for n in members if n.startswith("resources/guide_"))
    replaced(name, "return damping * v", "return 2.0 * damping * v")(members)


def silent_crash(members: Members) -> None:
    name = next(n for n in members if n.startswith("resources/guide_"))
    replaced(name, "def do_step(self", "import os; os.abort()\n    def do_step(self")(members)
    foreign(members)


def slow(members: Members) -> None:
    name = next(n for n in members if n.startswith("resources/guide_"))
    replaced(name, "def do_step(self", "import time; time.sleep(60)\n    def do_step(self")(members)
    foreign(members)


def wrong_physics_of_a_foreign_tool(members: Members) -> None:
    physics(members)
    foreign(members)


def foreign(members: Members) -> None:
    replaced("modelDescription.xml", 'generationTool="jointlib', 'generationTool="someone')(members)


def foreign_column(members: Members) -> None:
    replaced(CSV, '"force"', '"kraft"')(members)
    foreign(members)


def refusing(members: Members) -> None:
    name = next(n for n in members if n.startswith("resources/guide_"))
    replaced(name, "def do_step(self", "def do_step(self): raise ValueError('worn out')\n    def spare(self")(members)
    foreign(members)


def shouting(members: Members) -> None:
    name = next(n for n in members if n.startswith("resources/guide_"))
    loud = "def do_step(self): raise ValueError('\\x1b[2J' + 'worn out ' * 10_000)\n    def spare(self"
    replaced(name, "def do_step(self", loud)(members)
    foreign(members)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (without(".so"), "no binary for linux64, expected one (win64 in it)"),
        (without(".so", ".dll"), "expected one (none in it)"),
        (without("modelDescription.xml"), "no modelDescription.xml in it"),
        (without("fmi-ls-manifest.xml"), f"no {MANIFEST} in it, expected an FMU with a reference run"),
        (without("reference.csv"), f"the manifest names {CSV}, which is not in the FMU"),
        (replaced(MANIFEST, 'role="result"', 'role="model"'), "the manifest names no CSV with role 'result'"),
        (replaced(MANIFEST, "reference.csv", "../../x.csv"), "x.csv, which is not in the FMU"),
        (replaced(CSV, '"time"', '"zeit"'), "expected a first column 'time'"),
        (foreign_column, "a column 'kraft', which is no variable of the FMU"),
        (replaced(CSV, "0.0,0.0,0.0,0.0", "0.0,zero,0.0,0.0"), "expected numbers in rows of 4"),
        (replaced(CSV, "0.0,0.0,0.0,0.0", "0.0,nan,0.0,0.0"), "not a table of finite numbers"),
        (bomb, "modelDescription.xml declares a document type"),
        (wide_bomb, "modelDescription.xml declares a document type"),
        (replaced("modelDescription.xml", "</fmiModelDescription>", ""), "modelDescription.xml is not well-formed XML"),
        (
            replaced("modelDescription.xml", 'fmiVersion="2.0"', 'fmiVersion="1.0"'),
            "FMI version 1.0, expected 2.0 or 3.0",
        ),
        (replaced("modelDescription.xml", "CoSimulation", "ModelExchange"), "no co-simulation in it"),
        (
            replaced("modelDescription.xml", 'modelIdentifier="guide', 'modelIdentifier="../guide'),
            "expected a C identifier",
        ),
    ],
)
def test_fmu_that_cannot_be_used_is_refused_in_a_sentence(
    change: Callable[[Members], None], said: str, tmp_path: Path
) -> None:
    file = spoiled(tmp_path, change)
    with pytest.raises(InputError) as error:
        verify_fmu(file)
    assert str(error.value).startswith(f"{file}: ")
    assert said in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (replaced("modelDescription.xml", 'guid="', 'guid="0'), "the guid does not belong to this content"),
        (replaced("modelDescription.xml", 'start="503.0"', 'start="504.0"'), "the guid does not belong"),
        (replaced(CSV, "0.0,0.0,0.0,0.0", "0.0,0.0,0.0,1.0"), "the guid does not belong to this content"),
        (physics, "the guid does not belong to this content"),
        (wrong_physics_of_a_foreign_tool, "force at t = "),
        (refusing, "the FMU does not run in FMPy"),
        (shouting, "the FMU does not run in FMPy"),
        (silent_crash, "the FMU ended the process that ran it (signal 6)"),
        (slow, "the FMU did not finish its reference run in 0.5 s"),
    ],
)
def test_fmu_that_contradicts_itself_fails_the_check(
    change: Callable[[Members], None], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if "0.5 s" in said:
        monkeypatch.setattr("fmu.verify._TIME_LIMIT", 0.5)
    with pytest.raises(CheckFailed) as error:
        verify_fmu(spoiled(tmp_path, change))
    assert said in str(error.value)
    assert str(error.value).isprintable()
    assert len(str(error.value)) < 1000


def test_invalid_description_fails_the_check(tmp_path: Path) -> None:
    def change(members: Members) -> None:
        replaced("modelDescription.xml", '<Unit name="N s/m">', '<Unit name="N s/metre">')(members)
        foreign(members)

    with pytest.raises(CheckFailed, match=r'FMPy finds the description invalid: The unit "N s/m"'):
        verify_fmu(spoiled(tmp_path, change))


@pytest.mark.parametrize("name", ["../evil.txt", "/evil.txt", "a/../../evil.txt", "C:/evil.txt", "..\\evil.txt"])
def test_member_that_would_leave_its_folder_is_refused(name: str, tmp_path: Path) -> None:
    file = spoiled(tmp_path, lambda members: members.update({name: b"x"}))
    with pytest.raises(InputError, match="would leave its folder"):
        verify_fmu(file)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["spoiled.fmu"]


def test_symbolic_link_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "link.fmu"
    info = zipfile.ZipInfo("resources/passwd")
    info.external_attr = (stat.S_IFLNK | 0o777) << 16
    with zipfile.ZipFile(file, "w") as zipped:
        zipped.writestr(info, "/etc/passwd")
    with pytest.raises(InputError, match="is a link or device"):
        verify_fmu(file)


@pytest.mark.filterwarnings("ignore:Duplicate name:UserWarning")
def test_name_given_twice_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "twice.fmu"
    with zipfile.ZipFile(file, "w") as zipped:
        zipped.writestr("modelDescription.xml", "<a/>")
        zipped.writestr("modelDescription.xml", "<b/>")
    with pytest.raises(InputError, match=r"member 'modelDescription\.xml' twice"):
        verify_fmu(file)


def test_file_that_is_also_a_folder_is_refused(tmp_path: Path) -> None:
    file = spoiled(tmp_path, lambda members: members.update({"modelDescription.xml/a": b"x"}))
    with pytest.raises(InputError, match="cannot be unpacked"):
        verify_fmu(file)


def test_archive_that_unpacks_to_too_much_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(archive, "LARGEST", 2 * 2**20)
    file = spoiled(tmp_path, lambda members: members.update({"resources/zeros": bytes(3 * 2**20)}))
    assert file.stat().st_size < 2**20
    with pytest.raises(InputError, match="more than 2 MiB unpacked"):
        verify_fmu(file)


@pytest.mark.parametrize("part", [0.0, 0.3, 0.99])
def test_truncated_archive_is_refused(part: float, tmp_path: Path) -> None:
    data = exported(GUIDE).file.read_bytes()
    file = tmp_path / "cut.fmu"
    file.write_bytes(data[: int(part * len(data))])
    with pytest.raises(InputError, match="not an intact zip archive"):
        verify_fmu(file)


def test_flipped_byte_is_refused(tmp_path: Path) -> None:
    data = bytearray(exported(GUIDE).file.read_bytes())
    data[len(data) // 3] ^= 0xFF
    file = tmp_path / "flipped.fmu"
    file.write_bytes(data)
    with pytest.raises(InputError, match="not an intact zip archive"):
        verify_fmu(file)


def test_missing_file_and_folder_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file, expected an FMU"):
        verify_fmu(tmp_path / "none.fmu")
    with pytest.raises(InputError, match="cannot be read"):
        verify_fmu(tmp_path)
