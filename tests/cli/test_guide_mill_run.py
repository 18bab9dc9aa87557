"""``jointlib run`` as its help shows it, once: a folder with a report and, beside it, every number the report shows."""

from __future__ import annotations

import contextlib
import hashlib
import html
import json
import re
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from browser import look
from command_line import LIBRARY, examples, jointlib, read, with_library, wrote
from conftest import Left

from fmu.verify import verify_fmu
from jointlib import read_joint
from jointlib.describing import DescribingFunction
from machines import lobes_at_amplitude, read_machine, response

pytestmark = pytest.mark.slow
VERDICTS = {"identified", "ambiguous", "partial", "unexplained", "nothing_missing"}


def page(folder: Path) -> str:
    return (folder / "report.html").read_text(encoding="utf-8")


def trace(run: Left) -> dict[str, object]:
    loaded: dict[str, object] = json.loads((run.folder / "guide.trace" / "trace.json").read_text())
    return loaded


@pytest.fixture(scope="module")
def guide_mill_run(tmp_path_factory: pytest.TempPathFactory) -> Left:
    """``jointlib run machines/library/guide_mill.toml -o out``."""
    (command,) = examples("run")
    folder = with_library(tmp_path_factory.mktemp("run") / "here")
    with contextlib.chdir(folder):
        return Left(command, jointlib(command), folder / "out")


def test_the_report_is_one_file_without_network(guide_mill_run: Left) -> None:
    text = page(guide_mill_run.folder)
    assert text.lstrip().lower().startswith("<!doctype html")
    assert text.rstrip().endswith("</html>")
    linked = re.findall(r"""\b(?:src|href|srcset|action|data)\s*=\s*["']\s*([^"']{0,40})""", text)
    assert linked
    assert all(link.startswith(("#", "data:")) for link in linked)
    assert not re.search(r"@import|url\(\s*['\"]?(?!#|data:)", text)
    assert not re.search(r"<(iframe|link|object|embed)\b|<script[^>]*\ssrc", text)


def test_the_report_holds_its_pictures_as_drawings(guide_mill_run: Left) -> None:
    text = page(guide_mill_run.folder)
    assert text.count("<svg") == text.count("</svg>") >= 6


def test_the_report_begins_with_what_was_found(guide_mill_run: Left) -> None:
    text, found = read(guide_mill_run.folder), trace(guide_mill_run)
    sentence = " ".join(str(found["sentence"]).split())
    assert sentence in text
    assert (
        text.index("Recommended: ") < text.index("every speed from 3000 to 12000 rpm is stable") < text.index(sentence)
    )
    assert text.index(sentence) < text.index("The joint as identified")


def test_the_report_names_its_inputs_with_their_hashes_and_how_to_repeat_it(guide_mill_run: Left) -> None:
    text = read(guide_mill_run.folder)
    records = LIBRARY / "guide_mill"
    inputs = [LIBRARY / "guide_mill.toml", *records.glob("*.measurement.toml"), *records.glob("*.npz")]
    for file in [*inputs, records / "static.csv"]:
        assert file.name in text
        assert hashlib.sha256(file.read_bytes()).hexdigest() in text.replace(" ", "")
    assert "jointlib run machines/library/guide_mill.toml -o out" in text


def test_simulated_records_are_called_simulated(guide_mill_run: Left) -> None:
    text = read(guide_mill_run.folder)
    for name in ("rig.measurement.toml", "static.measurement.toml"):
        assert f"{name}: the records are simulated" in text


def test_the_verdict_is_one_of_five_and_the_error_falls(guide_mill_run: Left) -> None:
    data = json.loads((guide_mill_run.folder / "run.json").read_text())
    found = trace(guide_mill_run)
    assert data["verdict"] == found["verdict"]
    assert data["verdict"] in VERDICTS
    assert 0 < data["error_after"] < data["error_before"] < 1
    assert [step["step"] for step in data["steps"]] == [
        "identify",
        "trace",
        "trace again",
        "df",
        "check",
        "frf",
        "lobes",
        "fmu",
        "machine fmu",
        "ssp",
    ]


