"""Sections of beams against other routes: shear flow, Prandtl's stress function, one section given in two ways."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import spsolve

from jointlib.errors import InputError
from machines import Connection, Machine, read_machine
from machines.components.beam import Beam, Segment
from machines.coupling.second_order import machine_equations
from machines.shapes.profile import Material, box, rectangle

STEEL = Material("steel", 210e9, 0.3, 7800.0)


def jourawski(width: float, height: float, wall: float) -> float:
    """κ of a thin-walled box for a force along its height: 1/κ = A ∮ q² ds/t for V = 1, q = Q t/I (ν = 0)."""
    b, h = width - wall, height - wall
    second = 2 * wall * h**3 / 12 + 2 * b * wall * h**2 / 4
    s, y = np.linspace(0, b / 2, 20001), np.linspace(-h / 2, h / 2, 20001)
    flange = wall * h / 2 * s / second
    web = wall * (h * b / 4 + (h**2 / 4 - y**2) / 2) / second
    energy = 4 * np.trapezoid(flange**2, s) + 2 * np.trapezoid(web**2, y)
    return float(wall / (2 * wall * (b + h) * energy))


def prandtl(width: float, height: float, wall: float, cells: int) -> float:
    """J = 2 ∫ φ dA, ∇²φ = −2, φ = 0 outside and constant in the hole, by finite differences."""
    d = wall / cells
    nx, ny = round(width / d), round(height / d)
    hole = np.zeros((nx + 1, ny + 1), dtype=bool)
    hole[cells : nx - cells + 1, cells : ny - cells + 1] = True
    inside = np.zeros_like(hole)
    inside[1:nx, 1:ny] = True
    solid = inside & ~hole
    number = np.full(hole.shape, -1)
    number[solid] = np.arange(solid.sum())
    number[hole] = c = int(solid.sum())
    source = np.full(c + 1, 2 * d**2)
    area = (width - 2 * wall + d) * (height - 2 * wall + d)
    source[c] = 2 * area
    i, j = np.nonzero(solid)
    entries: list[tuple[int, int, float]] = []
    for di, dj in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        for own, other in zip(number[i, j], number[i + di, j + dj], strict=True):
            entries.append((own, own, 1.0))
            if other >= 0:
                entries.append((own, other, -1.0))
            if other == c:
                entries += [(c, c, 1.0), (c, own, -1.0)]
    rows, columns, values = zip(*entries, strict=True)
    phi = spsolve(csc_matrix((values, (rows, columns)), shape=(c + 1, c + 1)), source)
    return float(2 * (phi[:c].sum() * d**2 + phi[c] * area))


@pytest.mark.parametrize(("width", "height"), [(0.5, 0.5), (0.6, 0.3), (0.3, 0.6)])
def test_shear_of_a_box_is_that_of_the_shear_flow_round_it(width: float, height: float) -> None:
    """Without lateral contraction Cowper's κ is that of the energy of Jourawski's shear flow."""
    section = box(width, height, 0.01, 0.0)
    assert section.shear_3 == pytest.approx(jourawski(width, height, 0.01), rel=1e-6)
    assert section.shear_2 == pytest.approx(jourawski(height, width, 0.01), rel=1e-6)


def test_torsion_of_a_box_is_that_of_the_stress_function_but_for_its_sharp_corners() -> None:
    for (width, height, wall), most in (((1.0, 1.0, 0.05), 0.025), ((0.5, 0.4, 0.08), 0.07)):
        coarse, fine = (prandtl(width, height, wall, cells) for cells in (3, 6))
        found = box(width, height, wall, 0.3).torsion / (fine + (fine - coarse))
        assert 1 - most < found < 1


def test_a_box_is_one_block_less_another_and_a_solid_one_where_its_walls_meet() -> None:
    section, outer, inner = box(0.4, 0.6, 0.05, 0.3), rectangle(0.4, 0.6, 0.3), rectangle(0.3, 0.5, 0.3)
    for key in ("area", "second_2", "second_3"):
        assert getattr(section, key) == pytest.approx(getattr(outer, key) - getattr(inner, key))


def clamped(segment: Segment, up: tuple[float, float, float] = (0, 0, 1)) -> Machine:
    beam = Beam("bar", (segment,), {"root": 0.0, "tip": 1.0}, up=np.array(up), up_to=500.0)
    fast = [Connection(d, (f"bar.root.{d}", "ground"), rigid=True) for d in ("x", "y", "z", "rx", "ry", "rz")]
    return Machine((beam,), tuple(fast))


def test_the_constants_of_a_section_make_the_beam_that_its_shape_makes() -> None:
    shape = Segment(1.0, STEEL, width=0.1, height=0.16, wall=0.01)
    p = shape.profile
    constants = Segment(
        1.0,
        STEEL,
        area=p.area,
        second_moments=(p.second_2, p.second_3),
        torsion=p.torsion,
        shear_factors=(p.shear_3, p.shear_2),
    )
    for up in ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0)):
        one, other = (machine_equations(clamped(s, up)).natural_frequencies(np.empty(0)) for s in (shape, constants))
        np.testing.assert_allclose(one[:8], other[:8], rtol=1e-9)


def test_a_box_column_bends_less_across_its_height_by_the_ratio_of_its_second_moments() -> None:
    """δ = F L³/3EI + F L/κGA at the tip, in both planes."""
    machine = clamped(Segment(1.0, STEEL, width=0.1, height=0.16, wall=0.01))
    model = machine_equations(machine)
    p = box(0.1, 0.16, 0.01, 0.3)
    for dof, second, kappa in (("z", p.second_2, p.shear_3), ("y", p.second_3, p.shear_2)):
        row = (machine.dof_rows([f"bar.tip.{dof}"], "tip") @ model.shapes)[0]
        expected = 1 / (3 * STEEL.young * second) + 1 / (kappa * STEEL.shear * p.area)
        assert row @ np.linalg.solve(model.stiffness, row) == pytest.approx(expected, rel=1e-8)


FILE = """
schema = "jointlib/machine/1"
[[component]]
name = "column"
kind = "beam"
up = [0, 1, 0]
[[component.material]]
name = "iron"
young = "115 GPa"
poisson = 0.26
density = 7200
[[component.segment]]
length = "800 mm"
{segment}
[[component.station]]
name = "top"
at = "end"
"""


def read(folder: Path, segment: str) -> Machine:
    (folder / "m.toml").write_text(FILE.format(segment=segment))
    return read_machine(folder / "m.toml")


def test_a_file_gives_a_section_by_shape_or_by_constants_and_hears_what_was_assumed(tmp_path: Path) -> None:
    column = read(tmp_path, 'width = "500 mm"\nheight = "600 mm"\nwall = "25 mm"').components[0]
    assert isinstance(column, Beam)
    assert column.segments[0].profile == box(0.5, 0.6, 0.025, 0.26)
    constants = 'area = "525 cm^2"\nsecond_moments = ["2.5e5 cm^4", "1.9e5 cm^4"]\ntorsion = "3.3e5 cm^4"'
    column = read(tmp_path, constants).components[0]
    assert isinstance(column, Beam)
    assert column.segments[0].profile.second_2 == pytest.approx(2.5e-3)
    assert "assumed shear_factors" in " ".join(column.remarks())


@pytest.mark.parametrize(
    ("segment", "words"),
    [
        ('diameter = "1 m"\nwall = "1 cm"', "wall"),
        ('width = "10 cm"\nheight = "20 cm"\nwall = "6 cm"', "less than half of width and of height"),
        ('width = "10 cm"\nheight = "20 cm"\nbore = "6 cm"', "a box has a wall"),
        ('area = "10 cm^2"\ntorsion = "1 cm^4"', "expected one of diameter, of width and height, or of area"),
        ('area = "10 cm^2"\nsecond_moments = ["10 cm^4", "10 cm^4"]\ntorsion = "30 cm^4"', "the polar moment"),
        ('area = "12 cm^2"\nsecond_moments = ["10 cm^4", "10 cm^4"]\ntorsion = "2 cm^4"', "which a full circle has"),
        (
            'area = "10 cm^2"\nsecond_moments = ["1 cm^4", "1 cm^4"]\ntorsion = "2 cm^4"\nshear_factors = [1.2, 1]',
            "at most 1",
        ),
    ],
)
def test_a_section_that_cannot_be_is_refused_with_what_is_wrong(tmp_path: Path, segment: str, words: str) -> None:
    with pytest.raises(InputError, match="segment") as refused:
        read(tmp_path, segment)
    assert words in str(refused.value)


def test_a_circle_by_constants_that_a_table_rounds_is_taken(tmp_path: Path) -> None:
    circle = 'area = "7.86 cm^2"\nsecond_moments = ["4.90 cm^4", "4.90 cm^4"]\ntorsion = "9.8 cm^4"'
    assert isinstance(read(tmp_path, circle).components[0], Beam)


def test_a_beam_that_its_units_make_endless_is_refused_with_what_it_is_made_of(tmp_path: Path) -> None:
    soft = read(tmp_path, 'width = "500 mm"\nheight = "600 mm"\nwall = "25 mm"').components[0]
    assert isinstance(soft, Beam)
    material = replace(soft.segments[0].material, young=0.21e9)
    segments = tuple(replace(segment, material=material) for segment in soft.segments)
    with pytest.raises(InputError, match=r"young 0.21 GPa, density .*bends as [67].. x [67].. mm"):
        replace(soft, segments=segments, up_to=4e4).second_order()
