"""Receptance with joints frozen at a tool-point amplitude, against the forced response that makes that amplitude."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from test_machine_coupling import lumped

import machines
from jointlib.errors import InputError, Outcome
from jointlib.frf import ReceptanceKind
from jointlib.joint import Joint
from jointlib.laws.cubic import Cubic
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import Connection, Machine, frozen_receptance, linear_check, operating_point, read_machine, response
from machines.operating.operating_point import OpenTool

LIBRARY = Path(machines.__file__).parent / "library"
SOFT = Joint((Linear(654.164e6), Cubic(-1.7083e18), Viscous(463.062)))


def plane(joints: int) -> Machine:
    """A head that moves in x and y on one or two softening joints, so that both directions share them."""
    head = lumped("head", [[1.0, 0.1], [0.1, 1.2]])
    base = lumped("base", np.diag([3.0, 4.0]), np.diag([300.0, 300.0]), np.diag([2e8, 3e8]))
    second = SOFT if joints == 2 else Joint((Linear(5e8), Viscous(300.0)))
    return Machine(
        (head, base),
        (Connection("a", ("head.x", "base.x"), SOFT), Connection("b", ("head.y", "base.y"), second)),
        tool={"x": "head.x", "y": "head.y"},
    )


LINES = np.linspace(900.0, 2500.0, 60)


@pytest.mark.parametrize("joints", [1, 2])
def test_force_that_is_found_makes_the_amplitude_in_a_forced_response(joints: int) -> None:
    machine, amplitude = plane(joints), 4e-6
    point = operating_point(machine, LINES, amplitude, [1.0, 0.0])
    fine = [i for i, o in enumerate(point.outcomes) if o is Outcome.CONVERGED]
    assert len(fine) > 40
    for i in fine[::8]:
        found = response(machine, point.force[i], LINES[i : i + 1], drive="head.x", outputs=["head.x", "head.y"])
        reached = [np.max(np.abs(b.output)) for b in found.branches[0]]
        assert min(reached, key=lambda r: abs(r - amplitude)) == pytest.approx(amplitude, rel=1e-7)


def test_one_joint_by_map_and_by_newton_give_the_same_frozen_machine() -> None:
    """A second joint that softens by next to nothing sends the search the other way."""
    machine = plane(1)
    nearly = Joint((Linear(5e8), Viscous(300.0), Cubic(-1.0)))
    for direction in ([1.0, 0.0], [0.3, 1.0j]):
        a = operating_point(machine, LINES, 1e-6, direction)
        b = operating_point(machine.with_joint("b", nearly), LINES, 1e-6, direction)
        assert a.frf.kind is b.frf.kind is ReceptanceKind.FROZEN
        both = [x is y is Outcome.CONVERGED for x, y in zip(a.outcomes, b.outcomes, strict=True)]
        assert sum(both) >= 55
        difference = (a.frf.receptance - b.frf.receptance)[both]
        assert np.linalg.norm(difference) < 1e-9 * np.linalg.norm(a.frf.receptance)


def test_direction_of_the_force_may_change_from_line_to_line() -> None:
    machine = plane(1)
    directions = np.stack([np.exp(1j * LINES), np.linspace(0, 1, len(LINES))], axis=1)
    whole = frozen_receptance(machine, LINES, 1e-6, directions).receptance
    for i in (0, 30, 59):
        alone = frozen_receptance(machine, LINES[i], 1e-6, directions[i]).receptance
        assert np.max(np.abs(whole[i] - alone[0])) < 1e-9 * np.max(np.abs(alone))


@pytest.mark.parametrize("joints", [1, 2])
def test_open_machine_serves_every_vibration_of_its_tool(joints: int) -> None:
    """What was computed for one amplitude, direction or choice of lines leaves the next one as it is alone."""
    machine, some = plane(joints), np.array([3, 31, 58])
    tool = OpenTool(machine, LINES)
    tool.vibrating(1e-8)
    for amplitude, direction in ((1e-6, [1.0, 0.0]), (5e-7, [0.3, 1.0j])):
        shared = tool.vibrating(amplitude, direction, some)
        alone = operating_point(machine, LINES[some], amplitude, direction)
        assert shared.outcomes == alone.outcomes
        assert shared.force == pytest.approx(alone.force, rel=1e-9)
        assert shared.frf.receptance == pytest.approx(alone.frf.receptance, rel=1e-9)


def test_vanishing_amplitude_is_the_tangent_machine() -> None:
    machine = read_machine(LIBRARY / "two_mass.toml")
    check = linear_check(machine, frequency=np.linspace(1000.0, 6000.0, 80))
    frf = frozen_receptance(machine, check.frequency, 0.0)
    assert frf.kind is ReceptanceKind.TANGENT
    want = check.control.between("slide.x", "slide.x")
    assert np.linalg.norm(frf.between("slide.x", "slide.x") - want) < 1e-9 * np.linalg.norm(want)
    small = frozen_receptance(machine, check.frequency, 1e-12).receptance
    assert np.linalg.norm(small - frf.receptance) < 1e-9 * np.linalg.norm(want)


def test_softening_joint_lowers_the_resonance_as_the_tool_amplitude_grows() -> None:
    machine = read_machine(LIBRARY / "paper_sdof.toml")
    lines = np.linspace(500.0, 540.0, 4001)
    for A, expected in ((1e-6, 525.003), (3e-6, 520.866)):
        frf = frozen_receptance(machine, lines, A).between("table.x", "table.x")
        assert lines[np.argmax(np.abs(frf))] == pytest.approx(expected, abs=0.02)


def test_line_that_needs_more_than_the_joint_allows_is_named_and_held_at_the_limit() -> None:
    machine = read_machine(LIBRARY / "two_mass.toml")
    point = operating_point(machine, np.linspace(1000.0, 7000.0, 100), 3e-6)
    held = [i for i, o in enumerate(point.outcomes) if o is Outcome.PAST_FORCE_PEAK]
    assert 0 < len(held) < 100
    limit = np.sqrt(654.164e6 / (3 * 1.7083e18))
    assert point.joint_amplitude[held, 0] == pytest.approx(limit, rel=1e-9)
    assert np.all(np.isfinite(point.frf.receptance))


def test_linear_machine_is_the_same_at_every_amplitude() -> None:
    machine = plane(1).with_joint("a", Joint((Linear(6e8), Viscous(400.0))))
    a, b = (frozen_receptance(machine, LINES, A) for A in (0.0, 1e-5))
    assert a.kind is b.kind is ReceptanceKind.LINEAR
    assert np.array_equal(a.receptance, b.receptance)


def test_rows_may_be_other_dofs_than_the_tool() -> None:
    frf = frozen_receptance(plane(1), LINES, 1e-6, outputs=["base.x", "head.x"])
    assert frf.outputs == ("base.x", "head.x")
    assert frf.inputs == ("head.x", "head.y")
    full = frozen_receptance(plane(1), LINES, 1e-6)
    assert frf.between("head.x", "head.y") == pytest.approx(full.between("head.x", "head.y"), rel=1e-12)


def test_bad_requests_are_refused() -> None:
    machine = plane(1)
    for arguments, words in [
        ((LINES, -1e-6), "at least 0"),
        (([0.0, 1.0], 1e-6), "above 0 Hz"),
        ((LINES, 1e-6, [1.0]), "direction has shape"),
        ((LINES, 1e-6, [0.0, 0.0]), "direction is zero"),
    ]:
        with pytest.raises(InputError, match=words):
            operating_point(machine, *arguments)  # type: ignore[arg-type]
    bare = Machine(machine.components, machine.connections)
    with pytest.raises(InputError, match="no tool point"):
        frozen_receptance(bare, LINES, 1e-6)
