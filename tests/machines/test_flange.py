"""A flange against what it replaces: a beam that goes on, bodies in one piece, rigid rows written one by one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from jointlib.arrays import Array
from jointlib.errors import InputError
from machines import Connection, Machine, Rigid, read_machine
from machines.components.beam import Beam, Segment
from machines.components.flange import flange
from machines.coupling.second_order import machine_equations
from machines.shapes.profile import Material

STEEL = Material("steel", 210e9, 0.3, 7800.0)
LENGTH = 0.6


def bar(name: str, start: float, length: float) -> Beam:
    segment = Segment(length, STEEL, width=0.05, height=0.08, wall=0.006)
    ends = {"left": 0.0, "right": length}
    where = {"start": np.array([start, 0.0, 0.0]), "axis": np.array([1.0, 0, 0]), "up": np.array([0.0, 0.6, 0.8])}
    return Beam(name, (segment,), ends, up_to=3000.0, **where)


def frequencies(machine: Machine) -> Array:
    return machine_equations(machine).natural_frequencies(np.empty(0))


def test_two_beams_on_a_flange_are_the_beam_that_goes_on() -> None:
    clamp = flange("clamp", ("whole", "ground"), (0.0, 0.0, 0.0))
    whole = Machine((bar("whole", 0.0, LENGTH),), clamp)
    halves = Machine(
        (bar("one", 0.0, 0.2), bar("two", 0.2, LENGTH - 0.2)),
        (*flange("clamp", ("one", "ground"), (0.0, 0.0, 0.0)), *flange("middle", ("two", "one"), (0.2, 0.0, 0.0))),
    )
    found, expected = frequencies(halves), frequencies(whole)
    assert expected[5] < 3000
    np.testing.assert_allclose(found[:6], expected[:6], rtol=1e-6)


def test_two_bodies_on_a_flange_are_one_body_wherever_it_lies() -> None:
    """One body: masses added, inertia about the common centre by Steiner."""
    masses, centres = (3.0, 5.0), (np.array([0.1, 0, 0.3]), np.array([-0.2, 0.4, 0.0]))
    own = (np.diag([0.1, 0.2, 0.15]), np.diag([0.3, 0.1, 0.2]))
    bodies = tuple(
        Rigid(name, m, J, c, points={"tip": np.array([0.5, 0.6, 0.7])})
        for name, m, J, c in zip("ab", masses, own, centres, strict=True)
    )
    m, centre = sum(masses), sum(m * c for m, c in zip(masses, centres, strict=True)) / sum(masses)
    arms = [c - centre for c in centres]
    steiner = [k * (r @ r * np.eye(3) - np.outer(r, r)) for k, r in zip(masses, arms, strict=True)]
    one = Machine((Rigid("a", m, own[0] + own[1] + steiner[0] + steiner[1], centre, points=bodies[0].points),))
    for at in ((0.0, 0.0, 0.0), (2.0, -1.0, 0.5)):
        joined = Machine(bodies, flange("foot", ("a", "b"), at))
        for dof in ("a.tip.x", "a.tip.y", "a.tip.z"):
            inverse = [
                float(
                    (row := x.dof_rows([dof], "tip") @ (e := machine_equations(x)).shapes)[0]
                    @ np.linalg.solve(e.mass, row[0])
                )
                for x in (one, joined)
            ]
            assert inverse[1] == pytest.approx(inverse[0], rel=1e-9)


def test_a_partial_flange_is_a_hinge() -> None:
    """Without its rotation about z a clamped bar swings: one free motion; all others are those of the clamped one."""
    beam = bar("bar", 0.0, LENGTH)
    hinged = Machine((beam,), flange("hinge", ("bar", "ground"), (0, 0, 0), ("x", "y", "z", "rx", "ry")))
    assert np.sum(frequencies(hinged) < 1.0) == 1
    assert np.sum(frequencies(Machine((beam,), flange("foot", ("bar", "ground"), (0, 0, 0)))) < 1.0) == 0


FILE = """
schema = "jointlib/machine/1"
[[component]]
name = "bed"
kind = "rigid"
mass = 100
inertia = [5, 5, 5]
[[component]]
name = "column"
kind = "beam"
axis = [0, 0, 1]
start = [0.1, 0, 0.2]
[[component.material]]
name = "steel"
young = "210 GPa"
poisson = 0.3
density = 7800
[[component.segment]]
length = "800 mm"
diameter = "100 mm"
[[component.station]]
name = "foot"
at = 0
[[component.station]]
name = "top"
at = "end"
[[connection]]
name = "foot"
between = ["column", "bed"]
rigid = true
at = [0.1, 0, 0.2]
"""


def written(folder: Path, text: str) -> Path:
    (folder / "m.toml").write_text(text)
    return folder / "m.toml"


def test_one_connection_of_a_file_is_six_rigid_ones_as_rows_would_have_them(tmp_path: Path) -> None:
    machine = read_machine(written(tmp_path, FILE))
    assert [c.name for c in machine.connections] == [f"foot.{d}" for d in ("x", "y", "z", "rx", "ry", "rz")]
    rows = tuple(
        Connection(d, ("column", "bed"), rigid=True, at=(0.1, 0, 0.2), direction=tuple(np.eye(3)[i]))
        for i, d in enumerate("xyz")
    )
    rows += tuple(Connection(d, (f"column.foot.{d}", f"bed.{d}"), rigid=True) for d in ("rx", "ry", "rz"))
    by_hand = replace(machine, connections=rows)
    np.testing.assert_allclose(machine.rows(machine.connections), by_hand.rows(rows), atol=1e-15)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("rigid = true\n", 'rigid = true\nholds = ["x", "rq"]\n', "rq"),
        ("rigid = true\n", "rigid = true\nholds = []\n", "holds is empty"),
        ("rigid = true\n", 'rigid = true\nholds = ["x", "x"]\n', "twice"),
        ("rigid = true\nat = [0.1, 0, 0.2]", 'holds = ["x"]\nrigid = true\n', "expected rigid = true and at beside it"),
        ('["column", "bed"]', '["column.foot.x", "bed"]', "a flange holds parts"),
        ("at = [0.1, 0, 0.2]", "at = [0.1, 0, 0.4]", "no node at"),
    ],
)
def test_a_flange_that_holds_nothing_of_the_kind_is_refused_in_a_sentence(
    tmp_path: Path, old: str, new: str, words: str
) -> None:
    assert old in FILE
    with pytest.raises(InputError) as refused:
        read_machine(written(tmp_path, FILE.replace(old, new)))
    assert words in str(refused.value)
    assert "m.toml" in str(refused.value)
