"""Test cuts and cuts on a dynamometer as people mistype them: what cannot be is refused, what looks wrong is told."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from jointlib import InputError, read_measurement
from jointlib.cuts.strange import strange
from jointlib.cuts.tried_cut import TriedCut
from jointlib.cutting_force.cut import Cut
from jointlib.measurement import RecordSource
from machines.answers.inspect import inspect

CAMPAIGN = """
schema = "jointlib/measurement/1"
kind = "cuts"
[cutting]
teeth = 4
mode = "down"
immersion = 0.5
feed = "0.05 mm"
[[cut]]
speed = 7500
depth = "3 mm"
verdict = "stable"
[[cut]]
speed = 7500
depth = "4 mm"
verdict = "chatter"
chatter_frequency = "928 Hz"
"""


def written(folder: Path, old: str, new: str) -> Path:
    assert old in CAMPAIGN
    (folder / "x.measurement.toml").write_text(CAMPAIGN.replace(old, new))
    return folder / "x.measurement.toml"


def cut(speed: float = 7500.0, depth: float = 3e-3, teeth: int = 4, **more: Any) -> TriedCut:
    verdict = "chatter" if "chatter_frequency" in more else "stable"
    return TriedCut("a cut", speed, depth, teeth, **({"verdict": verdict} | more))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("immersion = 0.5", "immersion = 6", "immersion is 6, expected a/D above 0 and at most 1; a width of cut is"),
        (
            "immersion = 0.5",
            'immersion = 6\ndiameter = "12 mm"',
            "immersion is 6, expected a/D above 0 and at most 1; a width of 6 mm is 0.5",
        ),
        ('depth = "3 mm"', "depth = 3", "depth is 3000 mm, expected at most 200 mm; a number without a unit is in m"),
        ("teeth = 4", 'teeth = 4\ndiameter = "0.25 mm"', "depth is 3 mm, expected at most 2.5 mm, 10 diameters"),
        (
            'feed = "0.05 mm"',
            'feed = "1500 mm"',
            "feed is 1500 mm a tooth, expected at most 5 mm; 1500 mm a minute are 0.05 mm a tooth at 7500 rpm",
        ),
        ('feed = "0.05 mm"', "feed = 0.05", "feed is 50 mm a tooth, expected at most 5 mm; a number without a unit is"),
    ],
)
def test_cuts_that_cannot_be_are_refused(old: str, new: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        read_measurement(written(tmp_path, old, new))
    assert any(said in sentence for sentence in caught.value.sentences), caught.value.sentences


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"depth": 1.0}, "depth is 1000 mm, expected at most 120 mm, 10 diameters"),
        (
            {"feed": 0.27},
            "feed is 270 mm a tooth, expected at most 5 mm; 270 mm a minute are 0.03 mm a tooth at 3000 rpm",
        ),
        ({"immersion": 50.0}, "a percentage by 100"),
        ({"diameter": -1.0}, "diameter is -1 m, expected more than 0"),
    ],
)
def test_cuts_on_a_dynamometer_are_held_to_the_same(given: dict[str, Any], said: str) -> None:
    usual = {
        "speed": 3000.0,
        "depth": 1e-3,
        "feed": 1e-4,
        "teeth": 3,
        "mode": "up",
        "immersion": 0.5,
        "diameter": 0.012,
    }
    assert Cut("milling", **usual).feed == 1e-4
    with pytest.raises(InputError) as caught:
        Cut("milling", **(usual | given))
    assert said in str(caught.value)


def test_a_turned_cut_has_a_feed_a_revolution() -> None:
    assert Cut("turning", 60.0, 2e-3, 15e-3, diameter=1e-3).feed == 15e-3
    with pytest.raises(InputError, match="feed is 25 mm a revolution, expected at most 20 mm"):
        Cut("turning", 60.0, 2e-3, 25e-3)


@pytest.mark.parametrize(("helix", "meant"), [(0.5236, 30), (0.6109, 35), (0.785, 45)])
def test_a_helix_in_rad_is_named(helix: float, meant: int) -> None:
    one = Cut("milling", 3000.0, 1e-3, 1e-4, 3, diameter=12e-3, helix=helix)
    assert one.strange() == [f'helix is {helix:g} degrees; is it in rad? Then write {meant}, or "{helix:g} rad"']


@pytest.mark.parametrize("helix", [0.0, 0.5, 1.0, 2.0, 5.0, 30.0])
def test_a_helix_in_degrees_is_not(helix: float) -> None:
    assert not Cut("milling", 3000.0, 1e-3, 1e-4, 3, diameter=12e-3, helix=helix).strange()


@pytest.mark.parametrize(
    ("cuts", "said"),
    [
        ([cut(125.0, chatter_frequency=928.0)], "928 Hz is 111 waves between two teeth: was the speed meant in Hz?"),
        ([cut(125.0, chatter_frequency=928.0, diameter=5e-3)], "leaves waves of 35 um, expected more"),
        ([cut(12.0)], 'speeds up to 12 rpm are those of no mill: was the speed meant in Hz? Then write "12 Hz"'),
        ([cut(teeth=40, diameter=12e-3)], "40 teeth on a cutter of 12 mm stand 0.94 mm apart"),
        ([cut(chatter_frequency=30072.0)], "chatter at 30072 Hz is above what is heard or what a machine does, 20000"),
        ([cut(), cut(7510.0, chatter_frequency=928.0)], "once stable and once with chatter"),
        ([cut(chatter_frequency=0.715)], 'at 0.715 Hz: was it meant in kHz? Then write "0.715 kHz"'),
        ([cut(6000.0), cut(9000.0), cut(90000.0)], "90000 rpm, all others 6000 to 9000 rpm: has it a digit too many"),
        ([cut(600.0), cut(6000.0), cut(9000.0)], "600 rpm, all others 6000 to 9000 rpm: has it a digit too many"),
    ],
)
def test_cuts_that_look_wrong_are_told(cuts: list[TriedCut], said: str) -> None:
    (told,) = strange(cuts)
    assert said in told
    assert len(told) <= 300


def test_chatter_that_a_record_cannot_hold_is_told() -> None:
    record = RecordSource(Path("a.wav"), "fit")
    (told,) = strange([cut(chatter_frequency=4928.0, record=record)], rate=8000.0)
    assert told == "a cut: chatter at 4928 Hz is above half of the sample_rate of its record, 4000 Hz"


@pytest.mark.parametrize(
    "cuts",
    [
        [cut(60.0, teeth=20, chatter_frequency=150.0)],  # a face mill of 315 mm
        [cut(100.0, teeth=8, chatter_frequency=310.0, diameter=0.2)],
        [cut(40.0, teeth=1, chatter_frequency=150.3)],  # a fly cutter
        [cut(125.0, chatter_frequency=928.0, diameter=0.063)],  # high-speed steel
        [cut(60.0, teeth=1, process="turning", chatter_frequency=420.3)],
        [cut(20.0, teeth=30)],
        [cut(100.0, teeth=128, diameter=0.063)],  # a saw
        [cut(30000.0, teeth=2, depth=2e-5, chatter_frequency=9150.0, diameter=1e-3)],
        [cut(), cut(depth=3.2e-3, chatter_frequency=928.0)],
        [cut(), cut(chatter_frequency=928.0, immersion=0.1)],
    ],
)
def test_large_slow_and_small_fast_cutters_are_not(cuts: list[TriedCut]) -> None:
    assert not strange(cuts)


def test_inspect_tells_what_looks_wrong(tmp_path: Path) -> None:
    found = inspect(written(tmp_path, 'depth = "4 mm"', 'depth = "3 mm"'))
    (said,) = found.warnings
    assert "once stable and once with chatter" in said
    assert f"looks wrong: {said}" in found.lines
    assert not inspect(written(tmp_path, 'depth = "4 mm"', 'depth = "5 mm"')).warnings
