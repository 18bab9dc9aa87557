"""A receptance from a table: that of the machine itself, wherever it is asked, and no coupling once it pays."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import FrequencyMismatch
from machines.files.machine_file import read_machine
from machines.tool.at_rest import tip_at_rest, tool_at_rest
from machines.tool.tabulated import Tabulated
from machines.tool.tool_point import ToolPoint

LIBRARY = Path(__file__).parents[2] / "machines" / "library"
KNOTS = np.linspace(100.0, 2000.0, 39)


class Counted:
    """One mode at 700 Hz, 1e-3 of critical damping, that counts the lines asked of it; it jumps at 1234.5 Hz."""

    def __init__(self, jump: float = 0.0) -> None:
        self.asked, self.jump = 0, jump

    def __call__(self, frequency: Array) -> ComplexArray:
        self.asked += len(frequency)
        r = frequency / 700.0
        G = 1e-7 / (1 - r**2 + 2e-3j * r) + self.jump * (frequency > 1234.5)
        return np.asarray(G[:, None, None], dtype=complex)


def asked_enough(table: Tabulated) -> Tabulated:
    for _ in range(20):
        table(np.linspace(101.0, 1999.0, 50))
    return table


@pytest.mark.thorough
def test_a_measured_spindle_end_with_a_cutter_is_the_same_from_its_table() -> None:
    machine = read_machine(LIBRARY / "end_mill.toml")
    tip = tool_at_rest(machine)
    assert isinstance(tip, ToolPoint)
    itself = tip_at_rest(machine, tip.lines)
    low, high = tip.lines[[0, -1]]
    for _ in range(20):
        tip(np.linspace(low, high, 300))
    lines = np.random.default_rng(7).uniform(low, high, 2000)
    G, expected = tip(lines), itself(lines)
    error = np.linalg.norm(G - expected, axis=(1, 2)) / np.linalg.norm(expected, axis=(1, 2))
    assert 0 < np.max(error) < 1e-8
    with pytest.raises(FrequencyMismatch, match="nothing is extrapolated"):
        tip(np.array([high + 100.0]))


def test_what_was_asked_of_a_tool_before_changes_no_digit_of_the_next_one() -> None:
    machine = read_machine(LIBRARY / "end_mill.toml")
    tip = tool_at_rest(machine)
    assert isinstance(tip, ToolPoint)
    low, high = tip.lines[[0, -1]]
    lines, first = np.linspace(low, high, 300), tip(np.linspace(low, high, 300))
    for _ in range(20):
        tip(lines)
    assert not np.array_equal(tip(lines), first)
    again = tool_at_rest(machine)
    assert isinstance(again, ToolPoint)
    assert np.array_equal(again(lines), first)


def test_no_line_is_asked_of_the_receptance_once_the_table_stands() -> None:
    mode = Counted()
    table = asked_enough(Tabulated(mode, KNOTS))
    before = mode.asked
    lines = np.sort(np.append(np.random.default_rng(3).uniform(100.0, 2000.0, 500), KNOTS))
    G = table(lines)
    assert mode.asked == before
    np.testing.assert_allclose(G, Counted()(lines), rtol=1e-8)


def test_where_the_receptance_jumps_it_answers_itself() -> None:
    table = asked_enough(Tabulated(Counted(jump=1e-7), KNOTS))
    lines = np.sort(np.append(1234.5 + np.geomspace(1e-6, 20.0, 40), 1234.5 - np.geomspace(1e-6, 20.0, 40)))
    np.testing.assert_allclose(table(lines), Counted(jump=1e-7)(lines), rtol=1e-8)


def test_beyond_the_knots_it_answers_itself() -> None:
    table = asked_enough(Tabulated(Counted(), KNOTS))
    lines = np.array([1.0, 99.0, 150.0, 2001.0, 9000.0])
    np.testing.assert_allclose(table(lines), Counted()(lines), rtol=1e-8)


def test_what_is_known_on_its_lines_alone_stays_without_a_table() -> None:
    def known(frequency: Array) -> ComplexArray:
        if not np.all(np.isin(frequency, KNOTS)):
            raise FrequencyMismatch("no measured line")
        return Counted()(frequency)

    table = Tabulated(known, KNOTS)
    for _ in range(30):
        np.testing.assert_array_equal(table(KNOTS), Counted()(KNOTS))
    with pytest.raises(FrequencyMismatch, match="no measured line"):
        table(KNOTS[:1] + 1.0)
