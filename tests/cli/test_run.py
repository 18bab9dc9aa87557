"""``jointlib run``: one folder with a report and, beside it, every number the report shows."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command_line import jointlib, read


@pytest.mark.thorough
def test_a_machine_whose_joints_are_given_runs_without_identification(here: Path) -> None:
    done = jointlib("run machines/library/paper_sdof.toml -o out")
    assert done.status == 0, done.err
    text = read(Path("out"))
    assert "Every joint was given; nothing was identified." in text
    assert "jointlib run machines/library/paper_sdof.toml -o out" in text
    peaks = json.loads(Path("out/frf.json").read_text())["peaks"]
    # Free resonances of eq. 33 at 1, 3 and 5 um (Dhupia et al. 2008, fig. 14), which these forces about reach.
    np.testing.assert_allclose([p["frequency"] for p in peaks], [525.003, 520.866, 512.491], rtol=2e-3)
    np.testing.assert_allclose([p["amplitude"] for p in peaks], [1e-6, 3e-6, 5e-6], rtol=0.05)
    assert not {"identify", "trace"} & {step["step"] for step in json.loads(Path("out/run.json").read_text())["steps"]}
    assert not [path for path in Path("out").rglob("*") if "trace" in path.name or "identified" in path.name]


@pytest.mark.slow
def test_a_second_run_gives_the_same_bytes(here: Path) -> None:
    for name in ("one", "two"):
        assert jointlib(f"run machines/library/two_mass.toml -o {name}/out").status == 0
    for path in Path("one/out").iterdir():
        again = Path("two/out") / path.name
        assert path.read_text("latin-1") == again.read_text("latin-1").replace("two/out", "one/out"), path.name


@pytest.mark.slow
def test_a_run_under_a_static_load_tells_where_the_joints_stand(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("press.toml").write_text(
        """
        schema = "jointlib/machine/1"
        name = "press"
        [[component]]
        name = "slide"
        kind = "lumped"
        dofs = ["z"]
        mass = [[60.0]]
        [[connection]]
        name = "rest"
        between = ["slide.z", "ground"]
        joint = { law = [ { kind = "hertz-contact", preload = "2000 N", kappa = 3.931408125e-8 },
                          { kind = "viscous", damping = 40000 } ] }
        [static]
        gravity = true
        [response]
        drive = "slide.z"
        force = ["400 N"]
        frequency = ["300 Hz", "600 Hz"]
        """,
        encoding="utf-8",
    )
    assert jointlib("run press.toml -o out").status == 0
    (step,) = [s for s in json.loads(Path("out/run.json").read_text())["steps"] if s["step"] == "static"]
    weight = 60 * 9.80665
    assert step["force"] == [pytest.approx(-weight, rel=1e-9)]
    stands = 3.931408125e-8 * ((2000 - weight) ** (2 / 3) - 2000 ** (2 / 3))
    assert step["displacement"] == [pytest.approx(stands, rel=1e-9)]
    text = read(Path("out"))
    assert "Static working point" in text
    assert "means in static balance" in text
    with np.load("out/frf.npz") as curves:
        mean = curves["branch_0_0_mean"]
    # Shaken, a contact carries the same load at a smaller approach.
    assert np.all(mean < stands)
    assert np.ptp(mean) > 1e-8
