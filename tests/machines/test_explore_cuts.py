"""Test cuts of a machine file as marks on the lobes of its page."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import machines
from jointlib.errors import InputError
from machines.explore import Explorer
from machines.explore.figures import lobes_figure

CUTS = Path(machines.__file__).parent / "library" / "end_mill_cuts"
OWN = """schema = "jointlib/measurement/1"
kind = "cuts"
[cutting]
teeth = 2
[[cut]]
speed = "6000 rpm"
depth = "30 mm"
verdict = "chatter"
chatter_frequency = "655 Hz"
[[cut]]
speed = "7000 rpm"
depth = "2 mm"
immersion = 0.1
verdict = "stable"
[[cut]]
speed = "8000 rpm"
depth = "2 mm"
verdict = "unknown"
"""


def written(folder: Path, files: str) -> Path:
    text = (CUTS / "mill.toml").read_text() + "[response]\nfrequency = [300, 1500]\n"
    path = folder / "mill.toml"
    path.write_text(text + "".join(f'[[cuts]]\nmeasurement = "{name}"\n' for name in files.split()))
    return path


def marks(explorer: Explorer) -> dict[tuple[str, str], list[str]]:
    """Names of the cuts by what they are called and the axis that they stand on."""
    traces = lobes_figure(explorer.curves({}), None, None, None, explorer.tried)["data"]
    return {(t["name"], t["yaxis"]): t["text"] for t in traces if "text" in t}


def test_every_judged_cut_is_marked_by_its_verdict_and_what_was_heard(tmp_path: Path) -> None:
    (tmp_path / "own.measurement.toml").write_text(OWN)
    explorer = Explorer(written(tmp_path, "own.measurement.toml"))
    assert [(one.cut.verdict, one.alike) for one in explorer.tried] == [("chatter", True), ("stable", False)]
    found = marks(explorer)
    assert {key: len(names) for key, names in found.items()} == {
        ("cut: chatter", "y"): 1,
        ("cut: chatter", "y2"): 1,
        ("cut: stable, made otherwise", "y"): 1,
    }
    axis = lobes_figure(explorer.curves({}), None, None, None, explorer.tried)["layout"]["yaxis"]
    assert axis["range"][1] > 30.0


def test_marks_of_the_library_stand_where_the_file_has_them(tmp_path: Path) -> None:
    explorer = Explorer(written(tmp_path, str(CUTS / "cuts.measurement.toml")))
    assert len(explorer.tried) == 20
    assert {one.cut.verdict for one in explorer.tried} == {"stable", "chatter"}
    curves = explorer.curves({})
    wrong = sum(
        (one.cut.verdict == "chatter") != (one.cut.depth > np.interp(one.cut.speed, curves.speed, curves.depth))
        for one in explorer.tried
    )
    assert wrong > 4  # forces of the file are too small, and the marks show it
    assert not Explorer(written(tmp_path, "")).tried


def test_a_file_of_cuts_that_is_none_is_refused_at_once(tmp_path: Path) -> None:
    (tmp_path / "own.measurement.toml").write_text(OWN.replace('"2 mm"', '"0 mm"', 1))
    with pytest.raises(InputError, match="depth is 0 m"):
        Explorer(written(tmp_path, "own.measurement.toml"))