def test_the_named_effect_has_parameters_with_standard_errors(guide_mill_run: Left) -> None:
    chosen = trace(guide_mill_run)["chosen"]
    assert isinstance(chosen, dict)
    assert chosen["params"]
    for value in chosen["params"].values():
        assert value["standard_error"] > 0
        low, high = value["ci95"]
        assert low < value["value"] < high
    assert chosen["family"] in read(guide_mill_run.folder)


def test_the_mended_joint_keeps_the_laws_and_adds_the_effect(guide_mill_run: Left) -> None:
    before = read_joint(guide_mill_run.folder / "guide.identified.joint.toml")
    after = read_joint(guide_mill_run.folder / "guide.joint.toml")
    assert after.parameters == read_joint(guide_mill_run.folder / "guide.trace" / "joint.toml").parameters
    kinds = [law.kind for law in after.laws]
    assert kinds[: len(before.laws)] == [law.kind for law in before.laws]
    chosen = trace(guide_mill_run)["chosen"]
    assert isinstance(chosen, dict)
    assert kinds[len(before.laws) :] == [chosen["member"]]
    for name, value in chosen["params"].items():
        assert after.parameters[name] == pytest.approx(value["value"], rel=1e-12)


def test_the_machine_is_computed_with_the_mended_joint(guide_mill_run: Left) -> None:
    machine = read_machine(LIBRARY / "guide_mill.toml")
    found = {}
    for name in ("guide.joint.toml", "guide.identified.joint.toml"):
        joint = read_joint(guide_mill_run.folder / name)
        result = response(machine.with_joint("guide", joint), harmonics="auto", stability="auto")
        found[name] = [(p.amplitude, p.frequency) for p in result.peaks if p.force == 12.0]
    written = json.loads((guide_mill_run.folder / "frf.json").read_text())["peaks"]
    ours = [(p["amplitude"], p["frequency"]) for p in written if p["force"] == 12.0]
    np.testing.assert_allclose(ours, found["guide.joint.toml"], rtol=1e-9)
    other = found["guide.identified.joint.toml"]
    assert len(other) != len(ours) or not np.allclose(ours, other, rtol=1e-4)


def test_the_gains_belong_to_the_two_joints(guide_mill_run: Left) -> None:
    data = json.loads((guide_mill_run.folder / "guide.df.json").read_text())
    A, omega = np.array(data["amplitude"])[:, None], 2 * np.pi * np.array(data["frequency"])
    for word, name in (("", "guide.joint.toml"), ("_as_identified", "guide.identified.joint.toml")):
        G = DescribingFunction(read_joint(guide_mill_run.folder / name))(A, omega)
        np.testing.assert_allclose(data[f"gain_real{word}"], G.real, rtol=1e-12)
        np.testing.assert_allclose(data[f"gain_imag{word}"], G.imag, rtol=1e-12, atol=1e-6)


def test_the_check_passed_and_both_receptances_are_there(guide_mill_run: Left) -> None:
    data = json.loads((guide_mill_run.folder / "check.json").read_text())
    assert data["passed"] is True
    assert data["excluded"] == []
    with np.load(guide_mill_run.folder / "check.npz") as arrays:
        ours, theirs = arrays["coupled"], arrays["control"]
        assert len(arrays["frequency"]) == len(ours)
    largest = np.max(np.linalg.norm(ours - theirs, axis=(1, 2)) / np.linalg.norm(theirs, axis=(1, 2)))
    assert largest < 1e-8


def test_every_force_of_the_file_has_its_curve(guide_mill_run: Left) -> None:
    with np.load(guide_mill_run.folder / "frf.npz") as arrays:
        np.testing.assert_array_equal(arrays["force"], [2.0, 5.0, 12.0])
        for i in range(3):
            assert arrays[f"receptance_{i}"].shape == (len(arrays[f"frequency_{i}"]), len(arrays["outputs"]))
        assert str(arrays["drive"]) == "cutter.tip"


