"""Records that end below a mode of the tool: what their lines hold of it, and what is claimed of depths then."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from jointlib.errors import InputError, Outcome
from jointlib.frf import FRF
from machines.cutting.rest.beyond_record import refuse_beyond, refuse_unknown
from machines.lobes import Cutting, stability_lobes
from machines.tool.tool_model import ToolModel
from machines.tool.tool_point import tool_point
from machines.tool.unseen_modes import unseen_flexibility

MODES = np.array([1200.0, 3880.0, 5020.0])
STIFFNESS = np.array([6e7, 6e7, 4e7])
DAMPING = (0.03, 0.012, 0.01)
TOOL = ToolModel.from_modes(MODES, DAMPING, STIFFNESS / (2 * np.pi * MODES) ** 2, [[1.0, 1.0, 1.0]], ("x",))
CUT = Cutting("milling", teeth=3, tangential=8e8, normal=2.4e8, mode="down", immersion=0.25)


def record(high: float, noise: float = 0.0) -> FRF:
    f = np.arange(200.0, high + 1, 10.0)
    random = np.random.default_rng(3)
    G = TOOL(f)
    shaken = random.standard_normal(G.shape) + 1j * random.standard_normal(G.shape)
    return FRF(f, G + noise * np.median(np.abs(G)) * shaken, ("cutter.x",), ("cutter.x",))


@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_lines_below_a_mode_tell_its_flexibility(noise: float) -> None:
    """The receptance ends as that of a mass, 3 % above the second mode, and holds the third all the same."""
    frf = record(4000.0, noise)
    assert frf.receptance[-1, 0, 0].real < 0
    found = unseen_flexibility(tool_point(frf, ("x",)))
    assert 1 / STIFFNESS[2] < found < 1.4 / STIFFNESS[2]


def test_lines_past_all_modes_tell_of_none() -> None:
    assert unseen_flexibility(tool_point(record(15000.0), ("x",))) < 1e-3 / STIFFNESS[2]
    assert unseen_flexibility(tool_point(FRF(np.arange(3e3, 4e3), TOOL(np.arange(3e3, 4e3)), ("x",), ("x",)))) == 0


@pytest.mark.parametrize("method", ["multi-frequency", "zero-order"])
def test_a_depth_that_a_mode_beyond_the_record_denies_is_doubted(method: str) -> None:
    """At 12 000 rpm the record to 4 kHz has 12 mm, and the tool chatters from 8 mm on at 5.1 kHz."""
    chart = stability_lobes(record(4000.0), CUT, 12000.0, method)
    exact = stability_lobes(TOOL, CUT, 12000.0, "collocation")
    assert chart.depth > 1.4 * exact.depth
    assert 0.6 * exact.depth < chart.known_below < exact.depth
    assert chart.doubtful
    assert chart.outcome is Outcome.FRF_TOO_SHORT
    assert any(said.startswith("The lines tell of modes above 4000 Hz") for said in chart.warnings)


@pytest.mark.parametrize("method", ["multi-frequency", "zero-order"])
def test_a_record_past_the_modes_leaves_no_doubt(method: str) -> None:
    chart = stability_lobes(record(15000.0), CUT, 12000.0, method)
    assert not chart.doubtful
    assert not any("tell of modes above" in said for said in chart.warnings)


def test_what_is_known_at_a_speed_does_not_hang_on_the_others() -> None:
    """Where the end of the record moves the depth by more than 5 %, a depth below the lower of the two is known."""
    speed = np.linspace(9000.0, 22000.0, 14)
    together = stability_lobes(record(5500.0), CUT, speed, "multi-frequency")
    alone = [stability_lobes(record(5500.0), CUT, rpm, "multi-frequency") for rpm in speed]
    assert together.known_below == pytest.approx([float(one.known_below) for one in alone], rel=1e-12)
    moved = together.doubtful
    assert 1 < np.count_nonzero(moved) < len(speed)
    exact = stability_lobes(TOOL, CUT, speed, "collocation")
    assert np.all(together.sure[moved] < exact.depth[moved])


def test_chatter_outside_the_record_is_refused() -> None:
    speed = np.array([9000.0, 16000.0])
    refuse_beyond("multi-frequency", speed, np.array([5150.3, 3990.0]), 210.0, 3990.0)
    with pytest.raises(InputError, match=r"at 1 of 2 speeds, at 16000 rpm at 5150.3 Hz; expected a wider band"):
        refuse_beyond("multi-frequency", speed, np.array([np.nan, 5150.3]), 210.0, 3990.0)


def test_one_speed_with_chatter_outside_leaves_the_others() -> None:
    """A chart is refused where nothing of it is known, not where a part is."""
    chart = stability_lobes(record(4000.0), CUT, [12000.0, 20000.0])
    moved = replace(chart, known_to=1000.0, chatter_frequency=np.array([900.0, 1192.0]))
    refuse_unknown(moved)
    with pytest.raises(InputError, match="known up to 1000 Hz"):
        refuse_unknown(replace(moved, chatter_frequency=np.array([np.nan, 1192.0])))
