"""Mode shapes as they are drawn: the picture follows the degrees of freedom, and shows what the tool feels."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from jointlib.errors import InputError
from machines import Machine, Measured, frozen_receptance, read_machine
from machines.modes.natural_modes import NaturalModes, natural_modes
from machines.view import Scene, scene
from machines.view.mode_shape import Mode
from machines.view.modes import modes_of, shown_modes
from machines.view.page import data
from machines.view.svg import picture

LIBRARY = Path("machines/library")


@pytest.fixture(scope="module")
def lathe() -> Machine:
    return read_machine(LIBRARY / "lathe.toml")


@pytest.fixture(scope="module")
def drawn(lathe: Machine) -> Scene:
    return scene(lathe)


@pytest.fixture(scope="module")
def found(lathe: Machine) -> NaturalModes:
    return natural_modes(lathe)


@pytest.fixture(scope="module")
def shown(drawn: Scene, found: NaturalModes) -> tuple[Mode, ...]:
    return shown_modes(drawn, found)


def test_the_picture_of_a_mode_follows_its_shape(
    lathe: Machine, drawn: Scene, found: NaturalModes, shown: tuple[Mode, ...]
) -> None:
    first = next(i for i, f in enumerate(drawn.frames) if np.allclose(f.origin, [0.0, 1.0, -0.4]) and np.any(f.rows))
    dofs = [lathe.dofs.index(f"spindle.rear.{axis}") for axis in ("x", "y", "z", "rx", "ry", "rz")]
    corners, frame = drawn.corners
    for mode in shown:
        motion = np.linalg.norm(drawn.displaced(corners, frame, mode.moved), axis=1)
        assert np.max(np.abs(drawn.displaced(corners, frame, mode.moved))) == pytest.approx(1.0)
        assert motion[frame == 0].max() == 0.0  # the ground stays
        shape = found.shapes[dofs, mode.number - 1]
        factor = mode.moved[first][0] / shape[0]
        np.testing.assert_allclose(mode.moved[first], factor * shape, rtol=1e-9, atol=1e-12)
        # One factor for the whole machine: the bed moves by it, too.
        np.testing.assert_allclose(mode.moved[1], factor * found.shapes[:6, mode.number - 1], rtol=1e-9, atol=1e-12)


def test_the_mode_that_the_tool_feels_most_is_the_highest_peak_of_its_receptance(
    lathe: Machine, shown: tuple[Mode, ...]
) -> None:
    lines = np.linspace(20.0, 3000.0, 1491)
    size = np.abs(frozen_receptance(lathe, lines, 0.0).receptance[:, 0, 0])
    most = max(shown, key=lambda mode: mode.felt)
    assert most.felt == 1.0
    assert most.frequency == pytest.approx(lines[np.argmax(size)], rel=0.02)
    assert [mode.frequency for mode in shown] == sorted(mode.frequency for mode in shown)


def test_a_mode_that_is_asked_for_is_shown_though_the_tool_does_not_feel_it(
    lathe: Machine, drawn: Scene, found: NaturalModes, shown: tuple[Mode, ...]
) -> None:
    unfelt = next(n for n in range(1, len(found.frequency) + 1) if n not in {mode.number for mode in shown})
    asked = shown_modes(drawn, found, [unfelt])
    assert {mode.number for mode in asked} == {unfelt, *(mode.number for mode in shown)}
    with pytest.raises(InputError, match=r"lathe\.toml: mode 1000, expected 1 to \d+, in ascending frequency"):
        modes_of(lathe, drawn, [1000])


def test_a_machine_known_by_receptances_only_is_drawn_without_modes() -> None:
    lines = np.linspace(50.0, 500.0, 10)
    H = 1e-8 / (1 - (lines / 200.0) ** 2 + 0.04j * lines / 200.0)
    part = Measured("post", ("x",), lines, H[:, None, None])
    carriage = read_machine(LIBRARY / "carriage.toml")
    both = Machine((*carriage.components, part), carriage.connections, tool={"x": "post.x"})
    modes, why = modes_of(both, scene(both))
    assert modes == ()
    assert why.startswith(
        "Its modes are not shown. machine 'machine': component 'post' is known by its receptance only"
    )


def test_the_still_picture_of_a_mode_is_another_than_at_rest(drawn: Scene, shown: tuple[Mode, ...]) -> None:
    most = max(shown, key=lambda mode: mode.felt)
    moved = picture(drawn, 0.08 * drawn.size * most.moved.real, most.name)
    assert most.name in moved
    assert moved.count("stroke='#b6bec8'") > 50  # where it is at rest
    assert "stroke='#b6bec8'" not in picture(drawn)


def test_the_page_has_the_shapes_as_they_are(drawn: Scene, shown: tuple[Mode, ...]) -> None:
    sent = data(drawn, shown)["modes"]
    assert [mode["name"] for mode in sent] == [mode.name for mode in shown]
    for mode, told in zip(shown, sent, strict=True):
        moved = np.array(told["moved"])
        np.testing.assert_allclose(moved[:, :6] + 1j * moved[:, 6:], mode.moved, atol=1e-5)
