"""What does not repeat moves a law that is not linear as what does: by hand, on a prescribed motion."""

from __future__ import annotations

import numpy as np
import pytest
from integrated_rig import LINEAR, PEAK, C, K
from prescribed_motion import FINER, moved, observed

from jointlib.joint import Joint
from jointlib.law import JointLaw, Motion
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.cubic import Cubic
from jointlib.loop.balance.equations import forces_of_law
from jointlib.loop.balance.tangents import tangents

CUBIC = Cubic(0.2 * K / PEAK**2)


@pytest.mark.parametrize("law", [CUBIC, Coulomb(0.02 * K * PEAK, 0.1)], ids=lambda law: str(law.kind))
def test_the_force_between_the_lines_of_the_period_is_that_of_the_law_itself(law: JointLaw) -> None:
    z, v = moved()
    force = np.asarray(law.step(Motion(z, v), np.empty((len(z), 0)))[0])
    o = observed(K * z + C * v + force)
    true = np.fft.rfft(force)[o.lines] / FINER
    inside = o.stray & (o.frequency >= 2e3) & (o.frequency <= 20e3)
    left = true - forces_of_law([o], law)[0]
    through_linear_part = true - o.with_stray(np.where(o.on_period, true, 0))
    size = [np.linalg.norm(x[inside]) for x in (left, through_linear_part, true)]
    assert size[0] < 1e-3 * size[2]
    assert size[1] > 0.05 * size[2]


def test_the_true_joint_leaves_the_noise_of_the_sensors() -> None:
    z, v = moved()
    o = observed(K * z + C * v + CUBIC.stiffness3 * z**3)
    r = o.whitened(Joint((*LINEAR, CUBIC)))[o.valid[:, 2], 2]
    assert float(np.mean(np.abs(r) ** 2)) < 1.5


def test_slopes_are_those_of_that_force() -> None:
    z, v = moved()
    o = observed(K * z + C * v)
    joint = Joint((*LINEAR, CUBIC))
    found = tangents([o], joint, ["cubic.stiffness3"])["cubic.stiffness3"][0]
    unit = forces_of_law([o], CUBIC)[0] / CUBIC.stiffness3
    assert np.linalg.norm(found - unit) < 1e-9 * np.linalg.norm(unit)
    assert np.linalg.norm(unit[o.stray]) > 0.1 * np.linalg.norm(unit)
