"""From hits to a tool that was never in the spindle: three blanks struck in time, a fourth tool predicted."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tapped_spindle import DENSITY, POISSON, TIME, YOUNG, assembled, struck

from jointlib.answers.estimate import estimate
from machines import read_machine, uncouple
from machines.harmonic_balance.assembly import Assembly
from machines.statics.working_point import tangents

BLANKS = {"short": (0.05, 0.04, 0.038), "thick": (0.06, 0.045, 0.045), "long": (0.07, 0.042, 0.05)}
"""Length, diameter and where the neck lies, m."""
TOOL = ((0.03, 0.010), (0.03, 0.014))
"""Never in the spindle while it was measured."""
MACHINE = """schema = "jointlib/machine/1"
[[component]]
name = "spindle"
file = "end.component.toml"
[[component]]
name = "cutter"
file = "cutter.component.toml"
[[connection]]
name = "face"
between = ["cutter", "spindle"]
at = [0, 0, 0]
rigid = true
holds = ["x", "ry"]
[tool]
x = "cutter.tip.x"
"""


def bar(folder: Path, name: str, segments: tuple[tuple[float, float], ...], stations: dict[str, float]) -> Path:
    """The component file of a bar that ends at the origin, along z."""
    length = sum(part for part, _ in segments)
    text = (
        f'schema = "jointlib/component/1"\nkind = "beam"\nstart = [0, 0, {-length}]\naxis = [0, 0, 1]\n'
        f'[[material]]\nname = "steel"\nyoung = {YOUNG}\npoisson = {POISSON}\ndensity = {DENSITY}\nviscous = {TIME}\n'
    )
    text += "".join(f"[[segment]]\nlength = {part}\ndiameter = {d}\n" for part, d in segments)
    stations = {**stations, "face": length}
    text += "".join(f'[[station]]\nname = "{word}"\nat = {at}\n' for word, at in stations.items())
    path = folder / f"{name}.component.toml"
    path.write_text(text)
    return path


def depth(H: np.ndarray) -> float:
    """Lowest stable depth in m of a cut of 700 N/mm² along one direction, −1/(2 Ks min Re H)."""
    return float(-1 / (2 * 7e8 * np.min(H.real)))


@pytest.mark.slow
@pytest.mark.parametrize(
    "seed", [pytest.param(0, marks=pytest.mark.thorough), *(pytest.param(k, marks=pytest.mark.slow) for k in (1, 2))]
)
def test_hits_on_three_blanks_predict_a_fourth_tool(tmp_path: Path, seed: int) -> None:
    measured, blanks = [], []
    for k, (name, (length, diameter, neck)) in enumerate(BLANKS.items()):
        hits = struck(tmp_path, name, ((length, diameter),), neck, 10 * seed + k)
        measured.append(tmp_path / f"{name}.measurement.toml")
        estimate(hits, output=measured[-1])
        blanks.append(bar(tmp_path, name, ((length, diameter),), {"tip": 0.0, "neck": neck}))
    uncouple(measured, remove=blanks, output=tmp_path / "end.component.toml")
    bar(tmp_path, "cutter", TOOL, {"tip": 0.0})
    (tmp_path / "machine.toml").write_text(MACHINE)
    machine = read_machine(tmp_path / "machine.toml")
    lines = np.arange(300.0, 4400.0, 0.5)
    H = Assembly(machine, machine.tool_dofs, machine.tool_dofs).coupled(2 * np.pi * lines, tangents(machine, lines))[
        :, 0, 0
    ]
    true = assembled(TOOL, (0.0,)).compliance(lines, 0)
    peaks = [lines[np.argmax(np.abs(each))] for each in (H, true)]
    assert peaks[0] == pytest.approx(peaks[1], rel=5e-3)
    assert depth(H) == pytest.approx(depth(true), rel=0.1)
