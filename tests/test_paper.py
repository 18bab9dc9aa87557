"""The founding paper recomputed: the column "Ours" of docs/paper.md is what the code gives, to the last digit shown."""

from __future__ import annotations

import itertools
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from jointlib.arrays import Array
from jointlib.identification import RigBody, rig_modes
from jointlib.joint import Joint
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.laws.linear import Linear
from jointlib.laws.polynomial import Polynomial
from jointlib.laws.viscous import Viscous
from machines.components.connection import Connection
from machines.components.rigid import Rigid
from machines.forced_response.response import response
from machines.model.machine import Machine

PAGE = Path(__file__).parents[1] / "docs" / "paper.md"
OMEGA = 2 * np.pi * 4800.0
MASS = 60.0
KAPPA_7, KAPPA_8 = 4.8403e-7, 4.8403e-8
K1, K2, K3 = 654.164e6, 28.5820e12, 1.7083e18
C0, C1, C2, C3 = 463.062, 22.3744e6, 19.8415e12, 44.3015e18
EQUATION_33 = Polynomial(((0.0, C0), (K1, 0.0), (0.0, -C2), (-K3, 0.0)))
STATIC_16 = Polynomial(((0.0,), (K1,), (K2,), (-K3,)))
GUIDE = HertzGuide(630.0, 6 * np.sin(np.pi / 4) ** 2 * np.cbrt(630.0) / K1)
FORCE = 166.0 / 0.03


def modes(rest: float, inertia_x: float, inertia_y: float, arm_x: float = 12.5e-3, arm_y: float = 21e-3) -> Array:
    """Frequencies of translation and of rotation about X and Y in Hz (eq. 14)."""
    block, rail = RigBody(0.942, 5.9927e-4, 9.1761e-4), RigBody(rest, inertia_x, inertia_y)
    found = rig_modes(block, rail, stiffness=600e6, arm_x=arm_x, arm_y=arm_y)
    values, shapes = np.linalg.eig(np.linalg.solve(found.mass, found.stiffness))
    share = np.abs(shapes[:3]) / np.linalg.norm(shapes, axis=0)
    return np.array([np.sqrt(np.max(values.real[row > 0.1])) / (2 * np.pi) for row in share])


def printed_row_four() -> Array:
    """Both frequencies in Hz of m1 and m2 + m3 with the unsymmetric matrix as printed."""
    K = 600e6 * np.array([[1.0, -1.0], [-0.25, 1.0]])
    values = np.linalg.eigvals(np.diag([1 / 0.942, 1 / 2.2]) @ K)
    return np.sort(np.sqrt(values.real))[::-1] / (2 * np.pi)


def stiffness_at(frequency: float) -> float:
    """Joint stiffness in N/m for which the translation lies at a frequency in Hz; the square scales as k."""
    return float(600e6 * (frequency / modes(2.2, 7.6785e-4, 66.867e-4)[0]) ** 2)


def rail_mass(frequency: float) -> float:
    """Mass in kg that puts the translation of the bare guide at a frequency in Hz."""
    return float(brentq(lambda m: modes(m, 7.6785e-4, 66.867e-4)[0] - frequency, 0.1, 2.2))


def angle_for(stiffness: float) -> float:
    """Contact angle in degrees for which the printed preload and 4.8403e-8 give a stiffness in N/m."""

    def excess(angle: float) -> float:
        return HertzGuide(630.0, KAPPA_8, angle).stiffness - stiffness

    return float(np.degrees(brentq(excess, 0.1, np.pi / 2)))


def loss(gain: complex) -> tuple[float, float]:
    """Per cent: energy lost in a cycle over the largest potential energy, and the loss factor."""
    A = 1e-6
    lost, stored = np.pi * A**2 * gain.imag, gain.real * A**2 / 2
    return 100 * lost / stored, 100 * gain.imag / gain.real


def natural(law: Polynomial | HertzGuide, amplitude: float) -> float:
    """√(Re G/m)/2π on 60 kg, Hz."""
    return float(np.sqrt(law.describing_function(amplitude, OMEGA).real / MASS) / (2 * np.pi))


