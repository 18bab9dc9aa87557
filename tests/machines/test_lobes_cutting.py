"""The cutting table: arcs, mean stiffness, and what it refuses."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad_vec

from jointlib.errors import InputError
from machines.lobes import Cutting

MILLING: dict[str, Any] = {
    "process": "milling",
    "teeth": 2,
    "tangential": 6e8,
    "normal": 2e8,
    "mode": "down",
    "immersion": 0.5,
    "feed": 1e-4,
    "speed": [4000, 25000],
    "exponent": 1.0,
}
TURNING: dict[str, Any] = {"process": "turning", "specific": 1e9}


def milling(**changes: Any) -> Cutting:
    fields = {**MILLING, **changes}
    return Cutting(**{key: value for key, value in fields.items() if value is not None})


@pytest.mark.parametrize("immersion", [0.05, 0.25, 0.5, 0.9, 1.0])
def test_arc_of_cut_spans_the_radial_immersion(immersion: float) -> None:
    """A tooth at angle φ stands at y = (D/2)·cos φ; the cut reaches a from the edge of the tool."""
    up, down = milling(mode="up", immersion=immersion), milling(mode="down", immersion=immersion)
    assert (1 - np.cos(up.exit_angle)) / 2 == pytest.approx(immersion, rel=1e-12)
    assert (1 + np.cos(down.entry_angle)) / 2 == pytest.approx(immersion, rel=1e-12)
    assert (up.entry_angle, down.exit_angle) == (0.0, np.pi)
    assert up.exit_angle - up.entry_angle == pytest.approx(down.exit_angle - down.entry_angle, rel=1e-12)


def test_slot_cuts_half_a_turn() -> None:
    slot = milling(mode="slot", immersion=None)
    assert (slot.entry_angle, slot.exit_angle) == (0.0, np.pi)
    assert slot.mean_stiffness == pytest.approx(milling(mode="up", immersion=1.0).mean_stiffness, rel=1e-12)


@pytest.mark.parametrize(("mode", "immersion"), [("slot", None), ("up", 0.3), ("down", 0.1)])
def test_mean_stiffness_is_the_tooth_force_averaged_over_a_turn(mode: str, immersion: float | None) -> None:
    cutting, K_t, K_n = milling(mode=mode, immersion=immersion, teeth=3), 6e8, 2e8

    def tooth(angle: float) -> Any:
        radial, tangent = np.array([np.sin(angle), np.cos(angle)]), np.array([np.cos(angle), -np.sin(angle)])
        return np.outer(K_t * tangent + K_n * radial, radial)

    integral, _ = quad_vec(tooth, cutting.entry_angle, cutting.exit_angle, epsrel=1e-12)
    assert cutting.mean_stiffness == pytest.approx(3 / (2 * np.pi) * integral, rel=1e-10)


def test_slot_with_two_teeth_always_has_a_tooth_in_the_cut() -> None:
    assert not milling(mode="slot", immersion=None).interrupted
    assert milling(immersion=0.5).interrupted
    assert not milling(immersion=0.5, teeth=4).interrupted
    assert not Cutting(**TURNING).interrupted


def test_range_of_speeds_comes_from_the_table() -> None:
    assert milling().speeds(3).tolist() == [4000.0, 14500.0, 25000.0]
    with pytest.raises(InputError, match="no range of spindle speeds"):
        Cutting(**TURNING).speeds()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"process": "miling"}, "process is 'miling', did you mean 'milling'"),
        ({"process": None}, "'process' is missing"),
        ({"mode": "dawn"}, "did you mean 'down'"),
        ({"teeth": None}, "milling needs 'teeth'"),
        ({"immersion": None}, "milling needs 'immersion'"),
        ({"teeth": 2.5}, "expected a whole number"),
        ({"teeth": 0}, "expected a whole number"),
        ({"teeth": True}, "expected a whole number"),
        ({"tangential": -6e8}, "tangential is -600000000.0, expected more than 0"),
        ({"tangential": "6e8"}, "tangential is '6e8', expected a finite number"),
        ({"normal": float("nan")}, "normal is nan, expected a finite number"),
        ({"immersion": 0.0}, "immersion is 0.0, expected more than 0"),
        ({"immersion": 1.5}, "expected a/D of at most 1"),
        ({"mode": "slot"}, "a slot is cut at 1"),
        ({"specific": 1e9}, "'specific' belongs to turning"),
        ({"speed": [25000, 4000]}, "expected 0 < low < high"),
        ({"speed": 4000}, "speed is 4000, expected"),
        ({"feed": -1e-4}, "feed is -0.0001, expected more than 0"),
        ({"exponent": 0}, "exponent is 0, expected more than 0"),
    ],
)
def test_milling_table_that_makes_no_sense_is_refused(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=r"^\[cutting\]: ") as caught:
        milling(**changes)
    assert words in str(caught.value)


def test_turning_table_that_makes_no_sense_is_refused() -> None:
    with pytest.raises(InputError, match="turning needs 'specific'"):
        Cutting("turning")
    with pytest.raises(InputError, match="'teeth' belongs to milling"):
        Cutting(**TURNING, teeth=2)
    with pytest.raises(InputError, match="an entry angle was asked of turning"):
        _ = Cutting(**TURNING).entry_angle