def test_the_lobes_are_those_of_the_mended_machine(guide_mill_run: Left) -> None:
    data = json.loads((guide_mill_run.folder / "lobes.json").read_text())
    with np.load(guide_mill_run.folder / "lobes.npz") as arrays:
        assert arrays["depth"].shape == (len(data["amplitude"]), len(data["speed"]))
        np.testing.assert_allclose(np.array(data["depth"], dtype=float), arrays["depth"], rtol=1e-12)
    joint = read_joint(guide_mill_run.folder / "guide.joint.toml")
    machine = read_machine(LIBRARY / "guide_mill.toml").with_joint("guide", joint)
    some = [0, len(data["speed"]) // 2, -1]
    assert data["amplitude"][0] == 0
    chart = lobes_at_amplitude(machine, np.array(data["speed"])[some])
    np.testing.assert_allclose(np.array(data["depth"][0])[some], chart.depth, rtol=1e-9)


def test_the_exported_guide_verifies(guide_mill_run: Left) -> None:
    done = verify_fmu(guide_mill_run.folder / "guide.fmu")
    assert done.difference <= 1e-12
    steps = json.loads((guide_mill_run.folder / "run.json").read_text())["steps"]
    (step,) = (step for step in steps if step.get("file") == "guide.fmu")
    assert step["max_step"] == done.max_step


def test_what_is_printed_names_the_verdict_and_progress_goes_to_standard_error(guide_mill_run: Left) -> None:
    done = guide_mill_run.done
    assert done.out.startswith("Recommended: ")
    assert f"\n{trace(guide_mill_run)['verdict']}: " in done.out
    assert "…" not in done.out
    for step in ("identifying", "tracing", "checking", "forced response", "stability lobes", "exporting"):
        assert any(line.startswith(step) for line in done.err.splitlines())


def test_nothing_hidden_or_temporary_is_left(guide_mill_run: Left) -> None:
    assert not [path for path in guide_mill_run.folder.rglob("*") if path.name.startswith(".")]
    assert not [path for path in guide_mill_run.folder.rglob("*") if path.is_file() and not path.stat().st_size]


def test_the_example_of_run_works_and_names_what_it_wrote(guide_mill_run: Left) -> None:
    assert guide_mill_run.command == "run machines/library/guide_mill.toml -o out"
    done, folder = guide_mill_run.done, guide_mill_run.folder
    assert done.status == 0, done.err
    named = {folder.parent / path for path in wrote(done)}
    assert named == {path for path in folder.rglob("*") if path.is_file()}


def test_the_page_shows_all_sections(browser: str, guide_mill_run: Left, tmp_path: Path) -> None:
    dom = look(browser, tmp_path, guide_mill_run.folder / "report.html", "--dump-dom")
    headings = [html.unescape(re.sub(r"<[^>]+>", "", h)) for h in re.findall(r"<h2[^>]*>(.*?)</h2>", dom)]
    for wanted in (
        "The joint as identified",
        "The machine and its modes",
        "Closing the loop",
        "Describing function",
        "Check against python-control",
        "Forced response",
        "Stability lobes",
        "FMU",
        "What this stands on",
    ):
        assert any(wanted in heading for heading in headings), wanted
    assert dom.count("<svg") >= 6


def test_the_page_is_not_blank(browser: str, guide_mill_run: Left, tmp_path: Path) -> None:
    shot = tmp_path / "report.png"
    look(
        browser,
        tmp_path,
        guide_mill_run.folder / "report.html",
        f"--screenshot={shot}",
        "--window-size=1200,4000",
    )
    picture = np.asarray(matplotlib.image.imread(shot))[:, :, :3]
    assert picture.shape == (4000, 1200, 3)
    # Text and curves on a light ground: some of both in every quarter of the page.
    for quarter in np.array_split(picture, 4):
        assert np.var(quarter) > 1e-3
        assert 0.01 < np.mean(quarter < 0.9) < 0.9