def free_mean() -> float:
    """Natural frequency in Hz at 5 µm when the mean force vanishes and the mean displacement does not."""
    law = Polynomial(((0.0, C0), (K1, 0.0), (K2, -C2), (-K3, 0.0)))
    mean = brentq(lambda z: float(law.first_harmonic(5e-6, OMEGA, z).mean), -2e-6, 2e-6, xtol=1e-18)
    return float(np.sqrt(law.describing_function(5e-6, OMEGA, mean).real / MASS) / (2 * np.pi))


def negative_damping() -> Array:
    """For every choice of the lost signs, the smallest abs(z) in µm at which ∂f/∂ż of eq. 16 falls to zero."""
    z = np.linspace(-4e-6, 4e-6, 80_001)
    found = []
    for s1, s2, s3 in itertools.product((1, -1), repeat=3):
        law = Polynomial(((0.0, C0), (0.0, s1 * C1), (0.0, s2 * C2), (0.0, s3 * C3)))
        found.append(np.min(np.abs(z[law.slopes(z, np.zeros_like(z))[1] < 0])))
    return 1e6 * np.array(found)


def static(z: float) -> float:
    return float(STATIC_16.force(np.array(z), np.array(0.0)))


def computed() -> dict[str, float]:
    """Every number of the page by the words of its row."""
    whole = modes(2.2, 7.6785e-4, 66.867e-4)
    doubled = modes(4.4, 2 * 7.6785e-4, 2 * 66.867e-4)
    halved = modes(2.2, 7.6785e-4, 66.867e-4, 6.25e-3, 10.5e-3)
    wrong = printed_row_four()
    linear = Joint((Linear(600e6), Viscous(503.0))).first_harmonic(1e-6, OMEGA).gain
    small = EQUATION_33.describing_function(1e-12, OMEGA)
    per_503 = {a: GUIDE.describing_function(a * 1e-6).real / 503.0 / 1e6 for a in (1, 5)}
    re = {a: EQUATION_33.describing_function(a * 1e-6, OMEGA) for a in (1, 3, 5)}
    fall = negative_damping()
    odd = Polynomial(((0.0,), (K1,), (0.0,), (-K3,)))
    turn = brentq(lambda z: float(odd.slopes(np.array(z), np.array(0.0))[0]), 1e-6, 20e-6)
    soft = np.linspace(-20e-6, 0, 20_001)
    A = 2e-8
    beta = Polynomial(((0.0,), (1.0,))).describing_function(1.0).real  # (2/π) B(3/2, 1/2) = 1
    return {
        "Translation along Z, Hz": whole[0],
        "Rotation about X, Hz": whole[1],
        "Rotation about Y, Hz": whole[2],
        "Translation if m2 = m3 = 2.2 kg, Hz": doubled[0],
        "Rotation about X if Ix2 = Ix3 = 7.6785e-4, Hz": doubled[1],
        "Rotation about Y if Iy2 = Iy3 = 66.867e-4, Hz": doubled[2],
        "Rotation about X if 12.5 mm is the distance between springs, Hz": halved[1],
        "Rotation about Y if 21 mm is the distance between springs, Hz": halved[2],
        "Translation with −k/4 in row 4 of K, Hz": wrong[0],
        "Second frequency that row 4 as printed creates, Hz": wrong[1],
        "Stiffness that the measured 4819 Hz means, N/µm": stiffness_at(4819.0) / 1e6,
        "Translation with the 654.164 N/µm of eq. 33, Hz": whole[0] * np.sqrt(K1 / 600e6),
        "Rail mass for a natural frequency of 6000 Hz without the block, kg": rail_mass(6000.0),
        "Rail mass for a natural frequency of 7000 Hz without the block, kg": rail_mass(7000.0),
        "Lift-off load at P0 = 630 N and 45°, N": HertzGuide(630.0, KAPPA_8).lift_off_load,
        "Stiffness at rest with κ = 4.8403e-7 and 45°, N/µm": HertzGuide(630.0, KAPPA_7).stiffness / 1e6,
        "Stiffness at rest with κ = 4.8403e-7 and 90°, N/µm": HertzGuide(630.0, KAPPA_7, np.pi / 2).stiffness / 1e6,
        "Stiffness at rest with κ = 4.8403e-8 and 45°, N/µm": HertzGuide(630.0, KAPPA_8).stiffness / 1e6,
        "Contact angle for 600 N/µm with κ = 4.8403e-8, deg": angle_for(600e6),
        "Contact angle for 654.164 N/µm with κ = 4.8403e-8, deg": angle_for(K1),
        "κ for 654.164 N/µm at 45°, m/N^(2/3)": float(
            brentq(lambda kappa: HertzGuide(630.0, kappa).stiffness - K1, 1e-8, 1e-7, xtol=1e-20)
        ),
        "Lift-off displacement with that κ, µm": GUIDE.lift_off_displacement * 1e6,
        "Cubic stiffness of that guide at small amplitude, N/µm³": (
            (GUIDE.describing_function(A).real - GUIDE.stiffness) / (0.75 * A**2) / 1e18
        ),
        "Loss per cycle over largest potential energy, c = 503 N s/m, k = 600 N/µm, 4800 Hz, %": loss(complex(linear))[
            0
        ],
        "Loss factor cω/k of the same, %": loss(complex(linear))[1],
        "Loss per cycle over largest potential energy, eq. 33 at small amplitude, %": loss(small)[0],
        "Loss factor of eq. 33 at small amplitude, %": loss(small)[1],
        "Roll-off k/c with 600 N/µm and 503 N s/m, 1e6 rad/s": float(linear.real / (linear.imag / OMEGA)) / 1e6,
        "The same as a frequency, kHz": float(linear.real / (linear.imag / OMEGA)) / (2 * np.pi) / 1e3,
        "Roll-off of eq. 33 at small amplitude, 1e6 rad/s": small.real / (small.imag / OMEGA) / 1e6,
        "Roll-off of the Hertz guide (45°, κ of the table above) at 1 µm, 1e6 rad/s": per_503[1],
        "Roll-off of the Hertz guide (45°, κ of the table above) at 5 µm, 1e6 rad/s": per_503[5],
        "Factor of the cubic in Re G": (re[3].real - K1) / (-K3 * 9e-12),
        "Factor of z²ż in Im G/ω": (re[3].imag / OMEGA - C0) / (-C2 * 9e-12),
        "∫ sin²θ dθ from 0 to π/2 (eq. 31 with m = 2, n = 0)": beta * np.pi / 4,
        **{f"Re G at {a} µm, N/µm": gain.real / 1e6 for a, gain in re.items()},
        **{f"Natural frequency on 60 kg at {a} µm, Hz": natural(EQUATION_33, a * 1e-6) for a in re},
        **{f"The same with the Hertz guide at {a} µm, Hz": natural(GUIDE, a * 1e-6) for a in re},
        "Shift of the natural frequency from 1 to 5 µm, eq. 33, %": 100
        * (natural(EQUATION_33, 5e-6) / natural(EQUATION_33, 1e-6) - 1),
        "Shift of the natural frequency from 1 to 5 µm, Hertz, %": 100
        * (natural(GUIDE, 5e-6) / natural(GUIDE, 1e-6) - 1),
        "Natural frequency at 5 µm with the z² of eq. 16 and a mean free to move, Hz": free_mean(),
        "Loss factor at 4800 Hz if ż in eq. 16 were in mm/s": 1e3 * small.imag / small.real,
        "Amplitude above which Im G of eq. 33 is negative, µm": 1e6
        * brentq(lambda a: EQUATION_33.describing_function(a, OMEGA).imag, 5e-6, 20e-6, xtol=1e-15),
        "Smallest displacement at which c(z) of eq. 16 turns negative, any signs, µm": float(np.min(fall)),
        "Largest such displacement over all choices of signs, µm": float(np.max(fall)),
        "Displacement that the constant 70.6689 N of eq. 16 stands for, µm": 1e6
        * brentq(lambda z: static(z) - 70.6689, 0, 1e-6, xtol=1e-15),
        "Smallest maximum of the force, N": FORCE,
        "Displacement at which eq. 16 reaches it on its stiff side, µm": 1e6
        * brentq(lambda z: static(z) - FORCE, 0, 10e-6, xtol=1e-15),
        "Largest static force of eq. 16 on its soft side, N": float(
            np.max(-STATIC_16.force(soft, np.zeros_like(soft))[soft > -11e-6])
        ),
        "Displacement at which the odd part of eq. 16 turns over, µm": 1e6 * turn,
        "Force there, N": float(odd.force(np.array(turn), np.array(0.0))),
        "Displacement at which the Hertz guide (45°, κ as above) reaches 5533 N, µm": 1e6
        * brentq(lambda z: float(GUIDE.force(np.array(z), np.array(0.0))) - FORCE, 1e-6, 30e-6, xtol=1e-15),
    }


