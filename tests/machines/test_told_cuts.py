"""Cuts about which something untrue was once said, put through the verb and held against their course in time."""

from __future__ import annotations

import re

import numpy as np
import pytest
from random_cuts import ABOUT, Cut, courses, denied
from test_beside_forced import guide_mill

from machines.cutting.forced.beside_cut import told_cuts
from machines.lobes import amplitude_limits

CUTS = {
    4300.0: (1.0, 2.0, 3.0),
    3700.0: (2.0, 3.0, 5.0),
    4175.0: (3.2, 3.5, 3.7),
    8800.0: (4.0,),
    10455.0: (3.0, 4.0, 5.0),
    11727.0: (5.98,),
}
"""Of guide_mill, its guide as identified: rpm and mm."""
KEPT = {(4300.0, 1.0): 1.63e-6, (3700.0, 2.0): 1.02e-6}
"""Chatter that stays beside the vibration of the teeth, in m; at 10455 rpm it does at 3 mm, too."""
DIES = ((4300.0, 2.0), (4300.0, 3.0), (3700.0, 3.0), (10455.0, 4.0), (10455.0, 5.0), (11727.0, 5.98))


@pytest.mark.slow
@pytest.mark.parametrize("speed", CUTS)
def test_what_is_told_of_the_guide_mill_is_its_course_in_time(speed: float) -> None:
    machine = guide_mill()
    limits = amplitude_limits(machine, [speed])
    depths = [1e-3 * b for b in CUTS[speed]]
    said, _ = told_cuts(machine, limits, depths)
    head, tail = said[: -len(depths)], said[-len(depths) :]
    cuts = [Cut(machine, limits, b, (*head, line)) for b, line in zip(depths, tail, strict=True)]
    found = courses(cuts, 12, 40, 150)
    for mm, cut, course in zip(CUTS[speed], cuts, found, strict=True):
        assert denied(cut, *course) == [], cut.said
        assert not re.search("simulation tells", cut.said[-1])
        chatter, forced, _ = course
        told = re.search(r"beside the ([\d.]+) µm that the teeth force", cut.said[-1])
        if (speed, mm) in KEPT:
            assert chatter[-1, 0] == pytest.approx(KEPT[speed, mm], rel=0.02)
            (settled,) = re.findall(r"settles at about ([\d.]+) µm", cut.said[-1])
            assert float(settled) * 1e-6 == pytest.approx(KEPT[speed, mm], rel=ABOUT)
        if (speed, mm) in DIES:
            assert np.max(chatter[-1]) < 1e-8
            assert "die out" in cut.said[-1]
            assert told is not None
            assert float(told.group(1)) * 1e-6 == pytest.approx(forced[-1, 0], rel=0.02)
