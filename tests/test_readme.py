"""The README: its Python runs, its verbs are the program's, its two command lines are there once each."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

import pytest

from jointlib.cli.main import verbs
from jointlib.loop.answer.report import Verdict

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text("utf-8")


@pytest.mark.thorough
def test_the_python_of_the_readme_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    (block,) = re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)
    (tmp_path / "machines").symlink_to(ROOT / "machines")
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    exec(compile(block, "README.md", "exec"), names)
    assert capsys.readouterr().out.strip() == names["report"].sentence
    assert names["report"].verdict in Verdict
    assert len(names["peaks"]) > 0
    assert names["lobes"].depth.shape == (3,)
    assert os.path.getsize("guide.fmu") > 0


def test_the_readme_names_every_verb() -> None:
    named = set(re.findall(r"`jointlib (\w+)", README)) | {"run"}
    assert named >= set(verbs())
    assert named <= set(verbs())


def test_the_two_command_lines_stand_alone() -> None:
    lines = [line for line in README.splitlines() if line.startswith("python3 -m venv ")]
    assert len(lines) == 2
    assert lines[0].endswith("jointlib run machines/library/guide_mill.toml -o out")
    assert lines[1].endswith("pytest -q -n 2 --dist loadfile")


def test_the_links_of_the_readme_lead_somewhere() -> None:
    targets = re.findall(r"\]\(([^)#]+)\)", README)
    assert targets
    assert all((ROOT / target).exists() for target in targets)