def table() -> dict[str, str]:
    """The column "Ours" by the words of its row."""
    found: dict[str, str] = {}
    for line in PAGE.read_text("utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if line.startswith("|") and len(cells) == 4 and cells[0] != "Quantity" and not set(line) <= set("|-"):
            assert cells[0] not in found, cells[0]
            found[cells[0]] = cells[2]
    return found


def rounded(value: float, like: str) -> float:
    """A value with as many digits as a printed number shows."""
    match = re.fullmatch(r"-?\d+(?:\.(\d+))?(e-?\d+)?", like)
    assert match, f"{like!r} is no number"
    digits = len(match[1] or "")
    return float(f"{value:.{digits}e}" if match[2] else f"{value:.{digits}f}")


def test_every_number_of_the_page_is_computed() -> None:
    ours, rows = computed(), table()
    assert set(rows) == set(ours)
    wrong = {
        row: (printed, ours[row]) for row, printed in rows.items() if rounded(ours[row], printed) != float(printed)
    }
    assert not wrong


def test_modes_of_the_rig_are_those_of_a_machine_made_of_contact_rows() -> None:
    """A second route to eq. 14: two rigid bodies, four scalar connections, receptance instead of eigenvalues."""
    third = 1e-3  # about Z nothing holds the bodies
    block = Rigid("block", 0.942, np.array([5.9927e-4, 9.1761e-4, third]))
    rail = Rigid("rail", 2.2, np.array([7.6785e-4, 66.867e-4, third]))
    spring = Joint((Linear(150e6), Viscous(10.0)))
    corners = itertools.product((-21e-3, 21e-3), (-12.5e-3, 12.5e-3))
    rows = tuple(
        Connection(f"row {i}", ("block", "rail"), spring, at=(x, y, 0.0), direction=(0.0, 0.0, 1.0))
        for i, (x, y) in enumerate(corners)
    )
    machine = Machine((block, rail), rows)
    expected = modes(2.2, 7.6785e-4, 66.867e-4)
    for dof, frequency in zip(("block.uz", "block.rx", "block.ry"), expected, strict=True):
        lines = frequency * np.linspace(0.999, 1.001, 2001)
        shown = response(machine, 1.0, lines, dof, outputs=[dof]).frfs[0].between(dof, dof)
        # The grid is one part in a million; light damping moves the peak by less.
        assert lines[np.argmax(np.abs(shown))] == pytest.approx(frequency, rel=3e-6)


def test_shipped_joint_file_holds_the_kappa_of_the_page() -> None:
    from jointlib.io.joint_file import read_joint

    guide = read_joint(PAGE.parents[1] / "machines" / "library" / "guide.joint.toml")
    assert guide.parameters["hertz_guide.kappa"] == pytest.approx(GUIDE.kappa, rel=1e-9)


def test_hertz_guide_obeys_the_implicit_equations_of_the_paper() -> None:
    """Eqs 3–6 and 8 with the restored signs: row loads from the displacement give the external load."""
    z = np.linspace(-12e-6, 12e-6, 97)
    phi, d0 = GUIDE.contact_angle, GUIDE.indentation
    lower, upper = (np.maximum(d0 + s * z * np.sin(phi), 0) for s in (1, -1))
    load = 2 * np.sin(phi) * ((lower / GUIDE.kappa) ** 1.5 - (upper / GUIDE.kappa) ** 1.5)
    np.testing.assert_allclose(GUIDE.force(z, np.zeros_like(z)), load, rtol=1e-12, atol=1e-9)
