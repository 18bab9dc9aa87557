"""Where the finished wall stands, and what unlike flutes, their edges and run-out force: against the cut in time."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_cutters import PAIRS, UNLIKE, mill

from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.laws.cubic import Cubic
from machines import Connection, read_machine
from machines.cutting.forced.forced_vibration import forced_vibration
from machines.cutting.forced.held_at_rest import held_if_many
from machines.cutting.forced.pattern_forces import PatternForces
from machines.cutting.forced.surface_error import surface_errors, worst_error
from machines.cutting.in_time.witness import vibrate
from machines.harmonic_balance.assembly import Assembly
from machines.lobes import Cutting
from machines.road.open_joints import with_joints

LIBRARY = Path(__file__).parents[2] / "machines" / "library"
SPEED, DEPTH = 9000.0, 3e-3
OUT = (2e-6, -1e-6, 0.0, -1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("more", "within"),
    [
        pytest.param({"pitch": UNLIKE}, 2e-4, marks=pytest.mark.thorough),
        ({"pitch": PAIRS, "helix": 30.0}, 3e-3),
        pytest.param({"helix": (30.0, 33.0, 31.0, 35.0)}, 3e-3, marks=pytest.mark.thorough),
        pytest.param({"pitch": UNLIKE, "runout": OUT, "process_damping": 3e4}, 3e-3, marks=pytest.mark.thorough),
        # Where the chip ends an edge leaves the cut, which the series does not know.
        pytest.param({"edge_tangential": 2e4, "edge_normal": 1e4, "runout": OUT}, 2e-2, marks=pytest.mark.thorough),
    ],
)
def test_what_unlike_flutes_force_is_what_the_cut_in_time_settles_on(more: dict[str, Any], within: float) -> None:
    machine = mill(feed=1e-4, **more)
    found = forced_vibration(machine, SPEED, DEPTH)
    run = vibrate(machine, SPEED, DEPTH, np.array([1e-12]), 801.3, waves=40, steps=100).run
    angle = 2 * np.pi * SPEED / 60 * run.time
    k = np.arange(1, found.tool.shape[1] + 1)
    told = np.einsum("tk,ka->ta", np.exp(1j * found.patterns * angle[:, None] * k), found.tool[0]).real
    seen = run.motion[-1, :, :, 0]
    closed, time = np.vstack([seen, seen[:1]]), np.append(run.time, run.period)
    seen = seen - np.trapezoid(closed, time, axis=0) / run.period
    assert np.max(np.abs(seen - told)) < within * np.ptp(told)


@pytest.mark.slow
@pytest.mark.parametrize(("mode", "wall"), [pytest.param("up", 0, marks=pytest.mark.thorough), ("down", 1)])
def test_the_wall_is_what_the_path_of_the_teeth_envelops(mode: str, wall: int) -> None:
    machine = mill(feed=1e-4, pitch=UNLIKE, runout=OUT, mode=mode)
    cutting, found = Cutting(**dict(machine.cutting or {})), forced_vibration(machine, SPEED, DEPTH)
    errors = surface_errors(cutting, found)[0]
    assert np.isnan(errors[1 - wall]).all()
    assert worst_error(errors[None])[0] == errors[wall, 0]
    theta = np.linspace(0, 2 * np.pi, 200001)
    k = np.arange(1, found.tool.shape[1] + 1)
    y = found.mean[0, 1] + np.zeros_like(theta)
    for n, phasor in zip(k, found.tool[0, :, 1], strict=True):
        y += (phasor * np.exp(1j * n * found.patterns * theta)).real
    radius, reached = 6e-3, []
    for place, out in zip(np.radians([0, *np.cumsum(UNLIKE)[:3]]), OUT, strict=True):
        along = (radius + out) * np.cos(theta - place) + y
        reached.append(np.max(along if wall == 0 else -along) - radius)
    # The path touches the wall beside φ = 0 by (dy/dφ)²/2R.
    assert errors[wall, 0] == pytest.approx(max(reached), abs=2e-8)


def test_a_soft_slow_tool_is_bent_by_the_mean_force_alone() -> None:
    machine = mill(feed=1e-4, mode="slot", immersion=None)
    found = forced_vibration(machine, 9.0, 1e-3)
    cutting = Cutting(**dict(machine.cutting or {}))
    k = (2 * np.pi * 800) ** 2
    phi = (np.arange(20000) + 0.5) / 20000 * np.pi
    force = 4 / (2 * np.pi) * np.pi * np.mean(-cutting.tooth(phi)[0] * (1e-4 * np.sin(phi))[:, None], axis=0) * 1e-3
    np.testing.assert_allclose(found.mean[0], force / k, rtol=1e-6)
    # With four teeth two are in the slot at once where one enters: their chips there are 0 and the feed.
    edge = np.array([1e-4 * cutting.tooth(np.array([np.pi / 2]))[0][0, 1]]) * -1e-3 / k
    np.testing.assert_allclose(surface_errors(cutting, found)[0, :, 0], [edge[0], -edge[0]], rtol=0.02)


def test_run_out_and_edges_move_the_wall_and_joints_that_bend_are_refused() -> None:
    walls = []
    for more in ({}, {"runout": (5e-6, 0.0, -5e-6, 0.0)}, {"edge_normal": 2e4}):
        machine = mill(feed=1e-4, **more)
        walls.append(
            worst_error(surface_errors(Cutting(**machine.cutting), forced_vibration(machine, SPEED, DEPTH)))[0]
        )
    assert abs(walls[1] - walls[0]) > 1e-6
    assert abs(walls[2] - walls[0]) > 1e-7
    bent = Connection("spring", ("tool.x", "ground"), Joint((Cubic(1e12),)))
    machine = replace(mill(feed=1e-4, pitch=PAIRS), connections=(bent,))
    with pytest.raises(InputError, match="not computed with unequal pitches where joints depend on amplitude"):
        forced_vibration(machine, SPEED, DEPTH)
    with pytest.raises(InputError, match="runout has 2 radii, expected one a tooth, 4"):
        Cutting(**{**(mill().cutting or {}), "runout": (1e-6, 2e-6)})


def test_a_material_gives_what_is_not_given() -> None:
    bare = {"process": "milling", "teeth": 2, "mode": "slot", "material": "al-7075-t6"}
    cutting = Cutting(**bare)  # type: ignore[arg-type]
    assert (cutting.tangential, cutting.normal, cutting.edge_tangential) == (767.01e6, 168.8e6, 27.7e3)
    assert Cutting(**bare, tangential=7e8).tangential == 7e8  # type: ignore[arg-type]
    with pytest.raises(InputError, match="material is 'al-7075', "):
        Cutting(**{**bare, "material": "al-7075"})  # type: ignore[arg-type]
    with pytest.raises(InputError, match="'material' belongs to milling"):
        Cutting("turning", specific=1e9, material="al-7075-t6")


def test_the_mean_force_holds_a_machine_of_free_parts_as_its_static_compliance_says() -> None:
    """At 1 rad/s a column mill still answers as at rest; far below, receptances of its open parts lose their digits."""
    machine, _ = held_if_many(with_joints(read_machine(LIBRARY / "column_mill_a.toml"))[0], 2000.0)
    found = forced_vibration(machine, 2000.0, 1e-3)
    forces = PatternForces(Cutting(**dict(machine.cutting or {})), machine.tool_axes, 8).feeds(1e-3)[0].real * 1e-3
    tool = machine.tool_dofs
    compliance = Assembly(machine, tool, tool).at(np.ones(1)).Hof[0, -2:].real
    np.testing.assert_allclose(found.mean[0], compliance @ forces, rtol=1e-6)
