"""A machine as it is drawn: where its file has it, moving as its degrees of freedom do."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from jointlib.arrays import Array
from jointlib.errors import InputError
from machines import Beam, Machine, Rigid, read_machine
from machines.components.beam import Segment
from machines.shapes.profile import Material
from machines.shapes.solid import Solid, bar, block, rail, ring
from machines.view import Scene, scene
from machines.view.page import data, page
from machines.view.piece import Piece
from machines.view.places import Places
from machines.view.svg import picture

LIBRARY = Path("machines/library")
STEEL = Material("steel", 210e9, 0.3, 7850.0)


@pytest.fixture(scope="module")
def mill() -> Machine:
    return read_machine(LIBRARY / "column_mill_a.toml")


@pytest.fixture(scope="module")
def drawn(mill: Machine) -> Scene:
    return scene(mill)


@pytest.fixture(scope="module")
def lathe() -> Scene:
    return scene(read_machine(LIBRARY / "lathe.toml"))


def span(picture: Scene, name: str) -> tuple[Array, Array]:
    """Lowest and highest corner of what is called so."""
    corners = np.concatenate([p.corners for p in picture.pieces if p.name == name])
    return np.min(corners, axis=0), np.max(corners, axis=0)


def piece(picture: Scene, name: str) -> Piece:
    (found,) = (p for p in picture.pieces if p.name == name)
    return found


def test_bodies_are_the_blocks_that_have_their_inertia(drawn: Scene) -> None:
    # The file says: a block of 1.5 x 1.9 x 0.6 m about (0, 0.3, 0.35), its inertia rounded to 3 digits.
    low, high = span(drawn, "bed (rigid)")
    np.testing.assert_allclose(high - low, [1.5, 1.9, 0.6], rtol=3e-3)
    np.testing.assert_allclose((low + high) / 2, [0.0, 0.3, 0.35], atol=0.02)


def test_an_inertia_about_other_axes_turns_the_block() -> None:
    J = np.diag([660.0, 435.0, 975.0])
    c, s = np.cos(0.3), np.sin(0.3)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    (straight,), (turned,) = (Rigid("b", 2000.0, j).drawn().solids for j in (J, turn @ J @ turn.T))
    wanted = {tuple(np.round(turn @ corner, 9)) for corner in straight.corners}
    assert {tuple(np.round(corner, 9)) for corner in turned.corners} == wanted


def test_beams_are_their_segments(lathe: Scene) -> None:
    low, high = span(lathe, "spindle (beam)")
    # From z = -0.5 over 420 + 60 + 90 + 150 mm; the chuck of 200 mm is the widest.
    np.testing.assert_allclose([low[2], high[2]], [-0.5, 0.22], atol=1e-12)
    np.testing.assert_allclose([low[0], high[0]], [-0.1, 0.1], atol=1e-12)
    np.testing.assert_allclose([low[1], high[1]], [0.9, 1.1], atol=1e-12)


def test_machine_elements_stand_where_the_file_has_them(lathe: Scene) -> None:
    # Bearings: two rings each way about (0, 1, -0.1), 24 mm apart; outer rings reach one ball beyond the pitch circle.
    low, high = span(lathe, "front (bearing-pair)")
    np.testing.assert_allclose((low + high) / 2, [0.0, 1.0, -0.1], atol=1e-12)
    np.testing.assert_allclose(high[0] - low[0], 0.125 + 2 * 0.014288, rtol=1e-12)
    np.testing.assert_allclose(high[2] - low[2], 0.024 + 1.5 * 0.014288, rtol=1e-12)
    # Screw: its nut at z = 0.25 stands 500 mm from the fixed bearing, the bearings 1.1 m apart.
    shafts = [p for p in lathe.pieces if p.owner == "z_screw" and np.ptp(p.corners[:, 2]) > 1.0]
    np.testing.assert_allclose([shafts[0].corners[:, 2].min(), shafts[0].corners[:, 2].max()], [-0.25, 0.85])
    # Rails: carriages at z = 0.1 and 0.4, 104 mm long, travel of -130 to 0 mm; one rail on either side.
    low, high = span(lathe, "rail 1 of z_guide")
    np.testing.assert_allclose([low[2], high[2]], [0.1 - 0.13 - 0.052, 0.4 + 0.052])
    assert [p.name for p in lathe.pieces if p.name.startswith("rail") and p.owner == "z_guide"] == [
        "rail 1 of z_guide",
        "rail 2 of z_guide",
    ]


def test_an_axis_takes_its_part_of_the_picture_with_it() -> None:
    here, there = (scene(read_machine(LIBRARY / "lathe.toml", {"axis.z.position": z})) for z in ("0 mm", "-100 mm"))
    moved = {"slide (rigid)", "z_guide_1 (linear-guide)", "post (rigid)", "x_guide_2 (linear-guide)"}
    for name in (*moved, "rail 1 of z_guide", "rail 1 of x_guide", "bed (rigid)", "spindle (beam)"):
        by = -0.1 if name in moved or name == "rail 1 of x_guide" else 0.0
        wanted = np.array(span(here, name)) + np.array([0.0, 0.0, by])
        np.testing.assert_allclose(span(there, name), wanted, atol=1e-9, err_msg=name)
    screws = [[p.corners for p in s.pieces if p.name == "z_screw (ball-screw)"] for s in (here, there)]
    (nut, *held), (nut_there, *held_there) = screws
    np.testing.assert_allclose(nut_there, nut - np.array([0.0, 0.0, 0.1]), atol=1e-12)
    for before, after in zip(held, held_there, strict=True):  # shaft and bearings stay
        np.testing.assert_allclose(after, before, atol=1e-12)


def rigid_shape(machine: Machine, u: Array, turn: Array) -> Array:
    """Every degree of freedom of a machine whose bodies and beams all move as one, u + ϑ × r."""
    out: list[float] = []
    for component in machine.components:
        if isinstance(component, Rigid):
            assert component.centre is not None
            out += [*(u + np.cross(turn, component.centre)), *turn]
            out += [x for at in component.points.values() for x in u + np.cross(turn, at)]
        elif isinstance(component, Beam):
            for at in component.nodes.positions:
                out += [*(u + np.cross(turn, at)), *turn]
    return np.array(out)


@pytest.mark.parametrize("name", ["column_mill_a", "lathe"])
def test_a_machine_that_moves_as_one_is_drawn_as_one(name: str) -> None:
    machine = read_machine(LIBRARY / f"{name}.toml")
    shown = scene(machine)
    u, turn = np.array([0.3, -0.2, 0.5]), np.array([0.7, -0.4, 0.2])
    moved = shown.moves(rigid_shape(machine, u, turn)[:, None])[0]
    corners, frame = shown.corners
    motion = shown.displaced(corners, frame, moved)
    does_not_turn = np.array([not np.any(f.rows[3:]) for f in shown.frames])  # the ground, and arrows of the tool
    body = ~does_not_turn[frame]
    assert np.sum(body) > 1000
    np.testing.assert_allclose(motion[body], (u + np.cross(turn, corners))[body], atol=1e-12)
    # Distances between its points stay as they are to first order: relative motion is across what joins them.
    pairs = np.random.default_rng(1).choice(np.flatnonzero(body), (500, 2))
    apart, slide = (x[pairs[:, 0]] - x[pairs[:, 1]] for x in (corners, motion))
    assert np.max(np.abs(np.sum(apart * slide, axis=1))) < 1e-12
    assert not np.any(moved[0])


@pytest.mark.parametrize("name", ["column_mill_a", "lathe", "guide_mill", "carriage"])
def test_the_ends_of_every_contact_part_as_its_joint_is_strained(name: str) -> None:
    """Another route to the motion of the frames: the rows of the connections, which the coupling uses."""
    machine = read_machine(LIBRARY / f"{name}.toml")
    shape = np.random.default_rng(2).standard_normal(len(machine.dofs))
    places, count = Places(machine), 0
    for connection in machine.connections:
        found = places.line(connection)
        if found is None or connection.turns:
            continue
        at, n = found
        ahead, behind = (places.side(side, at, n) for side in connection.between)
        motion = [n @ places.frames[i].motion(at) @ shape for i in (ahead, behind)]
        strain = float(connection.row(machine.components) @ shape)
        assert motion[0] - motion[1] == pytest.approx(strain, abs=1e-12), connection.name
        count += 1
    assert count >= len(machine.connections) - 3


def test_a_beam_is_drawn_through_its_stations_and_bends_as_a_cantilever() -> None:
    stations = {"tip": 0.5, "root": 0.0}
    beam = Beam("b", (Segment(0.5, STEEL, diameter=0.02),), stations, axis=np.array([0.0, 1.0, 0.0]))
    frames = beam.drawn().frames
    shape = np.random.default_rng(3).standard_normal(12)
    for number, name in enumerate(stations):
        np.testing.assert_array_equal(frames[number].rows @ shape, shape[6 * number : 6 * number + 6])
        np.testing.assert_array_equal(frames[number].origin, [0.0, stations[name], 0.0])
    # Under a force at its tip: w = F x² (3 L - x)/(6 EI), with the slope about x for w along z.
    L, bent = 0.5, np.zeros(12)
    bent[2], bent[3] = L**3 / 3, L**2 / 2
    for frame in frames:
        x = frame.origin[1]
        moved = frame.rows @ bent
        assert moved[2] == pytest.approx(x**2 * (3 * L - x) / 6, abs=1e-15)
        assert moved[3] == pytest.approx(x * (2 * L - x) / 2, abs=1e-15)


def volume(solid: Solid) -> float:
    """By Gauss's theorem, which a gap or a face that looks inwards would spoil."""
    P = solid.corners
    return sum(float(P[f[0]] @ np.cross(P[f[i]], P[f[i + 1]])) / 6 for f in solid.faces for i in range(1, len(f) - 1))


