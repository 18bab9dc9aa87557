"""Modes from files are the modes of the file, in SI, whatever the format."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import pyuff
from scipy.io import savemat

from jointlib.errors import InputError
from machines import Modal, linear_check, read_machine

FREQUENCY = np.array([120.0, 345.0])
RATIO = np.array([0.01, 0.02])
MASS = np.array([3.0, 2.0])
SHAPES = np.array([[1.0, 0.5], [-0.25, 0.75]])

GOOD = """
schema = "jointlib/machine/1"
[[component]]
name = "column"
kind = "modal"
dofs = ["top.x", "top.z"]
file = "modes.npz"
[tool]
x = "column.top.x"
"""
AT = 'at = ["12+X", "7-Z"]\n[tool]'


def universal(path: Path, length: float | None = None, force: float = 1.0, kind: int = 2, mass: bool = True) -> None:
    """Node 12 moves along x by the first row, node 7 along −z by the second, masses in the units of the file."""
    file = pyuff.UFF(str(path))
    if length is not None:
        units = {"units_code": 9, "units_description": "own", "temp_mode": 1, "temp": 1.0, "temp_offset": 0.0}
        file.write_sets({"type": 164, **units, "length": length, "force": force}, "add")
    for i in range(2):
        data = {"type": 55, "analysis_type": kind, "data_ch": 2, "spec_data_type": 8, "load_case": 0, "mode_n": i + 1}
        data |= {"freq": FREQUENCY[i], "modal_m": MASS[i] * force / (length or 1) if mass else 0.0}
        data |= {"modal_damp_vis": RATIO[i], "eig": 1j * FREQUENCY[i], "node_nums": np.array([7, 12])}
        data |= {"r1": np.array([0.0, SHAPES[0, i]]), "r2": np.zeros(2), "r3": np.array([-SHAPES[1, i], 0.0])}
        if kind != 2:
            data["r1"] = data["r1"] * (1 + 0.1j)
        file.write_sets(data, "add")


def files(folder: Path) -> None:
    held = {"frequency": FREQUENCY, "damping_ratio": RATIO, "modal_mass": MASS, "shapes": SHAPES}
    np.savez(folder / "modes.npz", **held)
    savemat(folder / "modes.mat", held)
    np.savez(folder / "undamped.npz", frequency=FREQUENCY, shapes=SHAPES)
    np.savez(folder / "complex.npz", frequency=FREQUENCY, shapes=SHAPES * 1j)
    rows = np.column_stack([FREQUENCY, RATIO, MASS, *SHAPES])
    header = "frequency,damping_ratio,modal_mass,top.x,top.z"
    np.savetxt(folder / "modes.csv", rows, delimiter=",", header=header, comments="", fmt="%.17g")
    universal(folder / "modes.uff")
    universal(folder / "mm.uff", 1000.0)
    universal(folder / "turning.uff", kind=3)
    universal(folder / "massless.uff", mass=False)


def read(folder: Path, text: str) -> Modal:
    files(folder)
    (folder / "m.toml").write_text(text)
    machine = read_machine(folder / "m.toml")
    (part,) = machine.components
    assert isinstance(part, Modal)
    assert linear_check(machine).passed
    return part


@pytest.mark.parametrize("file", ["modes.npz", "modes.mat", "modes.csv", "modes.uff", "mm.uff"])
def test_modes_are_those_of_the_file(tmp_path: Path, file: str) -> None:
    """In mm and N the modal mass stands in t; the set of units says so."""
    text = GOOD.replace("modes.npz", file)
    part = read(tmp_path, text.replace("[tool]", AT) if file.endswith("uff") else text)
    for key, value in (("frequency", FREQUENCY), ("damping_ratio", RATIO), ("modal_mass", MASS), ("shapes", SHAPES)):
        assert getattr(part, key) == pytest.approx(value, rel=1e-5)


def test_units_and_missing_masses_are_told(tmp_path: Path) -> None:
    part = read(tmp_path, GOOD.replace("modes.npz", "massless.uff").replace("[tool]", AT))
    assert part.modal_mass is not None
    assert part.modal_mass.tolist() == [1.0, 1.0]
    said = " ".join(part.remarks())
    assert "no units, taken as SI" in said
    assert "mass-normalised" in said


def test_damping_may_stand_beside_the_file(tmp_path: Path) -> None:
    text = GOOD.replace("modes.npz", "undamped.npz").replace("[tool]", "damping_ratio = [0.03, 0.04]\n[tool]")
    assert read(tmp_path, text).damping_ratio.tolist() == [0.03, 0.04]


BAD = [
    ("modes.npz", "lost.npz", "no such file"),
    ("modes.npz", "m.xyz", "no reader for modes"),
    ("modes.npz", "undamped.npz", "tells no damping"),
    ("modes.npz", "complex.npz", "complex values"),
    ("modes.npz", "modes.uff", "expected at, node and direction"),
    ("[tool]", AT, "expected at, node and direction of every dof, for a universal file and for no other"),
    ('"modes.npz"\n[tool]', '"modes.uff"\n' + AT.replace(', "7-Z"', ""), "1 places for 2 dofs"),
    ('"modes.npz"\n[tool]', '"modes.uff"\n' + AT.replace("7-Z", "8-Z"), "no motion '8-Z' in mode 1"),
    ('"modes.npz"\n[tool]', '"modes.uff"\n' + AT.replace("7-Z", "seven"), "at is 'seven'"),
    ('"modes.npz"\n[tool]', '"turning.uff"\n' + AT, "complex or other modes"),
    (
        '"modes.npz"',
        '"modes.npz"\nfrequency = [1]',
        "frequency has 1 value, expected one for each",
    ),
    ('"top.z"', '"top.y", "top.z"', "shapes has shape"),
]


@pytest.mark.parametrize(("old", "new", "words"), BAD)
def test_what_is_wrong_is_said_in_one_sentence(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in GOOD
    (tmp_path / "m.xyz").write_text("")
    with pytest.raises(InputError, match=words) as caught:
        read(tmp_path, GOOD.replace(old, new, 1))
    assert str(caught.value).startswith(str(tmp_path / "m.toml"))
    assert "\n" not in str(caught.value)
