"""A part known by its modes with the base held, riding on a body that moves, against the beam that it is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from scipy.linalg import eigh

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import Connection, Machine, Modal, Rigid, Segment, frozen_receptance, linear_check, read_machine
from machines.components.beam import Beam
from machines.components.flange import flange
from machines.components.riding import Riding
from machines.coupling.second_order import machine_equations
from machines.model.masses import part_masses
from machines.shapes.profile import Material

STEEL = Material("steel", 210e9, 0.3, 7800.0)
LENGTH, BASE = 0.7, np.array([0.2, -0.1, 0.5])
SECTION = Segment(LENGTH, STEEL, width=0.06, height=0.09, wall=0.006)
MASS = 7800.0 * LENGTH * SECTION.profile.area
DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")


def column(length: float = LENGTH, up_to: float = 8000.0) -> Beam:
    stations = {"root": 0.0, "tip": length}
    axis, up = np.array([0.0, 0, 1]), np.array([0.6, 0.8, 0])
    return Beam("column", (replace(SECTION, length=length),), stations, start=BASE, axis=axis, up=up, up_to=up_to)


def modes_of(beam: Beam, count: int) -> Riding:
    """Its modes with the root held, and their participation Rᵀ M φ, from the matrices of the beam itself.

    R: the motions of the free beam without strain, one for each motion of the root.
    """
    model = beam.second_order()
    values, vectors = eigh(model.stiffness, model.mass)
    free = vectors[:, np.argsort(values)[:6]]
    root, tip = (np.array([list(beam.dofs).index(f"{s}.{d}") for d in DIRECTIONS]) for s in ("root", "tip"))
    R = free @ np.linalg.inv(model.shapes[root] @ free)
    clamped = machine_equations(Machine((beam,), flange("clamp", ("column", "ground"), tuple(BASE))))
    held = null_of(model.shapes[root])
    squared, phi = eigh(clamped.stiffness, clamped.mass)
    own, shapes = eigh(held.T @ model.stiffness @ held, held.T @ model.mass @ held)
    np.testing.assert_allclose(own[:count], squared[:count], rtol=1e-8)
    phi = held @ shapes[:, :count]
    whole, length = R.T @ model.mass @ R, beam.segments[0].length
    mass, arm = 7800.0 * length * SECTION.profile.area, np.array([0, 0, length / 2])
    inertia = whole[3:, 3:] - mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    dofs = tuple(f"tip.{d}" for d in DIRECTIONS)
    modes = Modal("column", dofs, np.sqrt(own[:count]) / (2 * np.pi), np.zeros(count), model.shapes[tip] @ phi)
    return Riding(modes, BASE, mass, BASE + arm, inertia, R.T @ model.mass @ phi, {"tip": BASE + 2 * arm})


def null_of(rows: Array) -> Array:
    return np.linalg.svd(rows)[2][len(rows) :].T


def on_a_body(part: Beam | Riding) -> Machine:
    """The part flanged to a body on six springs; its tip is held by a spring and a damper."""
    body = Rigid("body", 12.0, np.array([0.3, 0.25, 0.2]), np.array([0.2, -0.1, 0.3]))
    joints = tuple(
        Connection(f"spring_{i}", ("body", "ground"), Joint((Linear(4e7), Viscous(900.0))), at=at, direction=n)
        for i, (at, n) in enumerate(
            (at, n)
            for at in ((0.0, 0.0, 0.2), (0.4, 0.0, 0.2), (0.2, -0.3, 0.2))
            for n in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
        )
    )
    strut = Connection("strut", ("column.tip.x", "ground"), Joint((Linear(3e5), Viscous(300.0))))
    foot = flange("foot", ("column", "body"), tuple(BASE))
    return Machine((body, part), (*joints, strut, *foot), tool={"x": "column.tip.x", "y": "column.tip.y"})


def test_a_column_of_modes_on_a_moving_body_is_the_beam_on_it() -> None:
    """Modes up to 8 kHz leave out the rest of the flexibility; at 1 kHz that is below 1e-4."""
    whole, riding = on_a_body(column()), on_a_body(modes_of(column(), 16))
    lines = np.linspace(20.0, 1000.0, 99)
    one, other = (frozen_receptance(m, lines, 0.0).receptance for m in (whole, riding))
    np.testing.assert_allclose(abs(other - one).max(), 0, atol=2e-3 * abs(one).max())
    gains = np.array([4e7] * 9 + [3e5])
    few = [machine_equations(m).natural_frequencies(gains)[:8] for m in (whole, riding)]
    np.testing.assert_allclose(few[1], few[0], rtol=1e-4)


def test_with_all_its_modes_it_is_the_beam_to_rounding() -> None:
    beam = column()
    riding = modes_of(beam, len(beam.second_order().mass) - 6)
    omega = 2 * np.pi * np.array([30.0, 411.0, 2500.0])
    rows = [list(riding.dofs).index(f"tip.{d}") for d in DIRECTIONS]
    tip = np.eye(len(beam.dofs))[[list(beam.dofs).index(f"tip.{d}") for d in DIRECTIONS]]
    one, other = beam.receptance(omega, tip), riding.receptance(omega, np.eye(len(riding.dofs))[rows])
    np.testing.assert_allclose(other, one, rtol=1e-5, atol=1e-9 * abs(one).max())


def test_the_first_bending_mode_of_a_slender_column_carries_61_percent_of_its_mass() -> None:
    """Effective mass of the first mode of a clamped-free Euler beam: (2 σ / λ)² = 0.6131 of the whole."""
    slender = modes_of(column(5.0, 100.0), 2)
    np.testing.assert_allclose(np.sum(slender.participation[:2] ** 2, axis=0) / slender.mass, 0.6131, rtol=5e-4)


def test_it_is_checked_by_the_second_route_and_weighs_what_it_weighs() -> None:
    machine = on_a_body(modes_of(column(), 10))
    assert linear_check(replace(machine, frequency=(10.0, 2000.0))).passed
    force = modes_of(column(), 3).weight(np.array([0.0, 0.0, -9.81]))
    assert force[2] == pytest.approx(-9.81 * MASS)
    np.testing.assert_allclose(force[3:6], 0, atol=1e-12)  # its centre stands over its base


def table(part: Riding) -> dict[str, object]:
    modes = part.modes
    return {
        "name": "column",
        "kind": "modal",
        "dofs": list(modes.dofs),
        "frequency": modes.frequency.tolist(),
        "damping_ratio": modes.damping_ratio.tolist(),
        "shapes": modes.shapes.tolist(),
        "base": part.base.tolist(),
        "mass": part.mass,
        "centre": part.centre.tolist(),
        "inertia": part.inertia.tolist(),
        "participation": part.participation.tolist(),
        "point": [{"name": "tip", "at": part.points["tip"].tolist()}],
    }


def read(folder: Path, part: dict[str, object], others: tuple[object, ...] = (), **further: object) -> Machine:
    flange_of = {"name": "foot", "between": ["column", "table"], "at": BASE.tolist(), "rigid": True}
    body = {"name": "table", "kind": "rigid", "mass": 40.0, "inertia": [1.0, 1.0, 1.0], "centre": [0.2, -0.1, 0.4]}
    document = {
        "schema": "jointlib/machine/1",
        "component": [body, part, *others],
        "connection": [flange_of],
        "tool": {"x": "column.tip.x"},
        **further,
    }
    (folder / "m.toml").write_text(tomli_w.dumps(document))
    return read_machine(folder / "m.toml")


def test_a_file_gives_it_and_an_axis_takes_it_along(tmp_path: Path) -> None:
    part = modes_of(column(), 6)
    machine = read(tmp_path, table(part))
    np.testing.assert_allclose(machine.components[1].second_order().mass, part.second_order().mass, atol=1e-12)
    told = part_masses(machine)[1]
    assert told.mass == pytest.approx(part.mass, rel=1e-12)
    np.testing.assert_allclose(told.centre, part.centre, atol=1e-12)
    axis = [{"name": "x", "direction": [1, 0, 0], "moves": ["table"], "position": 0.3}]
    spring = {"law": [{"kind": "linear", "stiffness": 1e8}]}
    screw = {"name": "screw", "between": ["table.ux", "bed.x"], "joint": spring}
    bed = {"name": "bed", "kind": "lumped", "dofs": ["x"], "mass": [[900.0]], "stiffness": [[1e8]]}
    foot = {"name": "foot", "between": ["column", "table"], "at": BASE.tolist(), "rigid": True}
    moved = read(tmp_path, table(part), (bed,), axis=axis, connection=[screw, foot])
    assert moved.axes[0].moves == ("table", "column")
    riding = moved.components[1]
    assert isinstance(riding, Riding)
    np.testing.assert_allclose(riding.base - BASE, [0.3, 0, 0], atol=1e-12)
    np.testing.assert_allclose(riding.centre - part.centre, [0.3, 0, 0], atol=1e-12)
    np.testing.assert_allclose(riding.second_order().mass, part.second_order().mass, atol=1e-9)


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("mass", 0.1 * MASS, "carry more than the part has"),
        ("participation", [[1.0]], "a column per mode"),
        ("dofs", ["tip", "b", "c", "d", "e", "f"], "such as tip.x"),
        ("mass", -1.0, "more than 0"),
    ],
)
def test_what_does_not_belong_together_is_refused(tmp_path: Path, key: str, value: object, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read(tmp_path, {**table(modes_of(column(), 6)), key: value})
