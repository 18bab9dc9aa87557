"""Two laws that are one in a limit of their parameters are no rivals; a slider stands where its record begins."""

from __future__ import annotations

import numpy as np
import pytest

from jointlib.effect import Scale
from jointlib.identification.path_record import low_pass
from jointlib.law import JointLaw
from jointlib.laws.bouc_wen import BoucWen
from jointlib.laws.dahl import Dahl
from jointlib.laws.jenkins import Jenkins
from jointlib.loop.path.composed.same_law import same_law

SCALE = Scale(displacement=12e-6, velocity=1e-4, stiffness=1e8)
SLIP = Jenkins(40.02e6, 220.1)


@pytest.mark.parametrize(
    ("law", "same"),
    [
        (BoucWen(40.04e6, 220.4, 384.0), True),
        (BoucWen(42e6, 231.0, 384.0), True),
        (BoucWen(40e6, 220.0, 3.0), False),
        (BoucWen(40e6, 220.0, 8.0), False),
        (Dahl(40e6, 220.0), False),
        (Jenkins(40.7e6, 230.7), True),
        (Jenkins(40.4e6, 220.6, 2.6e-8), True),
        (Jenkins(40.4e6, 220.6, 1e-6), False),
    ],
)
def test_a_loop_whose_corner_is_as_sharp_as_that_of_slip_is_slip(law: JointLaw, same: bool) -> None:
    assert same_law(law, SLIP, SCALE) is same


@pytest.mark.parametrize("cutoff", [15.0, 40.0, 100.0])
def test_the_low_pass_keeps_where_a_path_begins(cutoff: float) -> None:
    """A slider that has not slipped yet stands there: 25 nm beside it are 1 N of 40 N/µm, in no law and no noise."""
    time = np.arange(1000) / 500.0
    path = 3e-6 * np.sin(2 * np.pi * 2.0 * time)
    found = low_pass(path, cutoff, 500.0)
    assert abs(found[0]) < 1e-10
    assert np.max(np.abs(found[100:-100] - path[100:-100])) < 1e-9
