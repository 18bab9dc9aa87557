"""Native FMUs of both versions that were damaged or made to do harm, as the command line meets them."""

from __future__ import annotations

import stat
import struct
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from exported_library import GUIDE, exported
from fmpy import platform, platform_tuple

from fmu.members.archive import archive_bytes, read_archive
from jointlib.cli.main import main

Members = dict[str, bytes]
XML, BUILD = "modelDescription.xml", "sources/buildDescription.xml"
MANIFEST = "extra/org.fmi-standard.fmi-ls-ref/fmi-ls-manifest.xml"
CSV = "extra/org.fmi-standard.fmi-ls-ref/reference.csv"
HERE = {2: platform, 3: platform_tuple}
TOKEN = {2: "guid", 3: "instantiationToken"}
both_versions = pytest.mark.parametrize("fmi", [2, 3])


@pytest.fixture
def refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[[bytes, int], str]:
    """What ``jointlib fmu --verify`` says of an archive: one sentence, a status, and nothing left behind."""
    monkeypatch.chdir(tmp_path)

    def verify(data: bytes, status: int = 2) -> str:
        file = tmp_path / "bad.fmu"
        file.write_bytes(data)
        monkeypatch.setattr(sys, "argv", ["jointlib", "fmu", "--verify", "bad.fmu"])
        with pytest.raises(SystemExit) as stop:
            main()
        out, err = capsys.readouterr()
        last = err.strip().splitlines()[-1]
        assert (stop.value.code, out) == (status, ""), err
        assert last.startswith("jointlib: bad.fmu: ")
        assert "Traceback" not in err
        assert [path.name for path in tmp_path.iterdir()] == ["bad.fmu"]
        return last

    return verify


def spoiled(fmi: int, change: Callable[[Members], None]) -> bytes:
    """The guide's FMU with its members changed."""
    members = read_archive(exported(GUIDE, fmi).file)
    change(members)
    return archive_bytes(members)


def rewritten(fmi: int, name: str, old: str, new: str) -> bytes:
    """The guide's FMU with one text in one member changed."""

    def change(members: Members) -> None:
        assert old.encode() in members[name]
        members[name] = members[name].replace(old.encode(), new.encode())

    return spoiled(fmi, change)


def foreign(members: Members) -> None:
    """As if another tool had made it: the token says nothing about the content."""
    members[XML] = members[XML].replace(b'generationTool="jointlib', b'generationTool="someone')


@pytest.mark.thorough
@both_versions
def test_fmu_without_a_binary_for_this_computer_is_refused(fmi: int, refused: Callable[..., str]) -> None:
    def change(members: Members) -> None:
        for name in [name for name in members if name.startswith(f"binaries/{HERE[fmi]}/")]:
            del members[name]

    assert f"no binary for {HERE[fmi]}, expected one" in refused(spoiled(fmi, change))


@both_versions
def test_binary_in_the_folder_of_the_other_version_is_not_taken(fmi: int, refused: Callable[..., str]) -> None:
    def change(members: Members) -> None:
        for name in [name for name in members if name.startswith("binaries/")]:
            members[name.replace(f"/{HERE[fmi]}/", f"/{HERE[5 - fmi]}/")] = members.pop(name)

    assert f"no binary for {HERE[fmi]}, expected one" in refused(spoiled(fmi, change))


@both_versions
def test_fmu_without_a_description_is_refused(fmi: int, refused: Callable[..., str]) -> None:
    assert "no modelDescription.xml in it" in refused(spoiled(fmi, lambda members: members.pop(XML) and None))


@both_versions
def test_token_that_does_not_belong_to_the_content_fails_the_check(fmi: int, refused: Callable[..., str]) -> None:
    token = exported(GUIDE, fmi).token
    said = refused(rewritten(fmi, XML, f'"{token}"', f'"{token[::-1]}"'), status=1)
    assert f"the {TOKEN[fmi]} does not belong to this content" in said


@both_versions
def test_token_that_the_library_does_not_know_fails_the_check(fmi: int, refused: Callable[..., str]) -> None:
    def change(members: Members) -> None:
        foreign(members)
        token = exported(GUIDE, fmi).token.encode()
        members[XML] = members[XML].replace(b'"' + token + b'"', b'"{0}"')

    assert "the FMU does not run in FMPy" in refused(spoiled(fmi, change), status=1)


@both_versions
def test_library_that_is_no_library_fails_the_check(fmi: int, refused: Callable[..., str]) -> None:
    def change(members: Members) -> None:
        for name in [name for name in members if name.startswith("binaries/")]:
            members[name] = b"\x7fELF and nothing more"

    assert "the FMU does not run in FMPy" in refused(spoiled(fmi, change), status=1)


@both_versions
@pytest.mark.parametrize(
    "identifier", ["../../evil", "/tmp/evil", "a/b", "..", "", "evil.so", "a&#0;b", "g&#10;", "%2e%2e", "$HOME"]
)
def test_model_identifier_that_is_a_path_is_refused(identifier: str, fmi: int, refused: Callable[..., str]) -> None:
    own = exported(GUIDE, fmi).identifier
    said = refused(rewritten(fmi, XML, f'modelIdentifier="{own}"', f'modelIdentifier="{identifier}"'))
    assert "expected a C identifier" in said or "is not well-formed XML" in said


@both_versions
@pytest.mark.parametrize(
    "name", ["../evil", "/evil", "binaries/../../evil", "C:/evil", "..\\evil", "\\\\host\\evil", "a\0b", "sources/.."]
)
def test_member_that_would_leave_its_folder_is_refused(name: str, fmi: int, refused: Callable[..., str]) -> None:
    data = spoiled(fmi, lambda members: members.update({name.replace("\0", "\1"): b"x"}))
    assert "would leave its folder" in refused(data.replace(b"a\1b", b"a\0b"))


