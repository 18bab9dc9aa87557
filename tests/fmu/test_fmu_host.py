"""What a host without Python sees of a Python FMU: the refusal that the export announces."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from host import GUIDE, exported
from tools import require


@pytest.fixture(scope="module")
def host(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Our C host, compiled."""
    gcc = require("gcc")
    binary = tmp_path_factory.mktemp("host") / "host"
    source = Path(__file__).with_name("host.c")
    flags = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-pedantic"]
    subprocess.run([gcc, *flags, str(source), "-o", str(binary), "-ldl"], check=True)
    return binary


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="loads the Linux binary")
def test_host_without_python_cannot_load_a_python_fmu(host: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(exported(GUIDE).file) as archive:
        (name,) = (n for n in archive.namelist() if n.startswith("binaries/linux64/"))
        library = archive.extract(name, tmp_path)
    done = subprocess.run([str(host), library], capture_output=True, text=True, env={})
    assert done.returncode == 1
    assert "undefined symbol: " in done.stderr
    assert "Py" in done.stderr.split("undefined symbol: ")[1]
    assert "a host without Python cannot load it" in exported(GUIDE).messages[0]


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="loads a Linux binary")
def test_host_loads_a_library_that_needs_nothing_but_c(host: Path, tmp_path: Path) -> None:
    source, library = tmp_path / "plain.c", tmp_path / "plain.so"
    source.write_text('const char *fmi2GetVersion(void) { return "2.0"; }\n')
    subprocess.run([require("gcc"), "-shared", "-fPIC", str(source), "-o", str(library)], check=True)
    done = subprocess.run([str(host), str(library)], capture_output=True, text=True, env={})
    assert (done.returncode, done.stdout, done.stderr) == (0, "2.0\n", "")
