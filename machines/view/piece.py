"""Pieces of a picture, and their colours."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array

from ..indices import Index

COLOURS = (
    *("#4477aa", "#cc8800", "#228833", "#aa3377", "#66aacc", "#996633", "#7755bb", "#cc5544", "#558877", "#999933"),
    *("#bb8899", "#ee77ee", "#663344", "#ff4477", "#0088ff", "#00bb99", "#880088", "#aa99dd", "#335500", "#990033"),
)
"""Of components, in their order."""
INK, STEEL, DARK = "#1b1f24", "#8b949e", "#57606a"
JOINT, RIGID, GROUND, TOOL, DRIVE, TRAVEL = "#b45309", "#1b1f24", "#6b7280", "#c2410c", "#0f766e", "#6d28d9"


@dataclass(frozen=True, eq=False)
class Piece:
    """Faces and lines of one colour; ``corners`` (n, 3) in m, ``frame`` (n,) the frame that each goes with."""

    name: str
    """What it is, in words."""
    owner: str
    """Component, connection, bundle or axis that it belongs to."""
    colour: str
    corners: Array
    frame: Index
    faces: tuple[tuple[int, ...], ...] = ()
    lines: tuple[tuple[int, ...], ...] = ()
    """Open lines, each the numbers of its corners."""
    dots: tuple[int, ...] = ()
    glass: bool = False
    """Whether what lies behind is seen through it."""
    width: float = 1.0
    """Of lines, in pixels."""
    backdrop: bool = False
    """Whether it is no part of the machine."""


@dataclass(frozen=True, eq=False)
class Label:
    """A name at a point in m that goes with a frame."""

    text: str
    at: Array
    frame: int
    colour: str = INK


def line(name: str, owner: str, colour: str, corners: Array, frame: int | Index, width: float = 1.0) -> Piece:
    """One open line."""
    frames = np.broadcast_to(np.asarray(frame), (len(corners),)).astype(int)
    return Piece(name, owner, colour, corners, frames, lines=(tuple(range(len(corners))),), width=width)


def across(direction: Array) -> tuple[Array, Array]:
    """Two unit vectors normal to a unit vector and to each other."""
    first = np.cross(direction, np.eye(3)[int(np.argmin(np.abs(direction)))])
    first /= np.linalg.norm(first)
    return first, np.cross(direction, first)
