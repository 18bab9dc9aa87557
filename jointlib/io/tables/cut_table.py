"""The ``[cutting]`` table of a measurement of cutting forces, and the keys of it that a record has of its own."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from jointlib.cutting_force.cut import MODES, PROCESSES, Cut
from jointlib.errors import InputError
from jointlib.io.toml import Section
from jointlib.measurement import FORCES

ACTS_ON = ("tool", "workpiece")
_MILLING = ("teeth", "mode", "immersion", "helix")
_NEEDED = {"milling": ("speed", "depth", "feed", "teeth", "mode"), "turning": ("speed", "depth", "feed")}


def operation_of(section: Section, kind: str) -> tuple[str, dict[str, Any]]:
    """What feels the force that is told, and the keys of the cut that all records share."""
    acts_on = section.text("acts_on", "tool", choices=ACTS_ON) if kind == FORCES else "tool"
    found = acts_on, cut_keys(section)
    section.done()
    return found


def cut_keys(section: Section) -> dict[str, Any]:
    """The keys of a cut that stand in a table, in SI with the speed in rpm."""
    found: dict[str, Any] = {}
    if section.has("process"):
        found["process"] = section.text("process", choices=PROCESSES)
    if section.has("teeth"):
        found["teeth"] = section.integer("teeth", lower=1, upper=1000)
    if section.has("mode"):
        found["mode"] = section.text("mode", choices=MODES)
    if section.has("immersion"):
        found["immersion"] = section.number("immersion", "1")
    if section.has("speed"):
        found["speed"] = section.number("speed", "rpm")
    if section.has("depth"):
        found["depth"] = section.number("depth", "m")
    if section.has("feed"):
        found["feed"] = section.number("feed", "m")
    if section.has("diameter"):
        found["diameter"] = section.number("diameter", "m")
    if section.has("helix"):
        found["helix"] = section.number("helix", "deg")
    return found


def cut_of(section: Section, shared: Mapping[str, Any]) -> Cut | None:
    """The cut of one record: its own keys over those of the file; what is wrong with it is told at the record."""
    own = {**shared, **cut_keys(section)}
    process = own.setdefault("process", "milling")
    said = [
        f"{key} is missing, expected it in [cutting] or in the record" for key in _NEEDED[process] if key not in own
    ]
    if process == "turning":
        said += [f"{key} belongs to milling, expected a turned cut without it" for key in _MILLING if key in own]
    elif own.get("mode") in ("up", "down") and "immersion" not in own:
        said.append("immersion is missing, expected a/D of the cut in [cutting] or in the record")
    elif own.get("mode") == "slot" and own.setdefault("immersion", 1.0) != 1:
        said.append(f"immersion is {own['immersion']:g}, but a slot is cut at 1; expected none")
    if not said:
        try:
            return Cut(**own)
        except InputError as error:
            said = list(error.sentences)
    for one in said:
        section.fault(one)
    return None
