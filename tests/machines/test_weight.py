"""The weight of beams and matrices: closed forms, and the full matrices solved as they are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve
from test_matrices import dmig, lattice

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.laws.linear import Linear
from machines import Connection, Machine, Rigid, StaticLoad, read_machine, static_point
from machines.components.beam import Beam, Segment
from machines.components.matrices import Matrices
from machines.components.nodes import DIRECTIONS
from machines.shapes.profile import Material

G = 9.81
DOWN = StaticLoad((0.0, 0.0, -G))
STEEL = Material("steel", 210e9, 0.3, 7800.0)
LENGTH, DIAMETER = 1.2, 0.05
AREA, SECOND = np.pi * DIAMETER**2 / 4, np.pi * DIAMETER**4 / 64
PER_LENGTH = STEEL.density * AREA * G


def bar(axis: tuple[float, float, float], **stations: float) -> Beam:
    return Beam("bar", (Segment(LENGTH, STEEL, diameter=DIAMETER),), stations, axis=np.array(axis))


def clamped(beam: Beam, station: str) -> Machine:
    held = tuple(
        Connection(f"clamp {d}", (f"bar.{station}.{d}", "ground"), rigid=True)
        for d in ("x", "y", "z", "rx", "ry", "rz")
    )
    return Machine((beam,), held, static=DOWN)


def sag(beam: Beam, station: str) -> Array:
    """x, y, z of a station under the weight of the beam, clamped at its foot."""
    machine = clamped(beam, "foot")
    return static_point(machine).dofs[[machine.dofs.index(f"bar.{station}.{d}") for d in "xyz"]]


@pytest.mark.parametrize("slope", [0.0, 35.0, 90.0])
def test_a_clamped_beam_sags_under_its_own_weight_as_the_closed_form_says(slope: float) -> None:
    cos, sin = np.cos(np.radians(slope)), np.sin(np.radians(slope))
    moved = sag(bar((cos, 0.0, sin), foot=0.0, tip=LENGTH), "tip")
    # q cos across: q L^4/8EI + q L²/2κGA, Cowper's κ of a round bar; q sin along: q L²/2EA.
    kappa = 6 * 1.3 / (7 + 6 * 0.3)
    shear = STEEL.young / 2.6 * AREA * kappa
    across = -PER_LENGTH * cos * (LENGTH**4 / (8 * STEEL.young * SECOND) + LENGTH**2 / (2 * shear))
    along = -PER_LENGTH * sin * LENGTH**2 / (2 * STEEL.young * AREA)
    expected = [cos * along - sin * across, 0.0, sin * along + cos * across]
    np.testing.assert_allclose(moved, expected, rtol=1e-9, atol=1e-9 * np.max(np.abs(expected)))


def test_the_weight_between_stations_bends_the_beam_at_them() -> None:
    """Deflection of a cantilever under its weight at a third of its length, and the slope there."""
    machine = clamped(bar((1, 0, 0), foot=0.0, third=LENGTH / 3, tip=LENGTH), "foot")
    dofs = dict(zip(machine.dofs, static_point(machine).dofs, strict=True))
    x, EI = LENGTH / 3, STEEL.young * SECOND
    slope = PER_LENGTH * x * (3 * LENGTH**2 - 3 * LENGTH * x + x**2) / (6 * EI)
    assert dofs["bar.third.ry"] == pytest.approx(slope, rel=1e-9)


def test_a_beam_on_two_springs_shares_its_weight_as_a_lever_does() -> None:
    at = {"left": 0.25 * LENGTH, "right": 0.9 * LENGTH}
    part = bar((1, 0, 0), **at)
    spring = Joint((Linear(1e7),))
    across = [Connection(f"{s} {d}", (f"bar.{s}.{d}", "ground"), spring) for s in at for d in "yz"]
    along = Connection("along", ("bar.left.x", "ground"), spring)
    turn = Connection("turn", ("bar.left.rx", "ground"), spring)
    point = static_point(Machine((part,), (*across, along, turn), static=DOWN))
    weight = PER_LENGTH * LENGTH
    share = (0.5 - 0.25) / (0.9 - 0.25)
    assert point.of("right z")[1] == pytest.approx(-weight * share, rel=1e-9)
    assert point.of("left z")[1] == pytest.approx(-weight * (1 - share), rel=1e-9)
    assert point.of("left y")[1] == pytest.approx(0.0, abs=1e-9 * weight)


@pytest.mark.parametrize("size", [(3, 3, 3), (8, 5, 4)])
def test_named_rows_of_a_grounded_model_sag_as_the_full_matrices_do(size: tuple[int, int, int]) -> None:
    M, K, _ = lattice(*size)
    n = M.shape[0]
    rows = (n - 1, n - 3, n // 2)
    part = Matrices("bed", ("a.z", "a.x", "b.p"), rows, M, K, up_to=1000.0, axes=(0, 1, 2) * (n // 3))
    full = spsolve(K, M @ (np.arange(n) % 3 == 2) * -G)
    sag = static_point(Machine((part,), static=DOWN)).dofs
    np.testing.assert_allclose(sag, full[list(rows)], rtol=0, atol=1e-9 * np.max(np.abs(full)))


@pytest.mark.parametrize("size", [(3, 3, 3), (8, 5, 4)])
def test_a_free_model_carries_its_weight_to_the_springs_under_it(size: tuple[int, int, int]) -> None:
    M, K, places = lattice(*size, grounded=False)
    n, (a, b, c) = len(places), (int(np.ravel_multi_index(p, size)) for p in ((0, 0, 0), (2, 0, 0), (0, 2, 0)))
    names = [f"{word}.{d}" for word in "abc" for d in "xyz"]
    rows = tuple(3 * node + axis for node in (a, b, c) for axis in range(3))
    part = Matrices("block", tuple(names), rows, M, K, up_to=1000.0)
    springs = tuple(Connection(name, (f"block.{name}", "ground"), Joint((Linear(4e7),))) for name in names)
    point = static_point(Machine((part,), springs, static=DOWN))
    weight = 0.2 * n * G
    assert sum(point.of(f"{word}.z")[1] for word in "abc") == pytest.approx(-weight, rel=1e-7)
    ground = np.zeros(3 * n)
    ground[list(rows)] = 4e7
    full = np.linalg.solve(K.toarray() + np.diag(ground), M @ (np.arange(3 * n) % 3 == 2) * -G)
    np.testing.assert_allclose(point.dofs, full[list(rows)], rtol=0, atol=1e-7 * np.max(np.abs(full)))


def test_tonnes_and_millimetres_weigh_what_kilograms_and_metres_do() -> None:
    """A bar from beam elements: three named nodes with rotations, in both units."""
    from machines.shapes.beam_mesh import element
    from machines.shapes.profile import tube

    M, K = element(tube(DIAMETER, 0.0, 0.3), STEEL, LENGTH, 3)
    scale = np.where(np.arange(len(M)) % 6 < 3, 1.0, 1e3)  # 1 m = 1000 mm, rotations alike: x_m = x_mm/1000
    names = tuple(f"{end}.{d}" for end in "ab" for d in DIRECTIONS)
    rows = tuple(range(12))
    gravity = np.array([1.0, -2.0, -G])
    metres = Matrices("bar", names, rows, M, K).weight(gravity)
    # Energies in N mm: K_mm = 1000 Sᵀ K S with x_m = S x_mm; masses in t so that t mm²/s² is N mm as well.
    S = np.diag(scale / 1e3)
    millimetres = Matrices("bar", names, rows, 1e3 * S @ M @ S, 1e3 * S @ K @ S, units="mm").weight(gravity)
    np.testing.assert_allclose(millimetres, metres, rtol=1e-9, atol=1e-9 * np.max(np.abs(metres)))
    half = STEEL.density * AREA * LENGTH / 2
    np.testing.assert_allclose(metres[:3], half * gravity, rtol=1e-9)
    # The fixed-end moment of a distributed load.
    assert metres[4] == pytest.approx(half * G * LENGTH / 6, rel=1e-2)


def test_a_punch_file_names_the_directions_of_a_grounded_part(tmp_path: Path) -> None:
    M, K, _ = lattice(3, 2, 2)
    own = np.arange(36).reshape(12, 3)
    order = own[[0, 11]].ravel()  # the writer takes two grid points of three components
    inner = np.setdiff1d(np.arange(36), order)
    T = np.zeros((36, 6))
    T[order] = np.eye(6)
    T[inner] = -np.linalg.solve(K.toarray()[np.ix_(inner, inner)], K.toarray()[np.ix_(inner, order)])
    m, k = T.T @ M @ T, T.T @ K @ T
    (tmp_path / "k.pch").write_text(dmig(k, "KAAX", "long") + dmig(m, "MAAX", "long"))
    (tmp_path / "m.toml").write_text(
        'schema = "jointlib/machine/1"\n[[component]]\nname = "bed"\nkind = "matrices"\n'
        'mass = { file = "k.pch", name = "MAAX" }\nstiffness = { file = "k.pch", name = "KAAX" }\n'
        '[[component.node]]\nname = "a"\ngrid = 101\n[static]\ngravity = [0, 0, -9.81]\n'
    )
    machine = read_machine(tmp_path / "m.toml")
    full = np.linalg.solve(k, m @ (np.arange(6) % 3 == 2) * -G)
    np.testing.assert_allclose(static_point(machine).dofs, full[:3], rtol=0, atol=1e-7 * np.max(np.abs(full)))


def test_a_weight_that_cannot_be_told_is_refused_in_a_sentence() -> None:
    M, K, _ = lattice(3, 3, 3)
    tied = Matrices("bed", ("a.x", "a.y", "a.z"), (78, 79, 80), M, K)
    with pytest.raises(InputError, match=r"ties it to the ground .* its weight is not known; leave gravity out"):
        static_point(Machine((tied,), static=DOWN))
    loose = Matrices("bed", ("a.x", "a.y", "a.z"), (78, 79, 80), M, lattice(3, 3, 3, grounded=False)[1])
    with pytest.raises(InputError, match=r"with its named rows held it can still move, .* name more rows"):
        static_point(Machine((loose,), static=DOWN))


def test_points_of_a_rigid_body_move_as_the_body_does_there() -> None:
    at, centre = np.array([0.3, -0.1, 0.4]), np.array([0.1, 0.0, 0.2])
    body = Rigid("table", 12.0, np.array([0.5, 0.7, 0.9]), centre, points={"cut": at})
    assert body.dofs[6:] == ("cut.x", "cut.y", "cut.z")
    omega = np.array([50.0, 900.0])
    H = body.receptance(omega)
    for axis in range(3):
        row = body.motion_at(at, np.eye(3)[axis])
        np.testing.assert_allclose(H[:, 6 + axis], np.einsum("i,fij->fj", row, H), rtol=1e-12, atol=1e-18)
    # Force at the point, motion there: 1/m and the lever arms over the inertia.
    rho = at - centre
    mobility = 1 / 12 + rho[1] ** 2 / 0.9 + rho[2] ** 2 / 0.7
    np.testing.assert_allclose(H[:, 6, 6], -mobility / omega**2, rtol=1e-12)
    np.testing.assert_allclose(body.weight(np.array([0, 0, -G])), [0, 0, -12 * G, 0, 0, 0, 0, 0, 0])
