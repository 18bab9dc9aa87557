"""Looking at a machine from far away: directions of a view, and what lies in front."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array

_AZIMUTH, _ELEVATION = np.radians(35.0), np.radians(24.0)


@dataclass(frozen=True, eq=False)
class View:
    """An orthographic view; ``axes`` has the unit vectors to the right, into the picture and upwards as rows."""

    name: str
    axes: Array

    def seen(self, corners: Array) -> Array:
        """Right, depth and up (n, 3) of points, m."""
        return np.asarray(corners @ self.axes.T)


def upright(up: Array) -> Array:
    """To the right, into the picture and upwards, along machine axes: x, y and z where z points upwards."""
    right = np.eye(3)[(int(np.argmax(np.abs(up))) + 1) % 3]
    return np.array([right, np.cross(up, right), up])


def views(up: Array) -> tuple[View, ...]:
    """One from above and aside, then the three along the axes."""
    right, into, up = upright(up)
    level = np.cos(_AZIMUTH) * into - np.sin(_AZIMUTH) * right
    aside = np.cross(level, up)
    forward = np.cos(_ELEVATION) * level - np.sin(_ELEVATION) * up
    return (
        View("", np.array([aside, forward, np.cross(aside, forward)])),
        View(f"along {axis_words(into)}", np.array([right, into, up])),
        View(f"along {axis_words(-right)}", np.array([into, -right, up])),
        View(f"along {axis_words(-up)}", np.array([right, -up, into])),
    )


def axis_words(direction: Array) -> str:
    """``+y`` or ``-z`` of a machine axis."""
    axis = int(np.argmax(np.abs(direction)))
    return ("+" if direction[axis] > 0 else "−") + "xyz"[axis]


def normals(corners: Array, faces: tuple[tuple[int, ...], ...]) -> Array:
    """Outward unit normals (faces, 3); zero of a face that has no area."""
    if not faces:
        return np.zeros((0, 3))
    a, b, c = (np.array([corners[face[i]] for face in faces]) for i in (0, 1, 2))
    d = np.array([corners[face[3 % len(face)]] for face in faces])
    n = np.cross(b - a, c - a) + np.cross(c - a, d - a)
    size = np.linalg.norm(n, axis=1, keepdims=True)
    return np.asarray(np.divide(n, size, out=np.zeros_like(n), where=size > 0))
