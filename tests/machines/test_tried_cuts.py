"""Test cuts as measurements: what a file may say of them, and what a record of a cut tells."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tried_cuts import Shop, sounds, written

from jointlib import InputError, read_measurement
from jointlib.cuts.heard import heard, told_by
from jointlib.cuts.judged import judged_cuts
from jointlib.cuts.sound import listen
from machines import inspect
from machines.lobes import Cutting, StabilityLobes, ToolModel, stability_lobes

SHOP, RATE = Shop(), 8192.0
SPEEDS = np.array([6000.0, 7000.0, 11000.0, 14000.0])
"""At the last one the border is a flip."""
FILE = """
schema = "jointlib/measurement/1"
kind = "cuts"
[cutting]
teeth = 4
mode = "slot"
feed = "0.05 mm"
[[cut]]
speed = 3000
depth = "1 mm"
verdict = "stable"
[[cut]]
speed = 3000
depth = "2 mm"
verdict = "chatter"
chatter_frequency = "812 Hz"
"""


def chart() -> StabilityLobes:
    cut = Cutting("milling", teeth=2, tangential=SHOP.tangential, normal=SHOP.normal, mode="down", immersion=0.5)
    tool = ToolModel.from_modes([600, 680], [0.03, 0.03], [0.8, 0.7], [[1, 0], [0, 1]])
    return stability_lobes(tool, cut, SPEEDS)


@pytest.mark.slow
def test_a_record_tells_on_which_side_of_the_border_its_cut_was() -> None:
    found = chart()
    depth = found.depth
    for factor, verdict in ((0.6, "stable"), (1.7, "chatter")):
        for k, x in enumerate(sounds(SHOP, SPEEDS, factor * depth)):
            told = heard(x, RATE, 1.003 * SPEEDS[k], 2, "record")
            assert told.verdict == verdict
            assert told.speed == pytest.approx(SPEEDS[k], rel=1e-3)
            assert (told.share < 0.05) == (verdict == "stable" or told.kind == "flip")
    shallow = sounds(SHOP, SPEEDS[:2], 1.2 * depth[:2])  # at 11 000 rpm two modes compete
    at_border = [heard(x, RATE, s, 2, "record") for x, s in zip(shallow, SPEEDS, strict=False)]
    for told, frequency, speed in zip(at_border, found.chatter_frequency, SPEEDS, strict=False):
        tooth = 2 * speed / 60
        lines = np.abs(frequency + tooth * np.arange(-9, 9))
        assert told.chatter_frequency is not None
        assert np.min(np.abs(lines - told.chatter_frequency)) < 0.01 * frequency
    assert heard(sounds(SHOP, SPEEDS[3:], 1.7 * depth[3:])[0], RATE, SPEEDS[3], 2, "record").kind == "flip"


def test_run_out_is_no_chatter() -> None:
    t = np.arange(0, 1, 1 / RATE)
    turning, rng = 2 * np.pi * 51.3, np.random.default_rng(1)
    x = np.sin(2 * turning * t) + 0.8 * np.sin(turning * t) + 0.3 * np.sin(5 * turning * t)
    sound = listen(x + 0.02 * rng.standard_normal(len(t)), RATE, 3070.0, 2, "record")
    assert told_by(sound).verdict == told_by(sound, run_out=0.4).verdict == "stable"
    assert told_by(sound, run_out=0.0).verdict == "chatter"  # of a tool that runs true


def test_noise_that_hides_the_cut_is_told_as_unknown() -> None:
    noise = np.random.default_rng(2).standard_normal(8192)
    assert heard(noise, RATE, 3000.0, 2, "record").verdict == "unknown"


def test_a_file_of_cuts_is_told(tmp_path: Path) -> None:
    depth = np.array([4e-3, 12e-3])
    file = written(tmp_path, SHOP, np.array([7000.0, 7000.0]), depth)
    first, second = judged_cuts(read_measurement(file))
    assert (first.cut.verdict, second.cut.verdict) == ("stable", "chatter")
    assert second.cut.kind == "hopf"
    text = file.read_text().replace('name = "cut 1"\n', 'name = "cut 1"\nverdict = "stable"\n')
    file.write_text(text)
    lines = inspect(file).lines
    assert lines[0] == "simulated cuts measurement, 8192 Hz, 2 cuts"
    assert any("cut 1: stable by the file, chatter by its record" in line for line in lines)


def test_cuts_without_records_are_told(tmp_path: Path) -> None:
    (tmp_path / "cuts.toml").write_text(FILE)
    found = read_measurement(tmp_path / "cuts.toml")
    assert [cut.verdict for cut in found.cuts] == ["stable", "chatter"]
    assert (found.cuts[1].kind, found.cuts[1].feed) == ("hopf", 5e-5)
    assert "2 (1 stable, 1 chatter by the file)" in found.finding()
    assert found.plot().get_xlabel() == "spindle speed [rpm]"
    assert list(found.columns()["verdict"][0]) == ["stable", "chatter"]
    assert "cut at 3000 rpm, 2 mm" in "\n".join(inspect(tmp_path / "cuts.toml").lines)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda t: t.replace('"1 mm"', "0"), "a stable verdict at zero depth tells nothing"),
        (lambda t: t.replace("812 Hz", "800 Hz"), "is 800 Hz, harmonic 4 of the teeth (200 Hz at 3000 rpm)"),
        (lambda t: t.replace('"stable"', '"stable"\nchatter_frequency = 700'), "700 Hz in a cut that is stable"),
        (lambda t: t.replace('verdict = "stable"\n', ""), "verdict is missing"),
        (lambda t: t.replace('"chatter"\n', '"it sang"\n'), "verdict is 'it sang'"),
        (lambda t: t.replace("teeth = 4\n", ""), "teeth is missing"),
        (lambda t: t.replace("speed = 3000\n", "", 1), "speed is missing"),
        (lambda t: t.partition("[[cut]]")[0], "no [[cut]], expected at least one"),
        (lambda t: t + 'file = "x.npz"\n', "sample_rate is missing"),
        (lambda t: t.replace('"slot"', '"sideways"'), "mode is 'sideways'"),
    ],
)
def test_what_no_cut_can_be_is_told_in_a_sentence(change: Callable[[str], str], said: str, tmp_path: Path) -> None:
    (tmp_path / "cuts.toml").write_text(change(FILE))
    with pytest.raises(InputError) as caught:
        read_measurement(tmp_path / "cuts.toml")
    assert any(said in sentence for sentence in caught.value.sentences), caught.value.sentences


def test_a_record_of_a_few_revolutions_tells_nothing() -> None:
    with pytest.raises(InputError, match="expected at least 12"):
        heard(np.ones(1000), RATE, 3000.0, 2, "record")
