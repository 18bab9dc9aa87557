"""A gantry mill with one mistake each: the sentence that names it, and none of what merely follows from it."""

from __future__ import annotations

from pathlib import Path

import pytest
from gantry_mill import gantry

from jointlib.errors import InputError
from machines import read_machine
from machines.mistakes import mistakes


def test_nothing_is_said_of_the_gantry(tmp_path: Path) -> None:
    assert mistakes(read_machine(gantry(tmp_path))) == ()


@pytest.mark.parametrize(
    ("x", "y", "words"),
    [
        ("cutter.tip.x", "cutter.tip.x", r"\[tool\]: y: 'cutter.tip.x' is the same degree of freedom as x"),
        ("cutter.tip.x - quill.nose.x", "cutter.tip.x - quill.nose.x", "is the same degree of freedom as x"),
        ("cutter.tip.x - quill.nose.x", "quill.nose.x - cutter.tip.x", "is the opposite of x"),
    ],
)
def test_two_directions_of_the_tool_are_two_motions(x: str, y: str, words: str, tmp_path: Path) -> None:
    edits = (('x = "cutter.tip.x"', f'x = "{x}"'), ('y = "cutter.tip.y"', f'y = "{y}"'))
    with pytest.raises(InputError, match=words):
        read_machine(gantry(tmp_path, *edits))
