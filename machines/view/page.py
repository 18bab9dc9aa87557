"""The picture as HTML: to turn with the mouse, modes in motion, everything in one file and no network."""

from __future__ import annotations

import json
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from jointlib.arrays import Array

from .mode_shape import Mode
from .projection import upright
from .scene import Scene

_HERE = Path(__file__).parent
VIEWER, STYLE = _HERE / "viewer.js", _HERE / "viewer.css"
_DIGITS = 5
"""Of lengths in m and of shapes whose largest displacement is 1."""
_PAGE = (
    "body { margin: 1rem auto; max-width: 80rem; padding: 0 1rem; color: #1b1f24; "
    "font: 15px/1.5 system-ui, 'DejaVu Sans', Arial, sans-serif; } h1 { font-size: 1.4rem; }"
)
_POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'"


def data(scene: Scene, modes: Sequence[Mode] = ()) -> dict[str, Any]:
    """What ``viewer.js`` draws. Shapes are u and ϑ of every frame, real parts then imaginary ones."""
    low, high = scene.box
    pieces = [
        {
            "name": p.name,
            "colour": p.colour,
            "points": _flat(np.column_stack([p.frame, p.corners])),
            "faces": p.faces,
            "lines": p.lines,
            "dots": p.dots,
            "glass": p.glass,
            "width": p.width,
            "backdrop": p.backdrop,
        }
        for p in scene.pieces
    ]
    labels = [
        {"name": label.text, "colour": label.colour, "points": _flat(np.concatenate([[label.frame], label.at]))}
        for label in scene.labels
    ]
    shown = [
        {"name": mode.name, "says": mode.says, "moved": [_flat(np.concatenate([m.real, m.imag])) for m in mode.moved]}
        for mode in modes
    ]
    return {
        "name": scene.name,
        "size": float(np.linalg.norm(high - low)),
        "centre": _flat((low + high) / 2),
        "upright": upright(scene.up).tolist(),
        "frames": [_flat(frame.origin) for frame in scene.frames],
        "pieces": pieces,
        "labels": labels,
        "modes": shown,
    }


def _flat(values: Array) -> list[float | int]:
    """Rounded numbers in a row, whole ones without a point."""
    rounded = (float(x) for x in np.round(values, _DIGITS).ravel())
    return [int(x) if x.is_integer() else x for x in rounded]


def fragment(scene: Scene, modes: Sequence[Mode] = (), start: int = 0) -> str:
    """The picture for a place within a page, which it needs to itself; ``start``: the mode that is shown first."""
    # "</" within a script would end it.
    text = json.dumps(data(scene, modes), ensure_ascii=False, separators=(",", ":")).replace("</", "<\\/")
    return (
        f"<style>{STYLE.read_text('utf-8')}</style>"
        "<div id='machine-view'><noscript>This picture needs JavaScript.</noscript></div>"
        f"<script>{VIEWER.read_text('utf-8')}</script>"
        f"<script>jointlibView(document.getElementById('machine-view'), {text}, {{mode: {int(start)}}});</script>"
    )


def page(scene: Scene, modes: Sequence[Mode] = (), start: int = 0) -> str:
    """A whole file."""
    said = "".join(f"<li>{escape(sentence)}</li>" for sentence in scene.placeless)
    return (
        "<!DOCTYPE html>\n<html lang='en'><head><meta charset='utf-8'>"
        "<meta name='viewport' content='width=device-width, initial-scale=1'>"
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">'
        f"<title>{escape(scene.name)}</title><style>{_PAGE}</style>"
        f"</head><body><h1>{escape(scene.name)}</h1>{fragment(scene, modes, start)}"
        f"{f'<ul>{said}</ul>' if said else ''}</body></html>\n"
    )
