"""Values with units, several values in a row or joined by commas, ranges of frequency."""

from __future__ import annotations

from pathlib import Path

import click
import numpy as np
import pytest
from click.testing import CliRunner
from command_line import jointlib

from jointlib.cli.arguments import FrequencyRange, Quantity, Target, Verb
from jointlib.errors import InputError


@click.command(cls=Verb)
@click.argument("files", nargs=-1)
@click.option("--force", type=Quantity("N"), multiple=True)
@click.option("--amplitude", type=Quantity("m", lower=0), multiple=True)
@click.option("--law", multiple=True)
@click.option("--mode", type=click.Choice(["up", "down"]), multiple=True)
@click.option("--frequency", type=FrequencyRange())
def probe(**given: object) -> None:
    """Print what arrived."""
    for name, value in given.items():
        click.echo(f"{name} {value}")


def arrived(*words: str) -> dict[str, object]:
    done = CliRunner().invoke(probe, words, catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return {line.split(" ", 1)[0]: line.split(" ", 1)[1] for line in done.output.splitlines()}


@pytest.mark.parametrize(
    ("word", "unit", "value"),
    [
        ("1e-6", "m", 1e-6),
        ("1um", "m", 1e-6),
        (" 1 µm ", "m", 1e-6),
        ("50", "N", 50.0),
        ("50N", "N", 50.0),
        ("0.05kN", "N", 50.0),
        ("-3um", "m", -3e-6),
        ("2kHz", "Hz", 2000.0),
        ("922", "Hz", 922.0),
        ("4000rpm", "rpm", 4000.0),
        ("50Hz", "rpm", 3000.0),
    ],
)
def test_a_value_is_si_or_carries_its_unit(word: str, unit: str, value: float) -> None:
    assert Quantity(unit).convert(word, None, None) == value


@pytest.mark.parametrize(
    "words", [("1um", "3um", "5um"), ("1um,3um,5um",), ("1um,3um", "5um"), ("1e-6", "3e-6,0.005mm")]
)
def test_values_in_a_row_and_comma_lists_are_one_list(words: tuple[str, ...]) -> None:
    assert arrived("--amplitude", *words)["amplitude"] == "(1e-06, 3e-06, 5e-06)"


def test_an_option_given_twice_with_an_equals_sign_or_repeated_grows_the_list() -> None:
    assert arrived("--force=1N", "2N", "--amplitude", "1um", "--force", "3")["force"] == "(1.0, 2.0, 3.0)"


def test_a_list_ends_at_the_next_option_and_at_a_file_name() -> None:
    got = arrived("--force", "1", "2N", "a.toml", "--amplitude", "1um")
    assert (got["force"], got["files"], got["amplitude"]) == ("(1.0, 2.0)", "('a.toml',)", "(1e-06,)")


def test_a_file_whose_name_begins_with_a_digit_is_no_further_value(here: Path) -> None:
    Path("5um.toml").touch()
    assert arrived("--force", "1", "5um.toml")["files"] == "('5um.toml',)"


def test_laws_in_a_row_are_one_list_and_the_measurement_after_them_is_none() -> None:
    got = arrived("--law", "hertz-guide", "viscous", "m.toml")
    assert (got["law"], got["files"]) == ("('hertz-guide', 'viscous')", "('m.toml',)")
    assert arrived("--mode", "up", "down", "sideways")["files"] == "('sideways',)"


def test_a_negative_number_may_follow_as_a_further_value() -> None:
    assert arrived("--force", "1", "-2")["force"] == "(1.0, -2.0)"


def test_a_lower_limit_is_kept_and_zero_is_allowed() -> None:
    assert arrived("--amplitude", "0")["amplitude"] == "(0.0,)"
    with pytest.raises(InputError, match=r"--amplitude: -1um, expected at least 0 m"):
        arrived("--amplitude", "-1um")


@pytest.mark.parametrize(
    ("word", "value"),
    [
        ("100:200", "(100.0, 200.0, None)"),
        ("1kHz:7kHz:25", "(1000.0, 7000.0, 25)"),
        ("0.5:2.5e2:2", "(0.5, 250.0, 2)"),
    ],
)
def test_a_frequency_range_is_low_high_and_a_number_of_lines(word: str, value: str) -> None:
    assert arrived("--frequency", word)["frequency"] == value


@pytest.mark.parametrize("word", ["5", "5:1", "5:1:10", "0:5", "-1:5", "1:5:1", "1:5:2.5", "1:5:3:4", "a:b", ":", "1:"])
def test_a_frequency_range_that_runs_nowhere_is_refused(word: str) -> None:
    with pytest.raises(InputError, match="frequency"):
        arrived("--frequency", word)


def test_lines_span_the_range_or_the_default_of_the_file(here: Path) -> None:
    machine = Path("machines/library/two_mass.toml")
    for words, lines in (
        ("--frequency 2kHz:4kHz:9", np.linspace(2000.0, 4000.0, 9)),
        ("--frequency 2kHz:4kHz", np.linspace(2000.0, 4000.0, 600)),
        ("", np.linspace(1000.0, 7000.0, 600)),
    ):
        assert jointlib(f"frf {machine} --force 10 {words} -o lines.npz").status == 0
        found = np.load("lines.npz")["frequency_0"]
        assert (found[0], found[-1]) == (lines[0], lines[-1])
        # Lines are added round the peaks, none is left out.
        assert np.isin(lines, found).all()
    text = machine.read_text().split("[response]")[0]
    Path("bare.toml").write_text(text.replace("two_mass.joint", "machines/library/two_mass.joint"))
    done = jointlib("frf bare.toml --force 10 -o lines.npz")
    assert done.status == 0
    assert "No frequency in [response]: the tool feels modes at" in done.out
    found = np.load("lines.npz")["frequency_0"]
    assert found[0] < 1251.6 / 2
    assert found[-1] > 2 * 5085


def test_a_target_is_looked_at_before_any_work(here: Path) -> None:
    Path("file").touch()
    assert Target(".npz").convert("new/deep/x.npz", None, None) == Path("new/deep/x.npz")
    assert Target(folder=True).convert("new/deep", None, None) == Path("new/deep")
    assert not Path("new").exists()
    for target, word in ((Target(), "machines"), (Target(".npz"), "x.csv"), (Target(folder=True), "file/x")):
        with pytest.raises(InputError):
            target.convert(word, None, None)


def test_df_takes_the_same_values_in_every_spelling(here: Path) -> None:
    spellings = (
        "--amplitude 1um 3um --frequency 500 1kHz",
        "--amplitude 1e-6,3e-6 --frequency 0.5kHz,1000",
        "--frequency=500 --frequency=1000Hz --amplitude 0.001mm --amplitude '3 um'",
    )
    found = [jointlib(f"df machines/library/guide.joint.toml --json {given}").json for given in spellings]
    assert found[0] == found[1] == found[2]
    assert np.shape(found[0]["gain_real"]) == (2, 2)
