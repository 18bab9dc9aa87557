"""What the page keeps and sends, checked: where every slider stands, which are locked, what is done to them.

The server forgets it after each answer. A page sends nothing else; another program on this computer may.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from jointlib.errors import InputError, told

from .controls import Control

STEPS = 200
"""Positions of a slider, so that an arrow key moves it by half a per cent of its range."""
_NUMBER = (int, float)
_OF_ONE: Mapping[str, Mapping[str, Any]] = {
    "move": {"position": _NUMBER},
    "field": {"text": str},
    "lock": {},
    "reset": {},
}
_OF_ALL: Mapping[str, Mapping[str, Any]] = {"wish": {"values": dict, "words": str}, "back": {}, "reset-all": {}}
"""Actions on one control, and on all of them, with what else each says."""


@dataclass(frozen=True)
class State:
    """Values in the units of their controls, by key, and the keys that must not move."""

    values: Mapping[str, float]
    locked: frozenset[str] = frozenset()

    @classmethod
    def start(cls, controls: Sequence[Control]) -> State:
        """The machine as its file has it."""
        return cls({c.key: c.value for c in controls})

    @classmethod
    def read(cls, data: Any, controls: Sequence[Control]) -> State:
        """What a page sends, checked; what it leaves out is as in the file."""
        given = data if isinstance(data, dict) else {}
        values = given.get("values")
        locked = given.get("locked")
        known = {c.key: c for c in controls}
        start = {c.key: c.value for c in controls}
        if isinstance(values, dict):
            # A value of the file may lie anywhere; what was moved must be within the bounds.
            start |= {k: v if v == known[k].value else known[k].checked(v) for k, v in values.items() if k in known}
        return cls(start, frozenset(key for key in known if isinstance(locked, list) and key in locked))

    def data(self, controls: Sequence[Control]) -> dict[str, Any]:
        """The same for the page, with the positions of the sliders and the texts of the fields in their order."""
        return {
            "values": dict(self.values),
            "locked": sorted(self.locked),
            "order": [position(c, self.values[c.key]) for c in controls],
            "texts": [c.told(self.values[c.key]) for c in controls],
        }

    def toggled(self, key: str) -> State:
        """Locked if it was free, free if it was locked."""
        return replace(self, locked=self.locked ^ {key})

    def moved(self, control: Control, value: object) -> State:
        """One slider elsewhere; a locked one is refused."""
        if control.key in self.locked:
            raise InputError(f"{control.label}: is locked, unlock it first")
        return replace(self, values={**self.values, control.key: control.checked(value)})

    def taken(self, wish: Mapping[str, float]) -> State:
        """All that is free moved to the wish, all that is locked left."""
        return replace(self, values={k: v if k in self.locked else wish.get(k, v) for k, v in self.values.items()})


def position(control: Control, value: float) -> int:
    """Where the slider stands that shows a value, 0 to ``STEPS``."""
    low, high = control.low, control.high
    if control.logarithmic:
        value, low, high = (math.log(max(v, control.low)) for v in (value, low, high))
    share = (value - low) / (high - low) if high > low else 0.0
    return min(max(round(share * STEPS), 0), STEPS)


def value_at(control: Control, place: object) -> float:
    """The value that a slider stands for; rounded to what its step can tell, within the bounds."""
    if not isinstance(place, int | float) or not math.isfinite(place):
        raise InputError(f"{control.label}: {place!r} is no position of a slider, expected 0 to {STEPS}")
    share = min(max(place / STEPS, 0.0), 1.0)
    low, high = control.low, control.high
    if control.logarithmic:
        value = low * (high / low) ** share
        step = value * ((high / low) ** (1 / STEPS) - 1)
    else:
        value = low + share * (high - low)
        step = (high - low) / STEPS
    if control.whole:
        value = round(value)
    elif step > 0:
        value = round(value, 1 - math.floor(math.log10(step)))
    return float(min(max(value, low), high))


def entries(data: Any, what: str, /, **kinds: Any) -> dict[str, Any]:
    """A table that was sent, refused unless it has these keys with values of these kinds; numbers are finite ones."""
    given = data if isinstance(data, dict) else {}
    if not all(key in given and _is(given[key], kind) for key, kind in kinds.items()):
        raise InputError(f"{what}: {told(repr(data)[:80])}, expected what the page sends")
    return given


def _is(value: Any, kind: Any) -> bool:
    if isinstance(value, bool):
        return kind is bool
    return isinstance(value, kind) and (not isinstance(value, int | float) or abs(value) < 1e300)


def number_sent(value: Any, what: str) -> float:
    """A finite number that was sent."""
    return float(entries({"is": value}, what, **{"is": _NUMBER})["is"])


def point_sent(click: Any, key: str) -> Any:
    """The number under a key of the first point that was clicked on; None where it has none."""
    points = entries(click, "click", points=list)["points"]
    first = entries(points[0], "click") if points else {}
    return number_sent(first[key], "click") if key in first else None


def action_sent(data: Any, controls: Sequence[Control]) -> dict[str, Any]:
    """What is done to the sliders: of one control by its number, or of all."""
    action = entries(data, "action", kind=str, serial=int)
    number = action.get("control")
    kinds = _OF_ALL if number is None else _OF_ONE
    known = number is None or (_is(number, int) and 0 <= number < len(controls))
    if not known or action["kind"] not in kinds:
        raise InputError(f"action: {told(repr(data)[:80])}, expected what the page sends")
    return entries(action, "action", **kinds[action["kind"]])


def order_sent(data: Any, *words: str) -> dict[str, Any]:
    """What is to be done once the sliders are where the page has them: one of these words."""
    order = entries(data, "order", what=str)
    if order["what"] not in words:
        raise InputError(f"order: {order['what'][:40]!r}, expected one of {', '.join(words)}")
    return order
