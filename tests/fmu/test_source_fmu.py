"""Without any C compiler: an FMU of sources alone, which is what it says it is."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import pytest
from fmpy.build import build_platform_binary
from fmpy.validation import validate_fmu
from host import GUIDE
from tools import require

from fmu.export import export_fmu
from fmu.members.archive import archive_bytes, read_archive, unpack
from fmu.verify import verify_fmu
from jointlib.errors import InputError

both_versions = pytest.mark.parametrize("fmi", [2, 3])


@pytest.fixture
def without_compilers(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """A computer on which none is found."""
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr(shutil, "which", lambda name: None)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    return monkeypatch


@both_versions
def test_sources_alone_are_validated_and_said_not_to_have_run(
    fmi: int, tmp_path: Path, without_compilers: pytest.MonkeyPatch
) -> None:
    told = export_fmu(GUIDE, tmp_path / "a.fmu", fmi=fmi, runtime="c")
    assert (told.platforms, told.verified_with) == ((), ())
    (said,) = (text for text in told.messages if "was not run" in text)
    assert said.startswith("The FMU was not run, as there is no C compiler here")
    assert "fmpy compile builds it" in said
    assert validate_fmu(str(told.file)) == []
    with pytest.raises(InputError, match=r"no binary for .*, expected one"):
        verify_fmu(told.file)


@pytest.mark.slow
@both_versions
def test_sources_alone_become_the_fmu_that_repeats_the_reference_run(
    fmi: int, tmp_path: Path, without_compilers: pytest.MonkeyPatch
) -> None:
    file = export_fmu(GUIDE, tmp_path / "a.fmu", fmi=fmi, runtime="c").file
    without_compilers.undo()
    require("cmake")
    require("cc")
    sources = read_archive(file)
    unpack(file, sources, tmp_path / "a")
    (tmp_path / "build").mkdir()
    build_platform_binary(tmp_path / "a", tmp_path / "build")
    (library,) = (x for x in (tmp_path / "a" / "binaries").rglob("*") if x.is_file())
    file.write_bytes(archive_bytes({**sources, str(library.relative_to(tmp_path / "a")): library.read_bytes()}))
    assert verify_fmu(file).difference <= 1e-12


def test_command_line_says_that_there_is_no_library(
    tmp_path: Path, without_compilers: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from jointlib.cli.main import main

    joint = Path(__file__).parents[2] / "machines" / "library" / "guide.joint.toml"
    argv = ["jointlib", "fmu", str(joint), "-o", str(tmp_path / "a.fmu"), "--runtime", "c"]
    without_compilers.setattr(sys, "argv", argv)
    with pytest.raises(SystemExit) as stop:
        main()
    out = capsys.readouterr().out
    assert stop.value.code == 0
    assert "platforms: none, c runtime" in out
    assert "verified with nothing" in out
    assert "The FMU was not run, as there is no C compiler here" in out
