"""The beam against closed forms: its statics, its modes, its damping and where its stations lie."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import brentq

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.laws.linear import Linear
from machines import Connection, Machine, read_machine
from machines.components.beam import Beam, Segment
from machines.coupling.second_order import machine_equations
from machines.shapes.beam_mesh import FIELDS, beam_mesh, shortest_wave
from machines.shapes.profile import Material, rectangle, tube

STEEL = Material("steel", 210e9, 0.3, 7800.0)
D, L = 0.05, 0.5
ROUND = tube(D, 0.0, 0.3)


def bar(diameter: float = D, length: float = L, up_to: float = 10e3, material: Material = STEEL) -> Beam:
    segment = Segment(length, material, diameter=diameter)
    return Beam("bar", (segment,), {"root": 0.0, "tip": length}, up_to=up_to)


def held(*names: str) -> tuple[Connection, ...]:
    return tuple(Connection(name, (f"bar.{name}", "ground"), rigid=True) for name in names)


def clamped(beam: Beam) -> Machine:
    return Machine((beam,), held(*(f"root.{d}" for d in ("x", "y", "z", "rx", "ry", "rz"))))


def frequencies(machine: Machine) -> Array:
    return machine_equations(machine).natural_frequencies(np.empty(0))


def test_slender_beam_has_the_frequencies_of_euler_and_bernoulli() -> None:
    """Shear and rotary inertia lower a mode by a share that goes with (d/L)²; at d/L = 1/1000 it is below 3e-5."""
    d, length = 1e-3, 1.0
    scale = np.sqrt(210e9 * np.pi * d**4 / 64 / (7800.0 * np.pi * d**2 / 4)) / (2 * np.pi * length**2)
    free = [brentq(lambda x: np.cos(x) * np.cosh(x) - 1, a, b) for a, b in ((4.5, 5), (7.5, 8), (10.5, 11.5))]
    fixed = [brentq(lambda x: np.cos(x) * np.cosh(x) + 1, a, b) for a, b in ((1.5, 2), (4.5, 5), (7.5, 8))]
    beam = bar(d, length, up_to=60.0)
    for found, roots in ((frequencies(Machine((beam,)))[6::2], free), (frequencies(clamped(beam))[::2], fixed)):
        expected = scale * np.array(roots) ** 2
        assert found[:3] == pytest.approx(expected, rel=3e-5)
        assert np.all(found[:3] < expected)


def test_free_beam_has_six_motions_without_strain() -> None:
    """The threshold is what rounding leaves of the largest stiffness."""
    found = frequencies(Machine((bar(),)))
    assert np.all(found[:6] == 0)
    assert found[6] > 100


def timoshenko(n: int) -> tuple[float, float]:
    """Both frequencies in Hz of wave number nπ/L: (κGAk² − ρAω²)(EIk² + κGA − ρIω²) = (κGAk)²."""
    k, A, second = n * np.pi / L, ROUND.area, ROUND.second_2
    S, B, m, j = ROUND.shear_2 * STEEL.shear * A, STEEL.young * second, STEEL.density * A, STEEL.density * second
    squared = np.roots([m * j, -(S * k**2 * j + m * (B * k**2 + S)), S * k**2 * B * k**2])
    low, high = np.sqrt(np.sort(squared)) / (2 * np.pi)
    return float(low), float(high)


def test_simply_supported_beam_has_the_frequencies_of_timoshenko() -> None:
    machine = Machine((bar(),), held("root.x", "root.y", "root.z", "root.rx", "tip.y", "tip.z"))
    found = frequencies(machine)
    for n in (1, 2, 3):
        near = found[np.abs(found / timoshenko(n)[0] - 1) < 1e-3]
        assert len(near) == 2  # one in each plane
        assert near == pytest.approx(timoshenko(n)[0], rel=1e-7)


@pytest.mark.parametrize(("degree", "coarse"), [(2, 12), (3, 8), (4, 4)])
def test_frequency_error_falls_with_twice_the_degree_of_the_elements(degree: int, coarse: int) -> None:
    """Elements with C⁰ fields of degree p: the error of an eigenvalue goes as h^2p (Strang, Fix 1973)."""
    errors = []
    for pieces in (coarse, 2 * coarse):
        ends = np.linspace(0, L, pieces + 1)[1:]
        mesh = beam_mesh(ends, [ROUND] * pieces, [STEEL] * pieces, np.array([0.0, L]), 1.0, degree)
        size = len(mesh.mass)
        ends_of = {0: (0, 1, 2, 3), pieces: (1, 2)}
        out = [FIELDS * v + f for v, fields in ends_of.items() for f in fields]
        kept = np.setdiff1d(np.arange(size), out)
        squared = eigh(mesh.stiffness[0][np.ix_(kept, kept)], mesh.mass[np.ix_(kept, kept)], eigvals_only=True)
        found = np.sqrt(squared) / (2 * np.pi)
        exact = timoshenko(3)[0]
        errors.append(np.min(np.abs(found - exact)) / exact)
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2 * degree, abs=0.4)


def tip_compliance(beam: Beam) -> Array:
    """Static compliance of the second station with the first one held, by multipliers."""
    model = beam.second_order()
    held, tip = model.shapes[:6], model.shapes[6:12]
    system = np.block([[model.stiffness, held.T], [held, np.zeros((6, 6))]])
    moved = np.linalg.solve(system, np.concatenate([tip.T, np.zeros((6, 6))]))[: len(model.mass)]
    return np.asarray(tip @ moved)


def test_static_tip_compliance_is_that_of_bending_and_shear() -> None:
    compliance = tip_compliance(bar())
    EI, shear = STEEL.young * ROUND.second_2, ROUND.shear_2 * STEEL.shear * ROUND.area
    assert compliance[0, 0] == pytest.approx(L / (STEEL.young * ROUND.area), rel=1e-10)
    assert compliance[1, 1] == pytest.approx(L**3 / (3 * EI) + L / shear, rel=1e-10)
    assert compliance[2, 2] == pytest.approx(L**3 / (3 * EI) + L / shear, rel=1e-10)
    assert compliance[3, 3] == pytest.approx(L / (STEEL.shear * ROUND.torsion), rel=1e-10)
    # A force along y turns the tip by +L²/2EI about z, one along z by −L²/2EI about y.
    assert compliance[5, 1] == pytest.approx(L**2 / (2 * EI), rel=1e-10)
    assert compliance[4, 2] == pytest.approx(-(L**2) / (2 * EI), rel=1e-10)


def test_stepped_beam_has_the_compliance_of_castigliano() -> None:
    thick, thin = Segment(0.2, STEEL, diameter=0.06, bore=0.02), Segment(0.3, STEEL, width=0.03, height=0.02)
    beam = Beam("bar", (thick, thin), {"root": 0.0, "tip": 0.5}, up=np.array([0.0, 0.0, 1.0]))
    compliance = tip_compliance(beam)
    expected = 0.0
    for segment, a, b in ((thick, 0.5, 0.3), (thin, 0.3, 0.0)):
        p = segment.profile
        expected += (a**3 - b**3) / (3 * STEEL.young * p.second_2) + (a - b) / (p.shear_3 * STEEL.shear * p.area)
    assert compliance[2, 2] == pytest.approx(expected, rel=1e-10)


def test_mass_is_that_of_the_material() -> None:
    """Far below the first resonance a force moves the free beam as a rigid body: the accelerance sums to 1/m."""
    omega = np.array([2 * np.pi * 1e-3])
    middle = np.zeros((3, 12))
    for axis in range(3):
        middle[axis, [axis, 6 + axis]] = 0.5
    H = bar().receptance(omega, middle)[0]
    assert -np.diag(H).real * omega**2 == pytest.approx(1 / (7800.0 * ROUND.area * L), rel=1e-8)


def test_turned_beam_answers_like_the_straight_one_seen_from_turned_axes() -> None:
    rng = np.random.default_rng(4)
    R = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    R *= np.sign(np.linalg.det(R))
    segment = Segment(0.4, STEEL, width=0.04, height=0.02)
    parts = [Beam("b", (segment,), {"a": 0.0, "b": 0.4}, axis=Q[:, 0], up=Q[:, 2]) for Q in (np.eye(3), R)]
    omega = 2 * np.pi * np.array([100.0, 900.0, 3000.0])
    straight, turned = (p.receptance(omega) for p in parts)
    T = np.kron(np.eye(4), R)
    assert np.linalg.norm(turned - T @ straight @ T.T) < 1e-9 * np.linalg.norm(turned)


def test_height_is_the_stiff_direction() -> None:
    beam = Beam("b", (Segment(0.4, STEEL, width=0.01, height=0.04),), {"a": 0.0, "b": 0.4}, up=np.array([0, 1.0, 0]))
    C = tip_compliance(beam)
    assert C[2, 2] / C[1, 1] == pytest.approx(16.0, rel=0.02)


def test_loss_factor_damps_every_mode_by_half_of_it_and_a_viscous_material_by_its_frequency() -> None:
    for material, ratio in (
        (Material("s", 210e9, 0.3, 7800.0, loss_factor=0.02), lambda w: 0.01 + 0 * w),
        (Material("s", 210e9, 0.3, 7800.0, viscous=1e-7), lambda w: 1e-7 * w / 2),
    ):
        model = bar(material=material).second_order()
        squared, shapes = eigh(model.stiffness, model.mass)
        omega = np.sqrt(squared[6:20])
        damping = np.diag(shapes.T @ model.damping @ shapes)[6:20]
        assert damping / (2 * omega) == pytest.approx(ratio(omega), rel=1e-6)
        assert np.linalg.eigvalsh(model.damping)[0] > -1e-9 * np.linalg.norm(model.damping)


def test_reduction_says_its_error_and_keeps_it() -> None:
    """The first elastic frequency of the reduced beam against a mesh twice as fine that is not reduced."""
    assert "reduction error at most" in bar().remarks()[0]
    mesh = beam_mesh(np.array([L]), [ROUND], [STEEL], np.array([0.0, L]), 30e3)
    fine = np.sqrt(np.abs(eigh(mesh.stiffness[0], mesh.mass, eigvals_only=True))) / (2 * np.pi)
    inside = (fine > 10) & (fine < 10e3)
    found = frequencies(Machine((bar(),)))[6 : 6 + inside.sum()]
    assert found == pytest.approx(fine[inside], rel=3e-7)


def test_torsion_constant_of_a_square_is_the_tabulated_one() -> None:
    """0.1406 a⁴ (Timoshenko, Goodier, Theory of Elasticity, section 109)."""
    assert rectangle(0.02, 0.02, 0.3).torsion == pytest.approx(0.140577 * 0.02**4, rel=1e-5)
    assert rectangle(1.0, 0.01, 0.3).torsion == pytest.approx(1e-6 / 3 * (1 - 0.63 * 0.01), rel=1e-4)


def test_wave_number_solves_the_dispersion_equation() -> None:
    omega = 2 * np.pi * timoshenko(3)[0]
    assert shortest_wave(ROUND, STEEL, omega) == pytest.approx(3 * np.pi / L, rel=1e-9)


def test_connection_at_a_station_acts_on_the_station() -> None:
    beam = Beam(
        "b",
        (Segment(0.4, STEEL, diameter=0.03),),
        {"a": 0.1, "b": 0.4},
        np.array([1.0, 2.0, 3.0]),
        np.array([0, 0, -2.0]),
    )
    spring = Joint((Linear(1e6),))
    link = Connection("c", ("b", "ground"), spring, at=(1.0, 2.0, 2.6), direction=(0.0, 1.0, 1.0))
    row = link.row([beam])
    assert dict(zip(beam.dofs, row, strict=True))["b.y"] == pytest.approx(np.sqrt(0.5))
    assert dict(zip(beam.dofs, row, strict=True))["b.z"] == pytest.approx(np.sqrt(0.5))
    assert np.count_nonzero(np.abs(row) > 1e-12) == 2
    with pytest.raises(InputError, match=r"no node at .*nearest, 'b', lies 0.1 m away"):
        Connection("c", ("b", "ground"), spring, at=(1.0, 2.0, 2.5), direction=(0.0, 1.0, 0.0)).row([beam])


GOOD = """
schema = "jointlib/machine/1"
[[component]]
name = "spindle"
kind = "beam"
axis = [0, 0, 1]
start = ["10 mm", 0, 0]
up_to = "5 kHz"
[[component.material]]
name = "steel"
young = "210 GPa"
poisson = 0.3
density = 7800
loss_factor = 0.002
[[component.segment]]
length = "200 mm"
diameter = "60 mm"
bore = "20 mm"
material = "steel"
[[component.segment]]
length = "100 mm"
diameter = "40 mm"
[[component.station]]
name = "rear"
at = 0
[[component.station]]
name = "nose"
at = "300 mm"
[[connection]]
name = "bearing"
between = ["spindle", "ground"]
at = [0.01, 0, 0]
direction = [1, 0, 0]
joint = { law = [ { kind = "linear", stiffness = "100 N/um" } ] }
[tool]
x = "spindle.nose.x"
"""


def test_file_is_read(tmp_path: Path) -> None:
    path = tmp_path / "m.toml"
    path.write_text(GOOD)
    machine = read_machine(path)
    (beam,) = machine.components
    assert isinstance(beam, Beam)
    assert beam.dofs[6:9] == ("nose.x", "nose.y", "nose.z")
    assert beam.nodes.positions.tolist() == [[0.01, 0, 0], [0.01, 0, 0.3]]
    assert beam.segments[1].material.loss_factor == 0.002


BAD = [
    ('young = "210 GPa"', 'young = "210 N"', "young.*'N'"),
    ("poisson = 0.3", "poisson = 0.8", "poisson is 0.8"),
    ("density = 7800", "density = 0", "density is 0.0"),
    ('bore = "20 mm"', 'bore = "80 mm"', r"\[\[segment\]\] 1: bore is 0.08"),
    ('bore = "20 mm"', "boor = 0", "unknown key 'boor', did you mean 'bore'"),
    ('material = "steel"', 'material = "steal"', "did you mean 'steel'"),
    ('diameter = "40 mm"', 'width = "40 mm"', "expected one of diameter, of width and height"),
    ('length = "100 mm"', "length = 0", "length is 0.0"),
    ('at = "300 mm"', 'at = "310 mm"', "station 'nose' lies at 0.31 m, expected 0 to 0.3 m"),
    ('name = "nose"', 'name = "rear"', "'rear' is named twice"),
    ('at = "300 mm"', "at = 0", "lie at one place"),
    ("axis = [0, 0, 1]", "axis = [0, 0, 0]", "an axis not zero"),
    ("axis = [0, 0, 1]", "axis = [0, 0, 1]\nup = [0, 0, 1]", "across the axis"),
    ('diameter = "40 mm"', 'width = "40 mm"\nheight = "10 mm"', "up is missing"),
    ('up_to = "5 kHz"', "up_to = 0", "up_to is 0.0"),
    ('x = "spindle.nose.x"', 'x = "spindle.nose.u"', "did you mean 'spindle.nose"),
    ("at = [0.01, 0, 0]", "at = [0.02, 0, 0]", "nearest, 'rear', lies 0.01 m away"),
]


@pytest.mark.parametrize(("old", "new", "words"), BAD)
def test_what_is_wrong_is_said_in_one_sentence(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in GOOD
    path = tmp_path / "m.toml"
    path.write_text(GOOD.replace(old, new, 1))
    with pytest.raises(InputError, match=words) as caught:
        read_machine(path)
    text = str(caught.value)
    assert text.startswith(str(path))
    assert text.count(str(path)) == 1
    assert "\n" not in text


def test_all_points_without_a_node_in_one_sentence(tmp_path: Path) -> None:
    """Carriages on a beam that has no stations there: one sentence, with the places of those that it needs."""
    guide = """
