"""Receptances that are none, given to `lobes` as a measured tool point: one sentence each."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from command_line import jointlib

LINES = np.arange(20.0, 1500.0, 5.0)
OMEGA = 2 * np.pi * LINES
TOOL = """
schema = "jointlib/machine/1"
[[component]]
name = "tool"
kind = "frf"
dofs = ["x"]
interpolation = "rational"
[[component.record]]
file = "tool.npz"
[tool]
x = "tool.x"
[response]
frequency = [25, 1400]
[cutting]
process = "milling"
teeth = 3
tangential = "600 N/mm^2"
normal = "200 N/mm^2"
mode = "up"
immersion = 0.5
"""


def two_modes() -> np.ndarray:
    """m/N."""
    first = 2 * np.pi * 310.0
    return sum(0.09 / (w**2 - OMEGA**2 + 0.04j * OMEGA * w) for w in (first, 2.5 * first))


@pytest.fixture
def own(tmp_path: Path) -> Iterator[Path]:
    with contextlib.chdir(tmp_path):
        Path("m.toml").write_text(TOOL)
        yield tmp_path


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (lambda G: -(OMEGA**2) * G, 'as an accelerance does, then say quantity = "accelerance"'),
        (lambda G: 1j * OMEGA * G, "the data look like a mobility; expected a receptance in m/N: divide by jω"),
        (lambda G: G.conj(), "it may count time as exp(-jωt), then say conjugate = true"),
        (lambda G: -G, "or carry the wrong sign"),
        (lambda G: 1 / (-2e7 - 20 * OMEGA**2 + 1500j * OMEGA), "a negative static stiffness"),
    ],
    ids=["accelerance", "mobility", "conjugate", "sign", "negative stiffness"],
)
def test_what_is_no_receptance_is_named(made: object, said: str, own: Path) -> None:
    assert callable(made)
    np.savez("tool.npz", frequency=LINES, receptance=made(two_modes())[:, None, None])
    done = jointlib("lobes m.toml --speed 6000")
    assert (done.status, done.out) == (2, "")
    assert said in done.err.splitlines()[-1]
