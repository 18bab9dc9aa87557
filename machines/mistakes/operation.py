"""Cutting data and gravity off by a unit, gravity of the wrong sign."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ..components.connection import GROUND
from ..model.machine import Machine
from ..model.masses import part_masses, whole_mass
from .scale import outside

_PRESSURE = (2e7, 2e10)
"""N/m² of chip section, from plastics and light metals at high feed to hardened steel at low feed."""
_LIMITS = {"feed": (1e-7, 5e-3, "mm", 1e3), "diameter": (5e-5, 10.0, "mm", 1e3), "flute_length": (5e-5, 1.0, "mm", 1e3)}
_RATIO = 1e5
_CRAWLS = 20.0
"""m/min of the highest speed below which steel is cut by nothing, and so a remark. Titanium is milled by high-speed
steel at 10 to 20, nickel alloys at 3 to 8; threads are turned at 5 to 20."""
_TURNS = 15.0
"""rpm below which no mill turns; one of 0.5 m has 30 in steel."""
_TRAVEL = 100.0
"""m; the longest portal mills travel 60."""
_FORCE = 1e4
"""N, peak, of what shakes a machine: large shakers have 1 to 3 kN, roughing cuts as much."""
_UNKNOWN = 1e5
"""N that a constant force may have where not all masses are known."""
_SHIM = 5e-3
"""m; parts of 1 m grow by 10 µm for a degree, shims have up to a few mm."""
_EARTH = (9.7, 9.9)
"""m/s² anywhere on the ground."""
_LEVEL = 1e-3
"""m."""


def wrong_operation(machine: Machine) -> Iterator[str]:
    """Values of ``[cutting]``, ``[static]``, ``[response]`` and ``[[axis]]`` out of scale."""
    cutting = machine.cutting or {}
    for key in ("tangential", "specific"):
        if key in cutting:
            said = outside(float(cutting[key]), *_PRESSURE, f"[cutting]: {key}", "N/mm^2", 1e-6)
            yield from filter(None, [said])
    signed = float(cutting.get("normal", 0.0))
    normal = abs(signed)
    if signed < 0:
        yield (
            f"[cutting]: normal is {signed * 1e-6:.4g} N/mm^2, so the cut pulls the teeth into the work instead of "
            "pressing them off, and the limits are those of such a cut; expected more than 0, about a third of "
            "tangential; only a strongly positive rake in soft metal pulls: is its sign right?"
        )
    if 0 < normal < _RATIO and "tangential" in cutting:
        meant = normal * float(cutting["tangential"])
        yield (
            f"[cutting]: normal is {normal:g} N/m^2, next to nothing; expected a pressure as tangential is: if "
            "it was meant "
            f"as a ratio, write {meant:.4g}"
        )
    elif "tangential" in cutting and normal > 3 * float(cutting["tangential"]):
        yield (
            f"[cutting]: normal is {normal / float(cutting['tangential']):.3g} times tangential, expected less "
            "than that"
        )
    for key, (low, high, unit, scale) in _LIMITS.items():
        if cutting.get(key) is not None:
            said = outside(float(cutting[key]), low, high, f"[cutting]: {key}", unit, scale)
            yield from filter(None, [said])
    yield from _slow(cutting)
    yield from _loads(machine)
    if machine.static is not None and machine.static.gravity is not None:
        g = float(np.linalg.norm(machine.static.gravity))
        if g:
            said = outside(g, *_EARTH, "[static]: gravity", "m/s^2")
            yield from filter(None, [said])
    highest = max((abs(float(force)) for force in machine.force), default=0.0)
    if highest > _FORCE:
        yield (f"[response]: a force of {highest:g} N at the tool, expected at most {_FORCE:g} N: is its unit right?")
    for axis in machine.axes:
        low, high = axis.travel or (0.0, 0.0)
        if high - low > _TRAVEL:
            yield (f"axis {axis.name}: it travels {high - low:g} m, expected at most {_TRAVEL:g} m: were mm read as m?")


def _loads(machine: Machine) -> Iterator[str]:
    """Constant forces beyond what cuts press with and balance carries, and offsets that no shim makes."""
    if machine.static is None:
        return
    parts = part_masses(machine)
    known = all(part.mass is not None for part in parts)
    most = max(_FORCE, _EARTH[1] * (whole_mass(tuple(parts)).mass or 0.0)) if known else _UNKNOWN
    for dof, load in machine.static.force.items():
        if abs(load) > most:
            yield (
                f"[static]: a constant force of {load:g} N on {dof}, expected at most {most:.0f} N, as a roughing cut "
                "presses or the machine weighs: is its unit right?"
            )
    for connection, offset in machine.static.offset.items():
        if abs(offset) > _SHIM:
            yield (
                f"[static]: an offset of {offset * 1e3:g} mm in {connection}, expected at most {_SHIM * 1e3:g} mm: is "
                "its unit right?"
            )


def _slow(cutting: Mapping[str, Any]) -> Iterator[str]:
    """Speeds at which no chip is cut, as of revolutions per second."""
    if cutting.get("speed") is None:
        return
    low, high = (float(n) for n in cutting["speed"])
    diameter = cutting.get("diameter")
    if diameter is not None:
        v_low, v_high = (np.pi * float(diameter) * n for n in (low, high))
        slow = v_high < _CRAWLS
        said = f"with a diameter of {float(diameter) * 1e3:g} mm cut at {v_low:.3g} to {v_high:.3g} m/min"
        also = "; as slow are high-speed steel in titanium and nickel alloys, and threads"
    else:
        slow = cutting.get("process") == "milling" and high < _TURNS
        said, also = "are those of no mill", ""
    if slow:
        yield (
            f"[cutting]: speeds of {low:g} to {high:g} rpm {said}, expected 20 to 1000 m/min: were they meant in Hz? "
            f'Then write ["{low:g} Hz", "{high:g} Hz"]{also}'
        )


def hanging(machine: Machine) -> Iterator[str]:
    """A machine below all that joins it to the ground; machines stand. It takes masses and places as they are."""
    g = 0.0 if machine.static is None or machine.static.gravity is None else np.linalg.norm(machine.static.gravity)
    if not g:
        return
    assert machine.static is not None
    down = np.array(machine.static.gravity) / g
    ground = [c.at for c in machine.connections if GROUND in c.between and c.at is not None]
    centre = whole_mass(tuple(part for part in part_masses(machine) if part.centre is not None)).centre
    if not ground or centre is None:
        return
    below = float(np.min((centre - np.array(ground)) @ down))
    if below > _LEVEL:
        along = ", ".join(f"{round(float(x), 3) + 0.0:g}" for x in down)
        yield (
            f"[static]: gravity acts along ({along}), and the centre of gravity lies {below * 1e3:.3g} mm or more "
            "below all that joins the machine to the ground, so that it hangs: is its sign right?"
        )