[[bundle]]
name = "guide"
kind = "linear-guide"
between = ["carriage", "rail"]
at = [[0.3, 0, 0.1], [0.5, 0, 0.1]]
axes = [[1, 0, 0], [0, 0, 1]]
preload = "1 kN"
stiffness = "300 N/um"
width = "20 mm"
height = "6 mm"
length = "40 mm"
points = 1
"""
    carriage = """
[[component]]
name = "carriage"
kind = "rigid"
mass = 20
inertia = [1, 1, 1]
centre = [0.4, 0, 0.2]
"""
    beam = """schema = "jointlib/machine/1"
name = "rail"

[[component]]
name = "rail"
kind = "beam"
up = [0, 0, 1]
tolerance = "120 mm"

[[component.material]]
name = "steel"
young = "210 GPa"
poisson = 0.3
density = 7850

[[component.segment]]
length = "1 m"
width = "60 mm"
height = "80 mm"

[[component.station]]
name = "foot"
at = 0
"""
    file = tmp_path / "machine.toml"
    file.write_text(beam + carriage + guide, encoding="utf-8")
    with pytest.raises(InputError) as refused:
        read_machine(file)
    [said] = [each for each in refused.value.sentences if "no node" in each]
    assert "component 'rail': no node at 8 points of guide_1, guide_2" in said
    assert "expected a [[component.station]] at 0.3 m, 0.5 m" in said
