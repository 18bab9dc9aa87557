"""What a long computation tells of where it is."""

from __future__ import annotations

import json
import time

import click
import pytest
from click.testing import CliRunner

from jointlib.cli import output
from jointlib.cli.arguments import json_option
from jointlib.shown.progress import Follower, Inside, each, followed, remark


def test_loops_inside_each_other_are_told_with_the_outermost_first() -> None:
    said, follower = list[str](), Follower(lambda text: None)
    with followed(follower):
        for _ in each("amplitudes", [1, 2], 2):
            for _ in each("speeds", [1, 2, 3], 3):
                said.append(", ".join(part for part in follower.loops if "about" not in part))
    assert said[:3] == [f"0 of 2 amplitudes, {n} of 3 speeds" for n in range(3)]
    assert follower.loops == []


def test_nobody_has_to_follow() -> None:
    assert list(each("speeds", iter("abc"), 3)) == ["a", "b", "c"]
    remark("heard by nobody")


def test_a_loop_that_is_left_early_leaves_nothing_behind() -> None:
    follower = Follower(lambda text: None)
    with followed(follower):
        for n in each("speeds", range(9), 9):
            if n == 3:
                break
        assert follower.loops == []


@pytest.mark.parametrize(("count", "warned"), [(60, False), (61_000, True)])
def test_a_loop_that_takes_more_than_a_minute_says_so_after_its_first(count: int, warned: bool) -> None:
    said = list[str]()
    with followed(Follower(said.append)):
        for n in each("traces", range(count), count, "fewer effects ask for less"):
            if n == 3:
                break
            time.sleep(0.001)
    assert len(said) == warned
    assert all(text.startswith(f"{count} traces take about ") for text in said)
    assert all(text.endswith(" s; fewer effects ask for less") for text in said)


@pytest.mark.parametrize("progress", [output.Working(), output.Steps()])
def test_a_part_that_takes_long_tells_again_and_again_how_far_it_is(
    progress: output.Working | output.Steps, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(output, "_SHOW_AFTER", 0.02)
    monkeypatch.setattr(output, "_AGAIN", 0.02)
    monkeypatch.setattr(output, "_AGAIN_IN_LONG", 0.02)
    with progress.step("computing"):
        remark("takes long")
        for _ in each("speeds", range(4), 4):
            time.sleep(0.05)
    out, err = capsys.readouterr()
    assert not out
    assert err.startswith("computing …\n  takes long\n")
    assert "  3 of 4 speeds, about 0 s more (0 s)\n" in err


def test_a_short_part_tells_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    with output.Working().step("computing"):
        pass
    assert capsys.readouterr().err == ""


def test_a_step_that_ends_early_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(ValueError, match="time is up"), output.Steps().step("computing"):
        raise ValueError("time is up")
    assert capsys.readouterr().err == "computing …\n  ended after 0 s: time is up\n"


@pytest.mark.parametrize("progress", [output.Working(), output.Steps()])
def test_a_command_that_is_asked_for_json_tells_nothing_else(
    progress: output.Working | output.Steps, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(output, "_SHOW_AFTER", 0.01)

    @click.command()
    @json_option
    def command(as_json: bool) -> None:
        with progress.step("computing"):
            time.sleep(0.05)
        output.emit(as_json, {"done": 1}, ["done"])

    quiet, told = (CliRunner().invoke(command, words) for words in (["--json"], []))
    assert json.loads(quiet.output) == {"done": 1}
    assert told.stderr.startswith("computing …\n")


def test_parts_of_a_part_are_told_as_how_far_it_is() -> None:
    follower = Follower(lambda _: None)
    with followed(follower):
        with Inside().step("x, 1 of 2"), Inside().step("closing in on the peaks"):
            assert str(follower) == "x, 1 of 2, closing in on the peaks"
        assert not follower.loops
    with Inside().step("nobody listens"):
        pass
