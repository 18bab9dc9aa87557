"""What is kept of a setting: a machine that is the same elsewhere, under names that lead nowhere else."""

from __future__ import annotations

import re
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from lathe_file import lathe_file

from jointlib.errors import CheckFailed, InputError
from machines import frozen_receptance, lobes_at_amplitude, read_machine
from machines.explore import Explorer
from machines.explore.save import plain_name

LIBRARY = Path(__file__).parents[2] / "machines" / "library"
STIFFNESS = "connection.guide.joint.linear.stiffness"


@pytest.fixture
def lathe(tmp_path: Path) -> Explorer:
    return Explorer(lathe_file(tmp_path))


@pytest.mark.parametrize(
    "name",
    [
        "", " ", ".", "..", "../out", "a/../b", "a/b", "/etc/passwd", "a\\b", "C:x", "~", ".hidden", "a..b", "a.",
        "nul", "COM1.toml", "a\0b", "a\nb", "a" * 81, "übung", "<b>", "a%2fb", None, 3, ["a"],
    ],
)  # fmt: skip
def test_a_name_that_could_lead_out_of_the_folder_is_refused(lathe: Explorer, tmp_path: Path, name: object) -> None:
    folder = tmp_path / "kept"
    for write in (lathe.save, lathe.report):
        with pytest.raises(InputError, match=r"name: .*, expected letters, digits"):
            write({}, folder, name)  # type: ignore[arg-type]
    assert not folder.exists()


@pytest.mark.parametrize("name", ["best", "stiffer guide", "v2.1", "A-b_c", "  spaced  ", "x.toml"])
def test_plain_names_are_taken_as_they_are(name: str) -> None:
    assert plain_name(name) == name.strip()


@pytest.mark.parametrize(
    ("file", "values"),
    [
        ("carriage.toml", {"bundle.guide.joint.hertz_contact.preload": 500.0, "bundle.screw.position": 300.0}),
        ("three_joints.toml", {"connection.foot.joint.linear.stiffness": 250.0}),
        ("two_mode_tool.toml", {"cutting.teeth": 2, "cutting.feed": 0.07}),
    ],
)
def test_a_saved_machine_is_the_machine_of_the_setting(tmp_path: Path, file: str, values: dict[str, float]) -> None:
    explorer = Explorer(LIBRARY / file)
    written = explorer.save(values, tmp_path / "kept", "tried")
    assert written[0] == tmp_path / "kept" / "tried.toml"
    assert all(tmp_path / "kept" in path.resolve().parents and path.is_file() for path in written)
    machine, saved = explorer.moment(values).machine, read_machine(written[0])
    lines = np.linspace(*(machine.frequency or (1, 1)), 15)
    one, other = (frozen_receptance(m, lines, 1e-7).receptance for m in (machine, saved))
    assert np.allclose(one, other, rtol=1e-12, atol=0)
    assert saved.cutting == machine.cutting
    assert not np.allclose(one, frozen_receptance(explorer.base, lines, 1e-7).receptance) or saved.cutting


def test_nothing_that_is_there_is_ever_replaced(lathe: Explorer, tmp_path: Path) -> None:
    folder = tmp_path / "kept"
    (folder / "beside").mkdir(parents=True)
    (folder / "link.toml").symlink_to(tmp_path / "elsewhere.toml")
    lathe.save({}, folder, "one")
    before = (folder / "one.toml").read_bytes()
    for name in ("one", "one.toml", "beside", "link"):
        with pytest.raises(InputError, match="is there already, expected a new name"):
            lathe.save({STIFFNESS: 300.0}, folder, name)
    assert (folder / "one.toml").read_bytes() == before
    assert not (tmp_path / "elsewhere.toml").exists()


def test_of_two_users_who_take_one_name_one_gets_it(lathe: Explorer, tmp_path: Path) -> None:
    def save(stiffness: float) -> str:
        try:
            return str(lathe.save({STIFFNESS: stiffness}, tmp_path / "kept", "mine")[0])
        except InputError as error:
            return str(error)

    with ThreadPoolExecutor(4) as users:
        said = list(users.map(save, [300.0, 400.0, 500.0, 600.0]))
    assert sum("already" in word for word in said) == 3
    joint = read_machine(tmp_path / "kept" / "mine.toml").flexible[0].joint
    assert joint is not None
    won = [300.0, 400.0, 500.0, 600.0][next(i for i, word in enumerate(said) if "already" not in word)]
    assert joint.parameters["linear.stiffness"] == won * 1e6


@pytest.mark.slow
def test_a_report_shows_the_setting_and_needs_no_network(lathe: Explorer, tmp_path: Path) -> None:
    page = lathe.report({STIFFNESS: 432.1, "amplitude": 4.0}, tmp_path / "kept", "my setting.html")
    assert page == tmp_path / "kept" / "my setting.html"
    text = page.read_text("utf-8")
    for said in ("guide stiffness 432.1 N/µm", "Receptance of the tool point", "Stability lobes", "Recommended",
                 "Describing function of guide", "lathe.toml", "jointlib explore"):  # fmt: skip
        assert said in text, said
    assert not re.search(r"""(?:src|href)\s*=\s*["']?(?:https?:)?//""", text)
    assert not re.search(r"url\((?!#)", text)
    moments = [lathe.moment({STIFFNESS: 432.1, "amplitude": A}) for A in (0.0, 4.0)]
    speeds = np.linspace(2000, 9000, 100)
    lowest = min(lobes_at_amplitude(m.machine, speeds, m.amplitude).minimum_depth for m in moments)
    assert f"{lowest * 1e3:.4g} mm" in text
    with pytest.raises(InputError, match="is there already"):
        lathe.report({}, tmp_path / "kept", "my setting")


@pytest.mark.slow
def test_where_the_exact_method_gives_no_lobes_the_preview_stands_with_the_reason(tmp_path: Path) -> None:
    text = (LIBRARY / "two_mode_tool.toml").read_text()
    assert "speed = [4000, 25000]" in text
    (tmp_path / "slow.toml").write_text(text.replace("speed = [4000, 25000]", "speed = [20, 60]"))
    explorer = Explorer(tmp_path / "slow.toml")
    curves = explorer.curves({})
    reason = "waves of"
    assert any(reason in note for note in curves.notes)
    with pytest.raises(CheckFailed, match=reason):
        explorer.at({}, 40.0)
    page = explorer.report({}, tmp_path / "kept", "slow").read_text("utf-8")
    assert reason in page
    assert "zero-order" in page


@pytest.mark.thorough
def test_the_page_is_headed_by_what_the_machine_is_called(tmp_path: Path) -> None:
    pytest.importorskip("dash")
    from machines.explore.server import explorer_app

    explorer = Explorer(lathe_file(tmp_path))
    app, _ = explorer_app(explorer, "stem", tmp_path, lambda source, target: [])
    called = explorer.base.name
    assert called != "stem"
    assert app.title == f"{called} – jointlib"
    assert f"H1('{called}')" in repr(app.layout)
    assert "value='stem'" in repr(app.layout)
