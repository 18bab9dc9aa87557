"""Outlines from STL files: read whole or refused in a sentence, drawn where they belong, for the eye alone."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.io.stl import read_stl
from machines import read_machine
from machines.files.machine_writer import write_machine
from machines.shapes.outline import Outline
from machines.shapes.solid import bar, block
from machines.view import scene

LIBRARY = Path("machines/library").resolve()


def triangles(size: tuple[float, float, float] = (200.0, 100.0, 50.0)) -> Array:
    solid = block((0.0, 0.0, size[2] / 2), size)
    return np.array(
        [[solid.corners[f[0]], solid.corners[f[i]], solid.corners[f[i + 1]]] for f in solid.faces for i in (1, 2)]
    )


def binary(path: Path, corners: Array, head: bytes = b"drawn by hand") -> Path:
    rows = b"".join(struct.pack("<12fH", 0, 0, 0, *row.ravel(), 0) for row in corners)
    path.write_bytes(head.ljust(80, b" ") + struct.pack("<I", len(corners)) + rows)
    return path


def text(path: Path, corners: Array) -> Path:
    facets = "".join(
        "facet normal 0 0 0\n outer loop\n"
        + "".join(f"  vertex {x:.6e} {y:.6e} {z:.6e}\n" for x, y, z in facet)
        + " endloop\nendfacet\n"
        for facet in corners
    )
    path.write_text(f"solid block\n{facets}endsolid block\n", encoding="ascii")
    return path


def test_binary_and_text_are_the_same_surface(tmp_path: Path) -> None:
    corners = triangles()
    np.testing.assert_array_equal(read_stl(binary(tmp_path / "b.stl", corners)), corners)
    np.testing.assert_array_equal(read_stl(text(tmp_path / "t.stl", corners)), corners)
    # Some programs begin a binary file with the word of the text form.
    np.testing.assert_array_equal(read_stl(binary(tmp_path / "s.stl", corners, b"solid block")), corners)


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda data: data[:-20], "expected a whole STL file"),
        (lambda data: data[:50], "50 bytes, too few"),
        (lambda data: b"", "0 bytes, too few"),
        (lambda data: data[:80] + struct.pack("<I", 0), "holds no triangle"),
        (lambda data: data[:96] + struct.pack("<f", np.nan) + data[100:], "is nan, expected finite numbers"),
        (lambda data: b"solid x\nvertex 1 2 3\nendsolid x\n", "1 corners in 0 whole facets"),
        (lambda data: b"solid x\nvertex 1 2 x\nvertex 1 2 3\nvertex 1 2 3\nendfacet\nendsolid x\n", "no three numbers"),
    ],
)
def test_a_damaged_file_is_refused(tmp_path: Path, spoil: object, said: str) -> None:
    assert callable(spoil)
    path = binary(tmp_path / "b.stl", triangles())
    path.write_bytes(spoil(path.read_bytes()))
    with pytest.raises(InputError, match=said):
        read_stl(path)


def test_a_fine_surface_is_drawn_with_fewer_triangles(tmp_path: Path) -> None:
    solid = bar(0.0, 1000.0, 300.0)
    fine = np.array(
        [
            [solid.corners[f[0]], solid.corners[f[i]], solid.corners[f[i + 1]]]
            for f in solid.faces
            for i in range(1, len(f) - 1)
        ]
    )
    for _ in range(4):  # every triangle into four
        a, b, c = fine[:, 0], fine[:, 1], fine[:, 2]
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        fine = np.concatenate(
            [np.stack(part, axis=1) for part in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
        )
    corners, faces = Outline(binary(tmp_path / "bar.stl", fine)).surface()
    assert len(fine) > 10_000
    assert len(faces) <= 3000
    np.testing.assert_allclose(np.ptp(corners, axis=0), [1.0, 0.6, 0.6], rtol=0.03)
    P = corners[faces]
    volume = np.sum(P[:, 0] * np.cross(P[:, 1], P[:, 2])) / 6
    assert volume == pytest.approx(8 * np.sin(np.pi / 8) * 0.09, rel=0.05)


def with_outline(folder: Path, value: str, position: str = "0 mm") -> Path:
    text = (
        (LIBRARY / "lathe.toml")
        .read_text("utf-8")
        .replace('joint = "mount.joint.toml"', f'joint = "{LIBRARY}/mount.joint.toml"')
    )
    text = text.replace('name = "slide"  ', f'outline = {value}\nname = "slide"  ')
    text = text.replace('moves = ["slide"]', f'moves = ["slide"]\nposition = "{position}"')
    path = folder / "lathe.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_an_outline_takes_the_place_of_the_block_and_travels_with_it(tmp_path: Path) -> None:
    binary(tmp_path / "slide.stl", triangles())
    shown = {}
    for position in ("0 mm", "-100 mm"):
        machine = read_machine(with_outline(tmp_path, '{ file = "slide.stl", at = ["100 mm", 0.79, 0.25] }', position))
        drawn = scene(machine)
        (piece,) = (p for p in drawn.pieces if p.name == "slide (rigid)")
        shown[position] = piece.corners
        assert len(piece.faces) == 12
        shape = np.zeros(len(machine.dofs))
        shape[machine.dofs.index("slide.ux")] = 1.0
        motion = drawn.displaced(piece.corners, piece.frame, drawn.moves(shape[:, None])[0])
        np.testing.assert_array_equal(motion, np.tile([1.0, 0.0, 0.0], (len(motion), 1)))
    low, high = shown["0 mm"].min(axis=0), shown["0 mm"].max(axis=0)
    np.testing.assert_allclose([low, high], [[0.0, 0.74, 0.25], [0.2, 0.84, 0.30]], atol=1e-9)
    np.testing.assert_allclose(shown["-100 mm"], shown["0 mm"] + np.array([0.0, 0.0, -0.1]), atol=1e-12)


def test_an_outline_in_another_unit_is_asked_about(tmp_path: Path) -> None:
    binary(tmp_path / "slide.stl", triangles() + np.array([900.0, 0.0, 0.0]))
    said = scene(read_machine(with_outline(tmp_path, '{ file = "slide.stl", unit = "m" }'))).placeless
    assert any("the outline of slide lies" in s and "is its unit another than m" in s for s in said)


@pytest.mark.parametrize(
    ("value", "said"),
    [
        ('"gone.stl"', r"\(slide\): outline refers to .*gone\.stl, which does not exist"),
        ('{ file = "slide.stl", unit = "cm" }', "unit is 'cm', did you mean"),
        ('{ file = "slide.stl", place = [0, 0, 0] }', "outline: unknown key 'place'"),
        ("3", "outline: file is 3, expected a string"),
    ],
)
def test_a_wrong_outline_is_said(tmp_path: Path, value: str, said: str) -> None:
    binary(tmp_path / "slide.stl", triangles())
    with pytest.raises(InputError, match=said):
        read_machine(with_outline(tmp_path, value))


def test_a_machine_that_is_written_keeps_its_outline(tmp_path: Path) -> None:
    binary(tmp_path / "slide.stl", triangles())
    written = write_machine(with_outline(tmp_path, '"slide.stl"'), {}, tmp_path / "new" / "mill.toml")
    again = read_machine(written[0])
    assert again.outlines["slide"].file.read_bytes() == (tmp_path / "slide.stl").read_bytes()
    assert again.outlines["slide"].file.resolve() != (tmp_path / "slide.stl").resolve()
