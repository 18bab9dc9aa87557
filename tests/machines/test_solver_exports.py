"""Matrices in the very shapes in which finite-element programs write them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.io.finite_elements.matrix_files import read_matrix
from machines import linear_check, read_machine
from machines.components.matrices import Matrices

NODES, DIRECTIONS = (7, 12, 131), (1, 2, 3)
LABELS = tuple((n, d) for n in NODES for d in DIRECTIONS)


def model() -> tuple[Array, Array]:
    """Consistent masses and stiffnesses of nine rows in t, mm, N; some entries are zero."""
    rng = np.random.default_rng(4)
    root = rng.normal(size=(9, 9))
    K = 1e4 * (root @ root.T) + 5e4 * np.eye(9)
    K[0, 8] = K[8, 0] = K[1, 6] = K[6, 1] = 0.0
    M = 1e-3 * (np.diag(rng.uniform(1, 2, 9)) + np.diag(np.full(6, 0.2), 3) + np.diag(np.full(6, 0.2), -3))
    return M, K


def calculix(A: Array) -> str:
    """One triangle by columns, ``%d %d %20.13e``, as matrixstorage.c prints it."""
    pairs = [(i, j) for j in range(9) for i in range(j + 1) if A[i, j] or i == j]
    return "".join(f"{i + 1} {j + 1} {A[i, j]:20.13e}\n" for i, j in pairs)


DOF = "".join(f"{n}.{d}\n" for n, d in LABELS)


def punch(A: Array, name: str) -> str:
    """What ``EXTSEOUT(DMIGPCH)`` punches among other bulk data: columns of 16, the exponent after D, NCOL given."""
    lines = [
        "$" * 72,
        f"$ {name} FOR EXTERNAL SUPERELEMENT",
        "GRID*                  7               0 .18000000000000",
        "*       0.              20110003",
        "SPOINT  20111101    THRU20111139",
        f"DMIG    {name:<8}{0:8d}{6:8d}{2:8d}{0:8d}{'':16}{9:8d}",
    ]
    for j, (n, d) in enumerate(LABELS):
        lines.append(f"DMIG*   {name:<16}{n:16d}{d:16d}")
        for i in range(j, 9):
            if A[i, j]:
                lines.append(f"*       {LABELS[i][0]:16d}{LABELS[i][1]:16d}{A[i, j]:16.9E}".replace("E", "D"))
    return "\n".join(lines) + "\n"


def output4(A: Array, name: str) -> str:
    """What ``EXTSEOUT(DMIGOP4)`` with FORM=FORMATTED writes: strings with packed heads, single words, 1P,3E22.15."""
    lines = [f"{9:8d}{9:8d}{6:8d}{1:8d}{name:<8}1P,3E22.15"]

    def numbers(values: Array) -> list[str]:
        words = [f"{v:22.15E}" for v in values]
        return ["".join(words[i : i + 3]) for i in range(0, len(words), 3)]

    for j in range(9):
        rows = np.flatnonzero(A[:, j])
        runs = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
        lines.append(f"{j + 1:8d}{0:8d}{sum(len(r) + 1 for r in runs):8d}")
        for r in runs:
            lines += [f"{65536 * (len(r) + 1) + r[0] + 1:11d}", *numbers(A[r, j])]
    lines += [f"{10:8d}{1:8d}{1:8d}", f"{1.0:22.15E}"]
    return "\n".join(lines) + "\n"


def hbmat(A: Array, right_hand: bool) -> str:
    """What Ansys HBMAT writes: one number a line, lower triangle by columns, with or without the load vector."""
    pointers, rows, values = [1], [], []
    for j in range(9):
        inside = [i for i in range(j, 9) if A[i, j] or i == j]
        rows += [i + 1 for i in inside]
        values += [A[i, j] for i in inside]
        pointers.append(len(rows) + 1)
    load = ["    1.000000000000000E+00"] * 9 if right_hand else []
    n = len(rows)
    head = [
        f"{'STIFFNESS MATRIX FROM FULL FILE':<72}{'FULL':<8}",
        f"{10 + 2 * n + len(load):14d}{10:14d}{n:14d}{n:14d}{len(load):14d}",
        f"{'RSA':<14}{9:14d}{9:14d}{n:14d}{0:14d}",
        f"{'(1I14)':<16}{'(1I14)':<16}{'(1E25.15)':<20}{'(1E25.15)':<20}",
        *([f"{'F':<14}{1:14d}{0:14d}"] if right_hand else []),
    ]
    body = [*(f"{p:14d}" for p in pointers), *(f"{r:14d}" for r in rows), *(f"{v:25.15E}" for v in values), *load]
    return "\n".join([*head, *body]) + "\n"


def write(folder: Path) -> None:
    M, K = model()
    (folder / "job.sti").write_text(calculix(K))
    (folder / "job.mas").write_text(calculix(M))
    (folder / "job.dof").write_text(DOF)
    (folder / "job.pch").write_text(punch(K, "KAAX") + punch(M, "MAAX"))
    (folder / "job.op4").write_text(output4(K, "KAA") + output4(M, "MAA"))
    (folder / "k.matrix").write_text(hbmat(K, True))
    (folder / "m.matrix").write_text(hbmat(M, False))


MACHINE = """
schema = "jointlib/machine/1"
[[component]]
name = "bed"
kind = "matrices"
{matrices}
damping_ratio = 0.02
units = "mm"
[[component.node]]
name = "table"
{table}
[[component.node]]
name = "foot"
{foot}
[[connection]]
name = "mount"
between = ["bed.foot.z", "ground"]
joint = {{ law = [{{ kind = "linear", stiffness = "30 N/um" }}] }}
[tool]
x = "bed.table.x"
"""
GRID = {"table": "grid = 131", "foot": "grid = 7"}
ROWS = {"table": "rows = { x = 7, y = 8, z = 9 }", "foot": "rows = { x = 1, y = 2, z = 3 }"}
SOURCES = {
    "calculix": ('mass = "job.mas"\nstiffness = "job.sti"', GRID, 1e-12),
    "calculix by rows": ('mass = "job.mas"\nstiffness = "job.sti"', ROWS, 1e-12),
    "nastran punch": (
        'mass = { file = "job.pch", name = "MAAX" }\nstiffness = { file = "job.pch", name = "KAAX" }',
        GRID,
        1e-8,
    ),
    "nastran output4": (
        'mass = { file = "job.op4", name = "MAA" }\nstiffness = { file = "job.op4", name = "KAA" }',
        ROWS,
        1e-13,
    ),
    "ansys": ('mass = "m.matrix"\nstiffness = "k.matrix"', ROWS, 1e-13),
}


@pytest.mark.parametrize("source", SOURCES)
def test_export_is_the_model_that_was_exported(source: str, tmp_path: Path) -> None:
    write(tmp_path)
    matrices, nodes, digits = SOURCES[source]
    (tmp_path / "m.toml").write_text(MACHINE.format(matrices=matrices, **nodes))
    machine = read_machine(tmp_path / "m.toml")
    (bed,) = machine.components
    assert isinstance(bed, Matrices)
    assert bed.dofs == tuple(f"{node}.{axis}" for node in ("table", "foot") for axis in "xyz")
    M, K = model()
    order = [6, 7, 8, 0, 1, 2]
    assert np.max(np.abs(bed.stiffness.toarray() - K)) < digits * np.max(K)
    assert np.max(np.abs(bed.mass.toarray() - M)) < digits * np.max(M)
    # In SI, by inverting what was written: t to kg and N/mm to N/m are a factor of a thousand.
    w, inverse = 2 * np.pi * 900.0, np.linalg.inv(np.linalg.cholesky(M))
    squared, shapes = np.linalg.eigh(inverse @ K @ inverse.T)
    shapes = (inverse.T @ shapes)[order]
    H = (shapes / (squared - w**2 + 0.04j * w * np.sqrt(squared))) @ shapes.T / 1e3
    apart = np.max(np.abs(bed.receptance(np.array([w]))[0] - H)) / np.max(np.abs(H))
    assert apart < 10 * digits + 1e-12
    assert linear_check(machine, frequency=np.linspace(100, 2000, 20)).passed


@pytest.mark.parametrize(
    ("file", "text", "said"),
    [
        ("job.sti", "", "holds no entries"),
        ("job.sti", "1 1 2.0\n2 2\n", "expected row, column and value on every line"),
        ("job.sti", "1 1 2.0\n2 x 3.0\n", "expected row, column and value on every line"),
        ("job.sti", "0 1 2.0\n", "names row or column 0"),
        ("job.sti", "1 1 2.0\n2 1 1.0\n1 3 4.0\n", "both sides of the diagonal, expected one triangle"),
        ("job.sti", "9 9 nan\n", "expected finite numbers"),
        ("job.dof", "7.1\n7.2\n", "job.dof: names 2 rows and the matrix has 9"),
        ("job.dof", DOF.replace("12.2", "12;2"), "job.dof: line 5 is '12;2', expected node.direction, as 12.3"),
        ("job.dof", DOF.replace("12.2", "12.4"), "line 5 is '12.4'"),
    ],
)
def test_broken_files_of_calculix_are_said_in_one_sentence(file: str, text: str, said: str, tmp_path: Path) -> None:
    write(tmp_path)
    (tmp_path / file).write_text(text)
    with pytest.raises(InputError) as caught:
        read_matrix(tmp_path / "job.sti")
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_rows_without_a_dof_file_have_numbers_only(tmp_path: Path) -> None:
    write(tmp_path)
    (tmp_path / "job.dof").unlink()
    assert read_matrix(tmp_path / "job.sti").labels is None
    (tmp_path / "m.toml").write_text(MACHINE.format(matrices=SOURCES["calculix"][0], **GRID))
    with pytest.raises(InputError, match="the matrices name no grid points, expected rows"):
        read_machine(tmp_path / "m.toml")
