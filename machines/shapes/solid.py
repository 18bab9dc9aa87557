"""Solids to look at: closed surfaces of flat faces, whose corners go with frames that may move."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array

from ..indices import Index

SIDES = 16
"""Corners of a circle."""
_BOX = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


@dataclass(frozen=True, eq=False)
class Solid:
    """Corners (n, 3) in m and faces, each the numbers of its corners, counter-clockwise seen from outside.

    ``frame`` tells the frame that every corner goes with, (n,): of a bundle 0 is its first side and 1 its second, of a
    component they are those of its `Drawn`.
    """

    corners: Array
    faces: tuple[tuple[int, ...], ...]
    frame: Index
    runs: bool = False
    """Whether it is a rail, which reaches as far along the bundle's first axis as the other side travels."""

    def placed(self, at: Array, axes: Array) -> Solid:
        """The same solid, drawn in axes (rows, unit vectors) about a point."""
        return Solid(at + self.corners @ axes, self.faces, self.frame, self.runs)


def block(centre: Sequence[float] | Array, size: Sequence[float] | Array, frame: int = 0, runs: bool = False) -> Solid:
    """A box of edges ``size`` (m) along the axes."""
    signs = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    return Solid(np.asarray(centre) + signs * np.asarray(size), _BOX, np.full(8, frame), runs)


def between_sections(rings: Array, frames: Sequence[int], closed: bool = True) -> Solid:
    """The surface over sections (m, k, 3) of k corners one after the other, each going with its frame.

    Corners run round the axis counter-clockwise for who looks against it.
    """
    m, k = rings.shape[:2]
    step = [(i, (i + 1) % k) for i in range(k)]
    faces: list[tuple[int, ...]] = [
        (r * k + i, r * k + j, (r + 1) * k + j, (r + 1) * k + i) for r in range(m - 1) for i, j in step
    ]
    if closed:
        faces += [tuple(reversed(range(k))), tuple(range((m - 1) * k, m * k))]
    return Solid(rings.reshape(-1, 3), tuple(faces), np.repeat(np.array(frames, dtype=int), k))


def circle(radius: float) -> Array:
    """Corners (sides, 2) of a circle about the axis, in its two normals."""
    angle = 2 * np.pi * np.arange(SIDES) / SIDES
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def bar(start: float, end: float, radius: float, frame: int = 0, to: float | None = None, pieces: int = 1) -> Solid:
    """A round bar along the first axis from ``start`` to ``end``, or a cone that ends with another radius (m).

    Long ones are drawn in pieces: what is in front of what is decided face by face.
    """
    places = np.linspace(start, end, pieces + 1)
    radii = np.linspace(radius, radius if to is None else to, pieces + 1)
    return between_sections(_rings(places.tolist(), radii.tolist()), (frame,) * len(places))


def rail(start: float, end: float, section: Array, frame: int, pieces: int) -> Solid:
    """A rail along the first axis of a cross-section (k, 2) in m, in pieces."""
    places = np.linspace(start, end, pieces + 1)
    rings = np.array([np.column_stack([np.full(len(section), x), section]) for x in places])
    return between_sections(rings, (frame,) * len(places))


def ring(start: float, end: float, radius: float, bore: float, frame: int = 0) -> Solid:
    """A ring about the first axis: out along its radius and back through its bore (m)."""
    rings = _rings((start, end, end, start, start), (radius, radius, bore, bore, radius))
    return between_sections(rings, (frame,) * 5, closed=False)


def _rings(places: Sequence[float], radii: Sequence[float]) -> Array:
    return np.array([np.column_stack([np.full(SIDES, x), circle(r)]) for x, r in zip(places, radii, strict=True)])
