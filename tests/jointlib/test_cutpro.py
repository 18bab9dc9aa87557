"""Receptance files of the CutPro kind: what samples in circulation look like, written and read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from jointlib.errors import InputError
from jointlib.frf import Quantity
from jointlib.io.cutpro import write_cutpro
from jointlib.io.frf_files import read_frfs
from machines import frozen_receptance, read_machine

LINES = np.arange(0.0, 2000.0, 0.5)
MODE = 1 / (5e6 * (1 - (LINES / 600) ** 2 + 0.06j * LINES / 600))


def test_what_is_written_is_read_back(tmp_path: Path) -> None:
    write_cutpro(tmp_path / "x.frf", LINES, MODE)
    (found,) = read_frfs(tmp_path / "x.frf")
    assert np.array_equal(found.frequency, LINES)
    assert np.max(np.abs(found.value - MODE) / np.abs(MODE)) < 1e-10
    assert found.quantity is Quantity.RECEPTANCE


@pytest.mark.parametrize(
    "text",
    [
        "  0.0  1e-7  0  Freq Hz Real m/N Imag m/N  \n  0.5 1.1e-7 -1e-9\t\n",
        "0\t1e-7\t0\tFreq\tHz\tReal\tm/N\tImag\tReal\n0.5\t1.1e-7\t-1e-9\t\n\n",
        "0 1e-7 0\n0.5 1.1e-7 -1e-9\n",
    ],
    ids=["blanks", "tabs and a slip in the last word", "no words"],
)
def test_layouts_in_circulation_are_read(tmp_path: Path, text: str) -> None:
    (tmp_path / "x.frf").write_text(text)
    (found,) = read_frfs(tmp_path / "x.frf")
    assert found.frequency.tolist() == [0.0, 0.5]
    assert found.value.tolist() == [1e-7, 1.1e-7 - 1e-9j]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "has 0 rows"),
        ("0 1e-7 0 Freq Hz Real mm/N Imag mm/N\n1 1 1\n", "values are in mm/N, expected a receptance in m/N"),
        ("0 1e-7 0 one two\n1 1 1\n", "its first row ends in 'one two'"),
        ("0 1e-7 0\n1 1e-7 0 Freq\n", "line 2 goes on with 'Freq'"),
        ("frequency real imag\n1 1 1\n", "line 1 is 'frequency real imag'"),
        ("0 1e-7 0\n1 1e-7\n", "line 2 is '1 1e-7'"),
        ("1 1e-7 0\n0 1e-7 0\n", "ascending"),
        ("0 1e-7 0\n1 nan 0\n", "not finite"),
    ],
)
def test_what_is_wrong_with_a_file_is_said(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "x.frf").write_text(text)
    with pytest.raises(InputError, match=said):
        read_frfs(tmp_path / "x.frf")


def test_lines_of_different_steps_are_not_written(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="expected one step"):
        write_cutpro(tmp_path / "x.frf", np.array([0.0, 1.0, 3.0]), np.ones(3, dtype=complex))
    assert not (tmp_path / "x.frf").exists()


def test_a_machine_can_be_made_of_such_files(tmp_path: Path) -> None:
    write_cutpro(tmp_path / "x.frf", LINES, MODE)
    (tmp_path / "machine.toml").write_text(
        """schema = "jointlib/machine/1"
[[component]]
name = "tool"
kind = "frf"
dofs = ["x"]
[[component.record]]
file = "x.frf"
response = "x"
drive = "x"
[tool]
x = "tool.x"
"""
    )
    machine = read_machine(tmp_path / "machine.toml")
    found = frozen_receptance(machine, LINES[1:], 0.0)
    assert np.max(np.abs(found.receptance[:, 0, 0] / MODE[1:] - 1)) < 1e-9