@both_versions
@pytest.mark.parametrize("kind", [stat.S_IFLNK, stat.S_IFIFO, stat.S_IFCHR])
def test_member_that_is_no_plain_file_is_refused(
    kind: int, fmi: int, refused: Callable[..., str], tmp_path: Path
) -> None:
    file = tmp_path / "bad.fmu"
    file.write_bytes(exported(GUIDE, fmi).file.read_bytes())
    info = zipfile.ZipInfo("resources/there")
    info.external_attr = (kind | 0o777) << 16
    with zipfile.ZipFile(file, "a") as archive:
        archive.writestr(info, "/etc/passwd")
    assert "member 'resources/there' is a link or device" in refused(file.read_bytes())


def with_entities(text: bytes, doctype: str) -> bytes:
    head, body = text.split(b"\n", 1)
    return head + b"\n" + doctype.encode() + b"\n" + body


@pytest.mark.parametrize(
    "doctype",
    [
        '<!DOCTYPE d [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">]>',
        '<!DOCTYPE d [<!ENTITY a SYSTEM "file:///etc/passwd">]>',
        '<!DOCTYPE d SYSTEM "http://localhost/evil.dtd">',
        '<!DOCTYPE d [<!ENTITY % p SYSTEM "file:///etc/passwd"> %p;]>',
    ],
)
@pytest.mark.parametrize(("fmi", "name"), [(2, XML), (3, XML), (2, MANIFEST), (3, MANIFEST), (3, BUILD)])
def test_document_type_in_any_xml_that_is_read_is_refused(
    name: str, fmi: int, doctype: str, refused: Callable[..., str]
) -> None:
    def change(members: Members) -> None:
        foreign(members)
        members[name] = with_entities(members[name], doctype)

    assert f"{name} declares a document type" in refused(spoiled(fmi, change))


@both_versions
def test_description_nested_without_end_is_refused(fmi: int, refused: Callable[..., str]) -> None:
    def change(members: Members) -> None:
        foreign(members)
        deep = b"<a>" * 100_000 + b"</a>" * 100_000
        members[XML] = members[XML].replace(b"</fmiModelDescription>", deep + b"</fmiModelDescription>")

    assert "FMPy finds the description invalid" in refused(spoiled(fmi, change), status=1)


@both_versions
def test_step_limit_that_is_no_time_is_refused(fmi: int, refused: Callable[..., str]) -> None:
    def change(members: Members) -> None:
        foreign(members)
        start = members[XML].index(b'maxStep="') + len(b'maxStep="')
        members[XML] = members[XML][:start] + b"soon" + members[XML][members[XML].index(b'"', start) :]

    assert "maxStep is 'soon', expected a positive number" in refused(spoiled(fmi, change))


@both_versions
@pytest.mark.parametrize(
    "text", ["time,force\n0,0\r1,0\n", 'time,force\n0,"' + "9" * 200_000, "time,force\n0\n1,2,3\n"]
)
def test_reference_run_that_is_no_table_is_refused(text: str, fmi: int, refused: Callable[..., str]) -> None:
    data = spoiled(fmi, lambda members: members.update({CSV: text.encode()}))
    assert f"{CSV}: " in refused(data)


@both_versions
@pytest.mark.parametrize("part", [0.0, 0.1, 0.5, 0.9, 0.999])
def test_truncated_archive_is_refused(part: float, fmi: int, refused: Callable[..., str]) -> None:
    data = exported(GUIDE, fmi).file.read_bytes()
    assert "not an intact zip archive" in refused(data[: int(part * len(data))])


def central(data: bytes, name: str) -> int:
    """Where the entry of a member begins in the directory of an archive."""
    start = data.rindex(name.encode()) - 46
    assert data[start : start + 4] == b"PK\x01\x02"
    return start


@both_versions
@pytest.mark.parametrize(
    ("declared", "said"),
    [
        (0xFFFFFFFE, "more than 512 MiB unpacked, too large for an FMU of a joint"),
        (10, "not an intact zip archive"),
    ],
)
def test_member_that_lies_about_its_size_is_refused_before_it_is_unpacked(
    declared: int, said: str, fmi: int, refused: Callable[..., str]
) -> None:
    """The second kind unpacks to 64 MiB and says ten bytes."""
    data = bytearray(spoiled(fmi, lambda members: members.update({"resources/bomb": bytes(64 * 2**20)})))
    struct.pack_into("<I", data, central(bytes(data), "resources/bomb") + 24, declared)
    assert len(data) < 2**20
    assert said in refused(bytes(data))


@both_versions
@pytest.mark.parametrize(("place", "value"), [(8, 1), (10, 99)])
def test_encrypted_or_unknown_compression_is_refused(
    place: int, value: int, fmi: int, refused: Callable[..., str]
) -> None:
    data = bytearray(exported(GUIDE, fmi).file.read_bytes())
    struct.pack_into("<H", data, central(bytes(data), XML) + place, value)
    assert "not an intact zip archive" in refused(bytes(data))


@both_versions
@pytest.mark.filterwarnings("ignore:Duplicate name:UserWarning")
def test_name_given_twice_is_refused(fmi: int, refused: Callable[..., str], tmp_path: Path) -> None:
    file = tmp_path / "bad.fmu"
    file.write_bytes(exported(GUIDE, fmi).file.read_bytes())
    with zipfile.ZipFile(file, "a") as archive:
        archive.writestr(XML, "<a/>")
    assert f"member '{XML}' twice" in refused(file.read_bytes())
