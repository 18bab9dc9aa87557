"""``jointlib modes``: the promised keys, the sentence, and what it says of files that have no modes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from command_line import jointlib

from machines import natural_modes, read_machine

LIBRARY = Path("machines/library")


@pytest.mark.thorough
def test_its_keys_hold_the_modes_and_shares_that_sum_to_one(here: Path) -> None:
    data = jointlib(f"modes {LIBRARY / 'lathe.toml'} --json").json
    modes = natural_modes(read_machine(LIBRARY / "lathe.toml"))
    assert data["modes"][0]["frequency"] == modes.frequency[0]
    assert data["modes"][0]["damping_ratio"] == modes.damping_ratio[0]
    assert data["count"] == len(modes.pole) > len(data["modes"])
    assert set(data["static_compliance"]) == {"x"}
    for mode in data["modes"]:
        assert [j["connection"] for j in mode["joints"]] == [c.name for c in modes.machine.flexible]
        for key in ("share", "loss"):
            parts = [one[key] for one in (*mode["joints"], *mode["components"])]
            assert np.sum(parts) == pytest.approx(1.0, abs=1e-9)
        assert np.sum([b["share"] for b in mode["bundles"]]) == pytest.approx(
            np.sum([j["share"] for j in mode["joints"]])
        )
    assert data["sentence"].startswith("the mode at ")
    assert data["depth"]["depth"] > 0


@pytest.mark.thorough
def test_it_leads_with_the_sentence_and_shows_all_on_request(here: Path) -> None:
    done = jointlib(f"modes {LIBRARY / 'two_mode_tool.toml'}")
    lines = done.out.splitlines()
    assert (done.status, lines[0]) == (
        0,
        "the mode at 603 Hz that limits the depth bends cutter itself (100 % of its energy), "
        "and no joint holds as much as 1 % of it.",
    )
    few, every = (jointlib(f"modes {LIBRARY / 'lathe.toml'} {more}").out for more in ("", "--all"))
    assert len(every.splitlines()) > len(few.splitlines()) + 50
    assert "further modes" in few
    assert "further modes" not in every


def test_at_an_amplitude_the_joints_give_way(here: Path) -> None:
    frequency = [
        jointlib(f"modes {LIBRARY / 'paper_sdof.toml'} {A} --json").json["modes"][0]["frequency"]
        for A in ("", "--amplitude 3um")
    ]
    assert frequency[1] < 0.995 * frequency[0]


@pytest.mark.parametrize(
    ("file", "said"),
    [
        (
            "machines/library/guide_mill/rig.measurement.toml",
            "kind is 'rig', expected a machine file or a measurement of kind 'frf'",
        ),
        ("machines/library/guide.joint.toml", "schema is 'jointlib/joint/1'"),
        ("nowhere.toml", "nowhere.toml"),
    ],
)
def test_what_is_no_machine_is_refused_in_a_sentence(here: Path, file: str, said: str) -> None:
    done = jointlib(f"modes {file}")
    assert done.status == 2
    assert said in done.err
    assert done.err.count("\n") == 1


def test_modes_without_damping_are_told_with_the_reason_why_no_depth_is(here: Path) -> None:
    text = (LIBRARY / "two_mode_tool.toml").read_text()
    Path("undamped.toml").write_text(text.replace("damping_ratio = [0.039, 0.035]", "damping_ratio = [0, 0]"))
    done = jointlib("modes undamped.toml --json")
    assert done.status == 0
    np.testing.assert_allclose([mode["frequency"] for mode in done.json["modes"]], [603, 666], rtol=1e-9)
    assert "no depth of cut can be told" in " ".join(done.json["warnings"])
    assert done.json.get("depth") is None
