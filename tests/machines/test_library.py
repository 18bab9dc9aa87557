"""The shipped machine tools: loads and stiffnesses by hand, modes from matrices assembled here."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh

import machines
from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.motion import Motion
from machines import Machine, StaticLoad, frozen_receptance, read_machine, static_point
from machines.coupling.second_order import machine_equations
from machines.statics.statics import StaticPoint

LIBRARY = Path(machines.__file__).parent / "library"
FILES = sorted(p for p in LIBRARY.glob("*.toml") if 'schema = "jointlib/machine/1"' in p.read_text(encoding="utf-8"))
COLUMNS = ["column_mill_a", "column_mill_b"]
G = 9.80665
SHAFT = 206e9 * np.pi * 0.034**2 / 4
"""E A of a 40 mm screw, N."""


@cache
def machine_of(name: str) -> Machine:
    return read_machine(LIBRARY / f"{name}.toml")


@cache
def loaded(name: str) -> StaticPoint:
    return static_point(machine_of(name))


def ring(outer: float, inner: float, length: float, density: float) -> float:
    """Mass of a tube in kg."""
    return float(density * np.pi * (outer**2 - inner**2) / 4 * length)


CUTTER = ring(0.063, 0, 0.027, 7850) + ring(0.05, 0, 0.043, 7850) + ring(0.028, 0, 0.06, 7850)
SPINDLE = ring(0.128, 0.042, 0.055, 7850) + ring(0.082, 0.032, 0.365, 7850) + ring(0.1, 0.032, 0.12, 7850)
COLUMN = ring(0.53, 0.48, 1.46, 7200)


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.stem)
def test_every_shipped_machine_is_joined_together(path: Path) -> None:
    machine = read_machine(path)
    assert not [said for said in machine.remarks() if "take no part" in said or "takes no part" in said]
    assert not [said for said in machine.remarks() if "no joint" in said]
    assert machine.tool or machine.drive


@pytest.mark.parametrize("name", COLUMNS)
def test_the_mounts_carry_the_weight_of_a_column_mill_and_its_z_screw_that_of_the_headstock(name: str) -> None:
    point = loaded(name)
    weight = G * (2000 + 320 + 260 + 280 + COLUMN + SPINDLE + CUTTER)
    assert sum(point.of(f"mount_{i}.z")[1] for i in range(1, 5)) == pytest.approx(-weight, rel=1e-8)
    assert point.of("z_screw.axial")[1] == pytest.approx(-G * (320 + SPINDLE + CUTTER), rel=1e-8)
    assert point.of("mount_1.z")[0] == pytest.approx(-weight / (4 * 300e6), rel=0.3)
    # Nut in series with a shaft that is held both ways over 0.35 m, each with its bearing.
    screw = 1 / (1 / 700e6 + 0.5 * (0.35 / SHAFT + 1 / 900e6))
    assert point.of("z_screw.axial")[0] == pytest.approx(-G * (320 + SPINDLE + CUTTER) / screw, rel=1e-8)
    assert point.warnings == ()


@pytest.mark.parametrize("name", COLUMNS)
def test_the_table_sinks_into_its_four_carriages_as_their_rigidity_says(name: str) -> None:
    dofs = dict(zip(machine_of(name).dofs, loaded(name).dofs, strict=True))
    below = "saddle" if name == "column_mill_a" else "bed"
    rho = np.array([0.0, 0.0, 0.8]) - {"saddle": [0.0, 0.0, 0.68], "bed": [0.0, 0.3, 0.35]}[below]
    turned = [dofs[f"{below}.{d}"] for d in ("rx", "ry", "rz")]
    carried = dofs[f"{below}.uz"] + np.cross(turned, rho)[2]
    # 700 N/um each at rest; a sixth of the preload bends the Hertz contacts by less than 1 %.
    assert dofs["table.uz"] - carried == pytest.approx(-260 * G / (4 * 700e6), rel=0.01)


def test_the_travelling_column_yields_more_in_x_by_its_yaw_on_the_saddle_and_no_more_in_y() -> None:
    x, y = np.diagonal(
        np.array([frozen_receptance(machine_of(name), [0.5], 0.0).receptance[0].real for name in COLUMNS]),
        axis1=1,
        axis2=2,
    ).T
    # A force in x acts 0.62 m before the saddle, whose carriages of 1000 N/um stand 0.25 m before and behind: with the
    # cross table they would stand under the cut. Everything else is in both loops.
    yaw = 0.62**2 / (4 * 1000e6 * 0.25**2)
    assert x[1] - x[0] == pytest.approx(yaw, rel=0.1)
    assert y[1] == pytest.approx(y[0], rel=0.002)
    assert np.all((x > 0.02e-6) & (x < 0.1e-6))


def test_the_lathe_yields_at_the_tool_no_less_than_its_bar_and_screw_do() -> None:
    """Bar as a cantilever from the chuck, and the x screw, are in series with all the rest."""
    (found,) = frozen_receptance(machine_of("lathe"), [0.5], 0.0).receptance[0].real.ravel()
    bar = 0.14**3 / (3 * 210e9 * np.pi * 0.06**4 / 64)
    x_shaft = 206e9 * np.pi * 0.027**2 / 4
    held = sum(1 / (x / x_shaft + 1 / 750e6) for x in (0.15, 0.25))
    assert bar + 1 / 520e6 + 1 / held < found < 0.05e-6


def skew(r: Array) -> Array:
    return np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])


def seen_from(centre: Array, at: list[float]) -> Array:
    """Twist at a point from the twist of a body at its centre: u + ϑ × ρ, ϑ."""
    T = np.eye(6)
    T[:3, 3:] = -skew(np.array(at) - centre)
    return T


def test_the_modes_of_the_lathe_bed_and_slides_are_those_of_matrices_written_here() -> None:
    machine = machine_of("lathe")
    kept = {"bed", "slide", "post"}
    parts = tuple(c for c in machine.components if c.name in kept)
    ties = tuple(c for c in machine.connections if set(c.between) <= kept | {"ground"})
    rigid = replace(machine, components=parts, connections=ties, tool={}, static=None)
    rest = np.zeros(())
    tangent = [float(j.jacobian(Motion(rest, rest), j.initial_state(rest))[0]) for j in rigid.joints()]
    found = machine_equations(rigid).natural_frequencies(np.array(tangent))

    centres = [np.array(c) for c in ((0.0, 0.45, 0.3), (0.1, 0.79, 0.25), (0.22, 0.96, 0.25))]
    masses = [(1600, (550, 565, 150)), (160, (4.5, 9, 6)), (130, (4, 4, 3.5))]
    M = np.diag(np.concatenate([[m] * 3 + list(J) for m, J in masses]))
    K = np.zeros((18, 18))

    def tie(first: int, second: int | None, at: list[float], own: Array) -> None:
        J = np.zeros((6, 18))
        J[:, 6 * first : 6 * first + 6] = seen_from(centres[first], at)
        if second is not None:
            J[:, 6 * second : 6 * second + 6] = -seen_from(centres[second], at)
        K[:] += J.T @ own @ J

    def carriage(travel: int, k: float, width: float, height: float) -> Array:
        """Heave and sway, and roll by the lever arm of contact lines at 45°."""
        own = np.diag([k, k, k, 0.0, 0.0, 0.0])
        own[travel, travel] = 0.0
        own[3 + travel, 3 + travel] = 2 * k * ((width + height) / 2) ** 2 / 2
        return own

    def screw(travel: int, area: float, reach: tuple[float, float], nut: float, bearing: float) -> Array:
        shaft = sum(1 / (x / (206e9 * area) + 1 / bearing) for x in reach)
        own = np.zeros((6, 6))
        own[travel, travel] = 1 / (1 / nut + 1 / shaft)
        return own

    for x in (-0.35, 0.35):
        for z in (-0.3, 1.1):
            tie(0, None, [x, 0.0, z], np.diag([300e6] * 3 + [0.0] * 3))
    for a in (-0.2, 0.3):
        for z in (0.1, 0.4):
            tie(1, 0, [a, 0.72, z], carriage(2, 700e6, 0.034, 0.016))
    for a in (0.1, 0.34):
        for z in (0.15, 0.35):
            tie(2, 1, [a, 0.84, z], carriage(0, 520e6, 0.028, 0.014))
    tie(1, 0, [0.05, 0.72, 0.25], screw(2, np.pi * 0.034**2 / 4, (0.5, 0.6), 700e6, 900e6))
    tie(2, 1, [0.22, 0.84, 0.25], screw(0, np.pi * 0.027**2 / 4, (0.15, 0.25), 520e6, 750e6))
    expected = np.sqrt(eigh(K, M, eigvals_only=True)) / (2 * np.pi)
    np.testing.assert_allclose(found, expected, rtol=1e-8)
    assert 30 < expected[0] < 100


def test_a_spindle_turns_freely_and_a_moment_about_it_is_refused() -> None:
    machine = machine_of("column_mill_a")
    assert abs(loaded("column_mill_a").dofs[machine.dofs.index("spindle.front.rz")]) < 1e-12
    with pytest.raises(InputError, match=r"nothing holds (spindle|cutter)\.\w+\.rz against the static load"):
        static_point(replace(machine, static=StaticLoad(force={"spindle.front.rz": 1.0})))