def test_solids_are_closed_and_look_outwards(mill: Machine) -> None:
    circle = 16 / 2 * np.sin(2 * np.pi / 16)  # area of the polygon over the square of its radius
    assert volume(block((1, 2, 3), (1, 2, 3))) == pytest.approx(6.0)
    assert volume(bar(0.0, 2.0, 0.5)) == pytest.approx(0.5 * circle)
    square = np.array([[0.0, 0.0], [0.2, 0.0], [0.2, 0.1], [0.0, 0.1]])
    assert volume(rail(-1.0, 2.0, square, 1, pieces=5)) == pytest.approx(0.06)
    assert volume(bar(0.0, 2.0, 0.5, pieces=7)) == pytest.approx(0.5 * circle)
    assert volume(ring(0.0, 2.0, 0.5, 0.3)) == pytest.approx(2 * (0.25 - 0.09) * circle)
    for component in mill.components:
        shown = component.drawn()
        assert shown is not None
        assert all(volume(solid) > 0 for solid in shown.solids), component.name
    for bundle in mill.bundles:
        assert all(volume(solid) > 0 for solid in bundle.bundle.solids()), bundle.name


def test_what_has_no_place_is_drawn_at_its_connections_and_said() -> None:
    shown = scene(read_machine(LIBRARY / "guide_mill.toml"))
    (cutter,) = (p for p in shown.pieces if p.owner == "cutter")
    np.testing.assert_array_equal(cutter.corners, [[0.0, 0.0, -0.36]])
    assert [s.partition(" (")[0] for s in shown.placeless[:3]] == ["column", "cutter", "normal"]
    assert "tool y is normal.tip, which has no place in space." in shown.placeless
    # The tool is drawn at its holder, but moves as the tip does.
    tool = piece(shown, "tool x: cutter.tip")
    machine = read_machine(LIBRARY / "guide_mill.toml")
    shape = np.eye(len(machine.dofs))[machine.dofs.index("cutter.tip")]
    motion = shown.displaced(tool.corners, tool.frame, shown.moves(shape[:, None])[0])
    np.testing.assert_array_equal(motion, np.tile([1.0, 0.0, 0.0], (len(motion), 1)))


