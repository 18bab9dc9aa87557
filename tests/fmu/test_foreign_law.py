"""A law that is none of ours, with its kernels beside it, becomes an FMU like one of ours."""

from __future__ import annotations

import importlib.util
import re
import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from host import law_force, path
from tools import require

from fmu.export import export_fmu
from fmu.members.archive import read_archive, unpack
from fmu.playback.replay import replay
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.law import JointLaw

PAGE = (Path(__file__).parents[2] / "docs" / "extend.md").read_text(encoding="utf-8")
both_versions = pytest.mark.parametrize("fmi", [2, 3])


def block(begins: str) -> str:
    """The fenced block of the page whose text begins so."""
    (found,) = (text for text in re.findall(r"^```\w*\n(.*?)^```$", PAGE, re.M | re.S) if text.startswith(begins))
    return found


@pytest.fixture
def mount(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., JointLaw]:
    """The rubber mount of the documentation as an installed package has it, with these kernels beside its module."""

    def law(*kernels: str) -> JointLaw:
        texts = {"rubber_mount.h": "/*\n   modes: 0\n", "rubber_mount_kernel.py": "import math\n"}
        package = tmp_path / "mount_laws"
        package.mkdir()
        (package / "law.py").write_text(block("# file: mount_laws/law.py\n"))
        for name in kernels:
            (package / name).write_text(block(texts[name]))
        spec = importlib.util.spec_from_file_location("mount_laws_law", package / "law.py")
        assert spec
        assert spec.loader
        module = importlib.util.module_from_spec(spec)
        monkeypatch.setitem(sys.modules, "mount_laws_law", module)
        spec.loader.exec_module(module)
        made: JointLaw = module.RubberMount(4e7, 3e-6)
        return made

    return law


@pytest.mark.thorough
@both_versions
def test_law_with_a_c_kernel_alone_exports_natively(fmi: int, mount: Callable[..., JointLaw], tmp_path: Path) -> None:
    require("cc")
    joint = Joint((mount("rubber_mount.h"),), "mount")
    told = export_fmu(joint, tmp_path / "a.fmu", fmi=fmi)
    assert told.runtime == "c"
    unpack(told.file, read_archive(told.file), tmp_path / "a")
    z, v = path()
    from fmpy import read_model_description

    read = read_model_description(str(tmp_path / "a"))
    assert {str(x.name) for x in read.outputs[0].dependencies} == {"displacement"}
    request = {
        "fmi": fmi,
        "guid": read.guid,
        "identifier": read.coSimulation.modelIdentifier,
        "folder": str(tmp_path / "a"),
        "inputs": [1, 2],
        "outputs": [3],
        "time": [1e-5 * i for i in range(len(z))],
        "values": np.column_stack([z, v]).tolist(),
    }
    expected = law_force(joint, z, v, 1e-5)
    found = np.array(replay(request)[0])[:, 0]
    assert found == pytest.approx(expected, rel=0, abs=1e-12 * np.max(np.abs(expected)))


def test_law_with_a_python_kernel_alone_takes_the_python_runtime_and_says_what_is_missing(
    mount: Callable[..., JointLaw], tmp_path: Path
) -> None:
    told = export_fmu(Joint((mount("rubber_mount_kernel.py"),)), tmp_path / "a.fmu")
    assert told.runtime == "python"
    said = "there is no C kernel for rubber-mount (rubber_mount.h beside the module of the law)"
    assert any(said in text for text in told.messages)


@pytest.mark.parametrize(
    ("kernels", "asked", "said"),
    [
        (
            (),
            {},
            "rubber-mount: no FMU kernel for this law, expected rubber_mount.h (native) or rubber_mount_kernel.py",
        ),
        (("rubber_mount_kernel.py",), {"runtime": "c"}, "there is no C kernel for rubber-mount (rubber_mount.h beside"),
        (
            ("rubber_mount.h",),
            {"runtime": "python"},
            "no FMU kernel in Python for this law, expected rubber_mount_kern",
        ),
    ],
)
def test_missing_kernel_is_told_by_the_file_to_write(
    kernels: tuple[str, ...], asked: dict[str, str], said: str, mount: Callable[..., JointLaw], tmp_path: Path
) -> None:
    law = mount(*kernels)
    shutil.rmtree(tmp_path / "out", ignore_errors=True)
    (tmp_path / "out").mkdir()
    with pytest.raises(InputError) as error:
        export_fmu(Joint((law,)), tmp_path / "out" / "a.fmu", **asked)  # type: ignore[arg-type]
    assert said in str(error.value)
    assert "\n" not in str(error.value)
    assert list((tmp_path / "out").iterdir()) == []
