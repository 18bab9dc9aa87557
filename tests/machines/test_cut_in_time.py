"""The cut that tests simulate by themselves, against closed forms and published figures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cut_in_time import Bend, Body, Case, Course, cut_in_time

from jointlib.joint import Joint
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import read_machine
from machines.harmonic_balance.assembly import Assembly
from machines.lobes import Cutting

LIBRARY = Path(__file__).parents[2] / "machines" / "library"

MASS, RATIO, SPEED = 25.33, 0.03, 2350.0
STIFFNESS = MASS * (2 * np.pi * 100) ** 2
CUBIC = 0.1 * STIFFNESS / (0.75 * (100e-6) ** 2)


def slide(*bends: Bend) -> Body:
    damping = 2 * RATIO * np.sqrt(STIFFNESS * MASS)
    one = np.ones((1, 1))
    return Body(MASS * one, damping * one, STIFFNESS * one, bends, np.array([[1.0], [0.0]]))


def tool(axes: int) -> Body:
    """The 922 Hz tool, the same in each of its directions."""
    one, k = np.eye(axes), 0.03993 * (2 * np.pi * 922) ** 2
    return Body(0.03993 * one, 0.022 * np.sqrt(k * 0.03993) * one, k * one, (), np.eye(2)[:, :axes])


def turning(**more: Any) -> Cutting:
    return Cutting(process="turning", specific=1e9, **more)


def milling(**more: Any) -> Cutting:
    return Cutting(process="milling", teeth=2, tangential=6e8, normal=2e8, **more)


def growth(found: Course) -> np.ndarray:
    """Of the chatter from window to window over the last half, as a logarithm, (case, kick)."""
    middle = len(found.chatter) // 2
    return np.log(found.chatter[-1] / found.chatter[middle]) / (len(found.chatter) - 1 - middle)


@pytest.mark.thorough
def test_small_vibrations_grow_above_the_depths_that_are_known() -> None:
    """Turning by b = 2kζ(1 + ζ)/K_s at the notch of a lobe, milling by published limits, two Hopf and one flip."""
    r = np.sqrt(1 + 2 * RATIO)
    period = 2 * (3 * np.pi - np.arctan((r**2 - 1) / (2 * RATIO * r))) / (2 * np.pi * 100 * r)
    known = [
        (slide(), turning(), 60 / period, 2 * STIFFNESS * RATIO * (1 + RATIO) / 1e9, 103.0),
        (tool(1), milling(mode="slot"), 5000.0, 0.4086278e-3, 900.0),
        (tool(1), milling(mode="down", immersion=0.1), 18000.0, 0.8156572e-3, 900.0),
        (tool(2), milling(mode="slot"), 5000.0, 0.04750654e-3, 900.0),
    ]
    share = np.array([0.97, 0.985, 1.015, 1.03])
    cases = [Case(body, cut, rpm, b * x, [1e-7], hertz) for body, cut, rpm, b, hertz in known for x in share]
    rate = growth(cut_in_time(cases, 4, 14, 150))[:, 0].reshape(4, 4)
    for row in rate:
        assert float(np.polyfit(row, share, 2)[-1]) == pytest.approx(1.0, rel=2e-3)


@pytest.mark.thorough
def test_forced_vibration_is_the_answer_to_the_force_of_the_feed() -> None:
    """Half way to the limit the chip is in the end what the feed makes it, also after a knock that lost contact."""
    depth, count = 0.05e-3, 2048
    cut = milling(mode="down", immersion=0.5, feed=1e-5)
    found = cut_in_time([Case(tool(2), cut, 10000.0, depth, [1e-6, 3e-5])], 5, 16, 80)
    phi = (np.arange(count) + 0.5) * np.pi / count
    chip = np.where(phi > np.pi / 2, 1e-5 * np.sin(phi), 0.0) * depth
    force = -np.stack([6e8 * np.cos(phi) + 2e8 * np.sin(phi), -6e8 * np.sin(phi) + 2e8 * np.cos(phi)]) * chip
    omega = 2 * np.pi * 2 * 10000 / 60 * np.arange(count // 2 + 1)
    natural = 2 * np.pi * 922
    G = 1 / (0.03993 * (natural**2 - omega**2 + 0.022j * natural * omega))
    motion = np.fft.irfft(np.fft.rfft(force, axis=1) * G, count, axis=1)
    assert found.lost[0, 0, 1]
    assert not np.any(found.lost[-1])
    np.testing.assert_allclose(found.forced[-1, 0], np.max(np.ptp(motion, axis=1)) / 2, rtol=5e-3)
    assert np.all(found.chatter[-1] < 1e-2 * found.forced[-1])


@pytest.mark.thorough
def test_cubic_joints_persist_at_the_published_amplitudes() -> None:
    """60 µm at 2350 rpm: a threshold where the joint hardens, a vibration to settle on where it softens."""
    kicks = [58e-6, 59.5e-6, 61e-6, 63e-6]
    found = cut_in_time(
        [
            Case(slide(Bend(np.ones(1), cubic=cubic)), turning(), SPEED, depth, kicks, 104.9)
            for cubic, depth in ((CUBIC, 0.66324e-3), (-CUBIC, 0.75348e-3))
        ],
        8,
        8,
        90,
    )
    rate, size = growth(found), found.chatter[-5:].mean(axis=0)
    assert float(np.interp(0.0, rate[0], size[0])) == pytest.approx(60e-6, rel=1e-2)
    assert float(np.interp(0.0, rate[1, ::-1], size[1, ::-1])) == pytest.approx(60e-6, rel=1e-2)
    assert np.all(np.diff(rate[0]) > 0)
    assert np.all(np.diff(rate[1]) < 0)


def test_elastic_slip_takes_the_work_of_its_loop() -> None:
    """Hardly cut at all, a slide that slips every cycle loses 4·F·(A − F/k) of energy a cycle, by Masing."""
    stick, slip = 1e6, 2.0
    one = np.ones((1, 1))
    face = Bend(np.ones(1), stick=stick, slip=slip)
    body = Body(MASS * one, 0 * one, STIFFNESS * one, (face,), np.array([[1.0], [0.0]]))
    found = cut_in_time([Case(body, turning(), 6000.0, 1e-12, [100e-6])], 6, 4, 100)
    A = found.chatter[:, 0, 0]
    time = found.time[:, 0]
    middle = (A[1:] + A[:-1]) / 2
    work = 4 * slip * (middle - slip / stick)
    frequency = found.frequency[0, 0]
    np.testing.assert_allclose(-np.diff(A) / np.diff(time), work * frequency / (STIFFNESS * middle), rtol=2e-2)
    assert frequency == pytest.approx(100.0, rel=2e-2)


def test_a_machine_of_several_bodies_is_read_as_its_receptance_has_it() -> None:
    guide = Joint((Linear(6e8), Viscous(480.0), Jenkins(4e7, 36.0)))
    machine = read_machine(LIBRARY / "guide_mill.toml").with_joint("guide", guide)
    body, omega = Body.of(machine), 2 * np.pi * np.array([120.0, 330.0, 1000.0])
    stuck = sum(bend.stick * np.outer(bend.row, bend.row) for bend in body.bends)
    found = [
        body.tool @ np.linalg.solve(body.stiffness + stuck + 1j * w * body.damping - w**2 * body.mass, body.tool.T)
        for w in omega
    ]
    gain = 6.4e8 + 480j * omega
    known = Assembly(machine, machine.tool_dofs, machine.tool_dofs).coupled(omega, gain[:, None])
    np.testing.assert_allclose(found, known, atol=1e-9 * np.max(np.abs(known)))
