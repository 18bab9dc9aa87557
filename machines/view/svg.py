"""A still picture: one view from aside and the three along the axes, as SVG text."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterable, Iterator, Sequence
from html import escape

import numpy as np

from jointlib.arrays import Array

from .marks import length_words, round_length
from .piece import INK, Piece
from .projection import View, normals, views
from .scene import Scene

WIDTH, _HEIGHT, _TALL = 1180, 980, 610
_SIDE = 380
"""Width of the column of names."""
_MARGIN = 30
_LIGHT = np.array([-0.35, -0.75, 0.55]) / np.linalg.norm([-0.35, -0.75, 0.55])
SOFT = "#57606a"
_NEAR = ((10, -8), (10, 16), (-10, -8), (-10, 16), (14, -26), (14, 34), (-14, -26), (-14, 34), (20, -44), (20, 52))
"""Where a name may stand beside its point, px."""


def picture(scene: Scene, moved: Array | None = None, title: str = "") -> str:
    """The machine as it stands, or displaced by u and ϑ (frames, 6) of its frames with what it was behind it."""
    corners = [
        p.corners if moved is None else p.corners + scene.displaced(p.corners, p.frame, moved) for p in scene.pieces
    ]
    whole, *flat = views(scene.up)
    parts = [
        f"<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {WIDTH} {_HEIGHT}' width='{WIDTH}' height='{_HEIGHT}' "
        f"role='img' aria-label='{escape(title or scene.name)}'>",
        f"<rect width='{WIDTH}' height='{_HEIGHT}' fill='#fff'/>",
        _text(20, 30, title or scene.name, 17, more="font-weight='bold'"),
        *_drawn(scene, whole, corners, (10, 40, WIDTH - _SIDE, _TALL), moved, True),
        *_triad(whole, 60, _TALL - 6),
        *_legend(scene),
    ]
    width, top = WIDTH / 3, _TALL + 50
    scale = min(_scale(scene, view, corners, (width, _HEIGHT - top - 46)) for view in flat)
    for number, view in enumerate(flat):
        area = (number * width, top, width, _HEIGHT - top - 46)
        parts += _drawn(scene, view, corners, area, moved, False, scale)
        parts.append(_text(number * width + 20, top, f"seen {view.name}", colour=SOFT))
    parts += [*_bar(scale), "</svg>"]
    return "\n".join(parts)


def _scale(scene: Scene, view: View, corners: Sequence[Array], area: tuple[float, float]) -> float:
    """px/m at which everything fits."""
    seen = view.seen(np.concatenate([c for c, p in zip(corners, scene.pieces, strict=True) if not p.backdrop]))
    across, high = np.ptp(seen[:, 0]), np.ptp(seen[:, 2])
    return float(min((area[0] - 2 * _MARGIN) / max(across, 1e-9), (area[1] - 2 * _MARGIN) / max(high, 1e-9)))


def _drawn(
    scene: Scene,
    view: View,
    corners: Sequence[Array],
    area: tuple[float, float, float, float],
    moved: Array | None,
    names: bool,
    scale: float | None = None,
) -> Iterator[str]:
    """One view within left, top, width and height (px)."""
    left, top, width, height = area
    scale = scale or _scale(scene, view, corners, (width, height))
    seen = view.seen(np.concatenate([c for c, p in zip(corners, scene.pieces, strict=True) if not p.backdrop]))
    middle = (np.min(seen, axis=0) + np.max(seen, axis=0)) / 2

    def placed(points: Array) -> Array:
        at = view.seen(points) - middle
        return np.column_stack([left + width / 2 + scale * at[:, 0], top + height / 2 - scale * at[:, 2], at[:, 1]])

    # What lies behind comes first: the floor, the far sides of what is seen through, all else, the near sides.
    layers: tuple[list[tuple[float, str]], ...] = ([], [], [], [], [])
    for piece, now in zip(scene.pieces, corners, strict=True):
        at = placed(now)
        if piece.backdrop:
            if names:
                layers[0].extend(_lines(piece, at, 1.0))
            continue
        if moved is not None and piece.faces and not np.array_equal(now, piece.corners):
            layers[0].extend(_ghost(piece, placed(piece.corners)))
        facing = normals(now, piece.faces) @ view.axes.T
        points, depth = _points(at), at[:, 2].tolist()
        for face, into, bright in zip(piece.faces, facing[:, 1].tolist(), (facing @ _LIGHT).tolist(), strict=True):
            near = into < 0
            if near or piece.glass:
                layer = 2 if not piece.glass else 3 if near else 1
                text = _face(piece, " ".join(points[i] for i in face), bright, near)
                layers[layer].append((sum(depth[i] for i in face) / len(face), text))
        above = not piece.faces and piece.width > 1.5
        layers[3 if piece.glass else 4 if above else 2].extend(_lines(piece, at, 0.6 if piece.glass else 1.0))
    for shown in layers:
        yield from (text for _, text in sorted(shown, key=lambda item: -item[0]))
    if names:
        yield from _names(scene, placed, moved)


def _points(at: Array) -> list[str]:
    return [f"{x:.1f},{y:.1f}" for x, y in at[:, :2].tolist()]


def _face(piece: Piece, points: str, bright: float, near: bool) -> str:
    if piece.glass:
        return f"<polygon points='{points}' fill='{piece.colour}' fill-opacity='{0.13 if near else 0.08}'/>"
    fill = shaded(piece.colour, bright)
    return f"<polygon points='{points}' fill='{fill}' stroke='{fill}' stroke-width='.4'/>"


def shaded(colour: str, towards: float) -> str:
    """A colour as it looks where its normal has this cosine to the light."""
    bright = 0.66 + 0.34 * max(towards, 0.0)
    return "#" + "".join(f"{round(int(colour[i : i + 2], 16) * bright):02x}" for i in (1, 3, 5))


def _lines(piece: Piece, at: Array, opacity: float) -> Iterator[tuple[float, str]]:
    points, depth = _points(at), at[:, 2].tolist()
    for line in piece.lines:
        text = _polyline((points[i] for i in line), piece.colour, piece.width, opacity)
        yield sum(depth[i] for i in line) / len(line), text
    for i in piece.dots:
        yield depth[i], f"<circle cx='{at[i, 0]:.1f}' cy='{at[i, 1]:.1f}' r='3.2' fill='{piece.colour}'/>"


def _ghost(piece: Piece, at: Array) -> Iterator[tuple[float, str]]:
    """The outline of a piece where it is at rest."""
    points = _points(at)
    for line in piece.lines or tuple((*face, face[0]) for face in piece.faces if len(face) > 4):
        yield float("inf"), _polyline((points[i] for i in line), "#b6bec8", 0.6)


def _polyline(points: Iterable[str], colour: str, width: float, opacity: float = 1.0) -> str:
    return (
        f"<polyline points='{' '.join(points)}' fill='none' stroke='{colour}' stroke-width='{width:g}' "
        f"stroke-opacity='{opacity:g}' stroke-linejoin='round'/>"
    )


def _text(x: float, y: float, words: str, size: int = 12, colour: str = INK, more: str = "") -> str:
    return (
        f"<text x='{x:.1f}' y='{y:.1f}' font-family='DejaVu Sans, Arial, sans-serif' font-size='{size}' "
        f"fill='{colour}' {more}>{escape(words)}</text>"
    )


def _names(scene: Scene, placed: Callable[[Array], Array], moved: Array | None) -> Iterator[str]:
    """Names beside their points, none over another."""
    if not scene.labels:
        return
    taken: list[tuple[float, float, float, float]] = []
    at, frame = np.array([one.at for one in scene.labels]), np.array([one.frame for one in scene.labels])
    seen = placed(at if moved is None else at + scene.displaced(at, frame, moved))
    for number in np.argsort(seen[:, 1]):
        label, (x, y, _) = scene.labels[number], seen[number]
        wide = 7.4 * len(label.text)
        spots = [(x + dx - (wide if dx < 0 else 0.0), y + dy) for dx, dy in _NEAR]
        boxes = [(a - 2, b - 12, a + wide + 2, b + 4) for a, b in spots]
        free = [i for i, box in enumerate(boxes) if not any(_overlap(box, other) for other in taken)]
        (a, b), box = (spots[free[0]], boxes[free[0]]) if free else (spots[0], boxes[0])
        taken.append(box)
        end = a if a > x else a + wide
        yield _polyline((f"{x:.1f},{y:.1f}", f"{end:.1f},{b - 4:.1f}"), label.colour, 0.6)
        yield _text(a, b, label.text, colour=label.colour, more="stroke='#fff' stroke-width='3' paint-order='stroke'")


def _overlap(one: tuple[float, ...], other: tuple[float, ...]) -> bool:
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]


def _triad(view: View, x: float, y: float) -> Iterator[str]:
    """The machine axes as they lie in a view."""
    for name, axis in zip("xyz", view.seen(np.eye(3)), strict=True):
        a, b = x + 34 * axis[0], y - 34 * axis[2]
        yield _polyline((f"{x},{y}", f"{a:.1f},{b:.1f}"), INK, 1.4)
        yield _text(x + 46 * axis[0] - 4, y - 46 * axis[2] + 4, name)


def _bar(scale: float) -> Iterator[str]:
    """The length of the views along the axes."""
    length = round_length(200 / scale)
    end, y = 20 + scale * length, _HEIGHT - 24
    yield f"<path d='M20,{y - 5} V{y} H{end:.1f} V{y - 5}' fill='none' stroke='{INK}' stroke-width='1.2'/>"
    yield _text(end + 8, y, length_words(length))


def _legend(scene: Scene) -> Iterator[str]:
    """Colours of the components, and what could not be drawn."""
    x, y, known = WIDTH - _SIDE + 20, 66, dict[str, Piece]()
    for piece in scene.pieces:
        if piece.owner in {label.text for label in scene.labels}:
            known.setdefault(piece.owner, piece)
    for piece in known.values():
        yield f"<rect x='{x}' y='{y - 10}' width='12' height='12' fill='{piece.colour}'/>"
        yield _text(x + 20, y, piece.name)
        y += 19
    y += 8
    for sentence in scene.placeless:
        for text in textwrap.wrap(sentence, 54):
            if y > _TALL:
                yield _text(x, y, "…", 11, SOFT)
                return
            yield _text(x, y, text, 11, SOFT)
            y += 15
        y += 4
