"""What looks like a mistake is said by a run beside its answer, and in the report beside what it concerns."""

from __future__ import annotations

import html
import re
import shutil
from pathlib import Path

import pytest
from command_line import LIBRARY, jointlib

import machines

TITLE = re.compile(r"<h2>(.*?)</h2>(.*?)(?=<h2>|\Z)", re.DOTALL)


@pytest.fixture
def uncompiled(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fmu.members.build.compilers", lambda: ())


def sections(folder: Path) -> dict[str, str]:
    """Text of every section of a report by its title."""
    page = (folder / "report.html").read_text("utf-8")
    found = {html.unescape(title): html.unescape(body) for title, body in TITLE.findall(page)}
    return {"": html.unescape(page[: page.index("<nav>")]), **found}


@pytest.mark.slow
@pytest.mark.usefixtures("uncompiled")
def test_cutting_data_off_by_a_thousand_stand_beside_the_depth(lathe: str) -> None:
    path = Path(lathe)
    text = path.read_text().replace("[response]", "[response]\nforce = [10]")
    path.write_text(text.replace("specific = 1e9", "specific = 1e9\nfeed = 0.15"))
    done = jointlib(f"run {lathe} -o out --amplitude 0")
    words = "[cutting]: feed is 150 mm, expected 0.0001 to 5 mm; times 1/1000 it would lie there: is its unit right?"
    assert done.status == 0, done.err
    assert f"warning: looks wrong: {words}" in done.out
    said = sections(Path("out"))
    assert f"looks wrong: {words}" in said[""]
    assert f"Looks wrong: {words}" in said["Stability lobes"]
    assert not [title for title, body in said.items() if "Looks wrong" in body and title != "Stability lobes"]
    path.write_text(text)
    right = jointlib(f"run {lathe} -o right --amplitude 0")
    assert "looks wrong" not in (right.out + (Path("right") / "report.html").read_text("utf-8")).lower()


@pytest.mark.slow
@pytest.mark.usefixtures("uncompiled")
def test_a_load_of_the_wrong_sign_stands_beside_the_working_point(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    others = [step for step in machines.steps() if step.name != "fmu"]
    monkeypatch.setattr("machines.road.piece.steps", lambda: others)
    shutil.copy(LIBRARY / "guide.joint.toml", here)
    text = (LIBRARY / "carriage.toml").read_text("utf-8")
    wrong = text.replace("gravity = true", "gravity = [0, 0, 9.81]").replace('"450 N/um"', '"450 N/mm"')
    wrong = wrong.replace('["150 Hz", "900 Hz"]', '["200 Hz", "230 Hz"]')
    (here / "hanging.toml").write_text(wrong, "utf-8")
    done = jointlib("run hanging.toml -o out --json")
    assert done.status == 0, done.err
    (step,) = [step for step in done.json["steps"] if step["step"] == "mistakes"]
    hangs = "[static]: gravity acts along (0, 0, 1), and the centre of gravity lies 30 mm or more below all"
    soft = "screw: the stiffness of a ball screw is 0.4"
    assert [said.startswith((hangs, soft)) for said in step["found"][:2]] == [True, True]
    said = sections(here / "out")
    assert [words in said["Static working point"] for words in (hangs, soft)] == [True, False]
    assert [words in said["Describing function of screw.axial"] for words in (hangs, soft)] == [False, True]
    assert all(words in said[""] for words in (hangs, soft))
