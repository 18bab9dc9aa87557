"""Terminals of an FMU: which variables belong together at one place, and the picture of the block."""

from __future__ import annotations

import struct
import zlib
from xml.etree import ElementTree

import numpy as np

from jointlib.arrays import Array

from ..system.step_limit import operating_range
from ..system.system import Signal, System, prefixed

TERMINALS = "terminalsAndIcons/terminalsAndIcons.xml"
ICON = {2: "model.png", 3: "terminalsAndIcons/icon.png"}
"""Where either version of the standard looks for the picture."""
_MEMBERS = ("displacement", "velocity", "force")
_KINDS = ("org.jointlib.translation", "org.jointlib.rotation")
_SIZE = 96
_WHITE, _GREY, _BLUE = (255, 255, 255), (170, 170, 170), (31, 94, 168)


def terminals_text(system: System) -> str:
    """terminalsAndIcons.xml of FMI 3.0: displacement, velocity and force of each place that the FMU is joined at.

    FMI 2.0 leaves additional folders to the exporter; the same file stands there in the same place.
    """
    found: dict[str, dict[str, Signal]] = {}
    joints = {prefix for prefix, _ in system.joints}
    ports = {place for s in system.inputs for m in _MEMBERS if (place := _place(s.name, m)) is not None}
    for signal in (*system.inputs, *system.outputs):
        for member in _MEMBERS:
            place = _place(signal.name, member)
            if place is not None:
                # A connection may be called x, as an axis of the tool is.
                both = place in joints & ports and signal.name == prefixed(place, member)
                found.setdefault(f"{place} (joint)" if both else place, {})[member] = signal
    root = ElementTree.Element("fmiTerminalsAndIcons", fmiVersion="3.0")
    graphics = ElementTree.SubElement(root, "GraphicalRepresentation")
    corners = {"x1": "-100", "y1": "-100", "x2": "100", "y2": "100"}
    ElementTree.SubElement(graphics, "CoordinateSystem", {**corners, "suggestedScalingFactorTo_mm": "0.1"})
    ElementTree.SubElement(graphics, "Icon", corners)
    listed = ElementTree.SubElement(root, "Terminals")
    for place, members in found.items():
        turns = any(signal.unit.startswith("rad") for signal in members.values())
        about = {"name": place, "matchingRule": "plug", "terminalKind": _KINDS[turns]}
        terminal = ElementTree.SubElement(listed, "Terminal", about)
        for member in _MEMBERS:
            if member in members:
                told = {"variableName": system.shown(members[member].name), "memberName": member}
                ElementTree.SubElement(terminal, "TerminalMemberVariable", {**told, "variableKind": "signal"})
    ElementTree.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _place(name: str, member: str) -> str | None:
    """Where a signal belongs: ``x`` of ``force_x``, ``guide`` of ``guide.force``, ``joint`` of ``force``."""
    plain = name.strip("'")
    if plain == member:
        return "joint"
    if plain.startswith(f"{member}_"):
        return plain.removeprefix(f"{member}_")
    return name.removesuffix(f".{member}") if name.endswith(f".{member}") else None


def icon(system: System) -> bytes:
    """A picture of the block as PNG, the same bytes every time: force over displacement, or masses between springs."""
    canvas = np.empty((_SIZE, _SIZE, 3), dtype=np.uint8)
    canvas[:] = _WHITE
    edge, middle = _SIZE - 1, _SIZE // 2
    canvas[[0, edge]] = canvas[:, [0, edge]] = _GREY
    canvas[middle, 4:-4] = canvas[4:-4, middle] = _GREY
    if system.states or len(system.joints) != 1:
        for low in (14, 58):
            canvas[middle - 12 : middle + 12, low : low + 24] = _BLUE
        _line(canvas, np.linspace(38, 58, 9), middle + 6.0 * np.array([0, 0, 1, -1, 1, -1, 1, 0, 0]))
        return _png(canvas)
    joint = system.joints[0][1]
    over = operating_range(joint)
    angle = np.linspace(0, 2.5 * np.pi, 161)
    z, v = np.sin(angle), np.cos(angle)
    force = joint.force_along(over.amplitude * z, over.velocity * 1e-3 * v, 1e-4)
    largest = float(np.max(np.abs(force[np.isfinite(force)]), initial=0.0)) or 1.0
    _line(canvas, middle + 40 * z, middle - 40 * np.clip(np.nan_to_num(force) / largest, -1, 1))
    return _png(canvas)


def _line(canvas: np.ndarray, x: Array, y: Array) -> None:
    for k in range(len(x) - 1):
        for t in np.linspace(0, 1, 60):
            i, j = round(float(y[k] + t * (y[k + 1] - y[k]))), round(float(x[k] + t * (x[k + 1] - x[k])))
            canvas[i : i + 2, j : j + 2] = _BLUE


def _png(canvas: np.ndarray) -> bytes:
    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = b"".join(b"\0" + row.tobytes() for row in canvas)
    head = struct.pack(">IIBBBBB", canvas.shape[1], canvas.shape[0], 8, 2, 0, 0, 0)
    packed = zlib.compress(rows, 9)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", packed) + chunk(b"IEND", b"")