def test_a_machine_without_places_is_refused() -> None:
    with pytest.raises(InputError, match=r"two_mass\.toml: no part has a place in space, expected a rigid body"):
        scene(read_machine(LIBRARY / "two_mass.toml"))


def test_gravity_points_down() -> None:
    assert [list(scene(read_machine(LIBRARY / f"{n}.toml")).up) for n in ("lathe", "column_mill_b")] == [
        [0, 1, 0],
        [0, 0, 1],
    ]


@pytest.fixture(scope="module")
def still(drawn: Scene) -> str:
    return picture(drawn)


def test_the_still_picture_names_every_part(still: str, mill: Machine) -> None:
    tree = ElementTree.fromstring(still)
    words = {"".join(element.itertext()) for element in tree.iter("{http://www.w3.org/2000/svg}text")}
    assert {c.name for c in mill.components} | {"tool x", "axis z", "seen along +y", "seen along −z"} <= words
    numbers = [float(x) for x in re.findall(r"points='([-\d.]+),", still)]
    assert min(numbers) >= 0
    assert max(numbers) <= 1180


def test_the_same_machine_has_the_same_picture() -> None:
    machine = read_machine(LIBRARY / "carriage.toml")
    assert picture(scene(machine)) == picture(scene(machine))


def test_the_scale_bar_is_true(still: str) -> None:
    start, end = re.search(r"M20,\d+ V\d+ H([\d.]+)", still), re.search(r">([\d.]+) m<", still)
    assert start is not None
    assert end is not None
    per_metre = (float(start[1]) - 20) / float(end[1])
    # From the side the bed is 1.9 m wide and is the widest block; it was drawn before the words beneath it.
    aside = still[still.index("seen along +y") : still.index("seen along −x")]
    bed = re.findall(r"<polygon points='([^']*)' fill='#4477aa'", aside)
    wide = max(np.ptp([float(p.split(",")[0]) for p in points.split()]) for points in bed)
    assert wide == pytest.approx(1.9 * per_metre, rel=3e-3)


def test_the_page_needs_nothing_else(drawn: Scene) -> None:
    text = page(drawn)
    assert not re.findall(r"(?:src|href)\s*=|https?://|import\s*\(|fetch\(", text)
    assert len(text) < 400_000
    shown: dict[str, Any] = json.loads(json.dumps(data(drawn)))
    assert len(shown["pieces"]) == len(drawn.pieces)
    corners = np.array(shown["pieces"][0]["points"]).reshape(-1, 4)
    np.testing.assert_allclose(corners[:, 1:], drawn.pieces[0].corners, atol=5e-6)


def test_names_of_a_machine_are_words_and_no_markup() -> None:
    odd = scene(replace(read_machine(LIBRARY / "carriage.toml"), name="</script><b>&"))
    assert "</script><b>" not in page(odd)
    assert ElementTree.fromstring(picture(odd)).attrib["aria-label"] == "</script><b>&"
