"""Sliders as numbers: positions, locks, bounds."""

from __future__ import annotations

import json

import numpy as np
import pytest

from jointlib.errors import InputError
from machines.explore.controls import Control, shown
from machines.explore.state import STEPS, State, position, value_at

PRELOAD = Control("preload", "preload", "guide", "N", 592.44, 148.0, 2370.0, logarithmic=True)
ANGLE = Control("angle", "contact angle", "guide", "deg", 45.0, 22.5, 90.0)
TEETH = Control("teeth", "teeth", "cutting", "", 4.0, 1.0, 12.0, whole=True)
ALL = (PRELOAD, ANGLE, TEETH)


@pytest.mark.parametrize("control", ALL)
def test_a_slider_runs_from_bound_to_bound_and_never_back(control: Control) -> None:
    values = [value_at(control, place) for place in range(STEPS + 1)]
    assert (values[0], values[-1]) == (control.low, control.high)
    assert np.all(np.diff(values) >= 0)
    assert all(control.checked(value) == value for value in values)


@pytest.mark.parametrize("control", [PRELOAD, ANGLE])
def test_a_position_is_found_again_from_its_value(control: Control) -> None:
    assert [position(control, value_at(control, place)) for place in range(STEPS + 1)] == list(range(STEPS + 1))


def test_equal_steps_of_a_logarithmic_slider_are_equal_ratios() -> None:
    values = np.array([value_at(PRELOAD, place) for place in range(0, STEPS + 1, 20)])
    assert np.diff(np.log(values)) == pytest.approx(np.log(2370 / 148) / 10, rel=0.02)


def test_a_slider_of_whole_numbers_stands_at_whole_numbers() -> None:
    assert {value_at(TEETH, place) for place in range(STEPS + 1)} == set(range(1, 13))


@pytest.mark.parametrize("place", ["left", None, float("nan")])
def test_what_is_no_position_is_refused(place: object) -> None:
    with pytest.raises(InputError, match="is no position of a slider"):
        value_at(ANGLE, place)


def test_what_is_locked_stays_whoever_moves() -> None:
    state = State.start(ALL).moved(PRELOAD, 700.0).toggled("preload")
    assert state.taken({"preload": 300.0, "angle": 60.0}).values == {"preload": 700.0, "angle": 60.0, "teeth": 4.0}
    with pytest.raises(InputError, match="preload: is locked"):
        state.moved(PRELOAD, 300.0)
    assert state.toggled("preload").moved(PRELOAD, 300.0).values["preload"] == 300.0


def test_a_state_survives_the_way_to_the_page_and_back() -> None:
    state = State.start(ALL).moved(PRELOAD, 1 / 3 + 500).toggled("teeth")
    assert State.read(json.loads(json.dumps(state.data(ALL))), ALL) == state


@pytest.mark.parametrize("data", [None, [], {"values": 3}, {"values": {"other": 1.0}}, {"locked": ["other"]}])
def test_a_page_that_sends_nothing_of_use_gets_the_machine_as_it_is(data: object) -> None:
    assert State.read(data, ALL) == State.start(ALL)


@pytest.mark.parametrize("value", [1e9, -1, "much", None, float("nan"), True, [1]])
def test_a_page_that_sends_what_is_out_of_bounds_is_refused(value: object) -> None:
    with pytest.raises(InputError, match="guide, preload"):
        State.read({"values": {"preload": value}}, ALL)


def test_numbers_are_shown_as_people_write_them() -> None:
    assert [shown(v) for v in (592.44, 3.93e-8, 2e10, 0.0)] == ["592.44", "3.93e-8", "2e10", "0"]
