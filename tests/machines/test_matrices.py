"""Finite-element matrices: read alike from every format, and reduced with the error that is told."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.io import hb_write, mmwrite, savemat
from scipy.sparse import block_diag, coo_matrix, csc_matrix, diags_array, kron, save_npz

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.io.finite_elements.matrix_files import read_matrix
from machines import Machine, linear_check, read_machine
from machines.components.matrices import Matrices


def lattice(nx: int, ny: int, nz: int, grounded: bool = True) -> tuple[csc_matrix, csc_matrix, Array]:
    """Point masses of 0.2 kg on a 20 mm grid, springs along edges and diagonals: mass, stiffness, positions."""
    index = np.arange(nx * ny * nz).reshape(nx, ny, nz)
    places = 0.02 * np.argwhere(index >= 0).astype(float)
    n, parts = len(places), []
    steps = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, -1, 0), (1, 0, 1), (1, 0, -1), (0, 1, 1), (0, 1, -1)]
    cells = np.argwhere(index >= 0)
    for step in steps:
        other = cells + step
        kept = np.all((other >= 0) & (other < index.shape), axis=1)
        a, b = index[tuple(cells[kept].T)], index[tuple(other[kept].T)]
        spring = coo_matrix((np.ones(2 * len(a)), (np.tile(np.arange(len(a)), 2), np.concatenate([a, b]))))
        spring.data[len(a) :] = -1.0
        incidence = csc_matrix((spring.data, spring.coords), shape=(len(a), n))
        e = np.array(step) / np.linalg.norm(step)
        parts.append(kron(5e7 * incidence.T @ incidence, np.outer(e, e)))
    K = csc_matrix(sum(parts[1:], parts[0]))
    if grounded:
        K = csc_matrix(K + kron(diags_array(1e8 * (np.arange(n) < ny * nz)), np.eye(3)))
    mass = 0.2 * np.ones(3 * n)
    return csc_matrix(diags_array(mass)), K, places


def direct(component: Matrices, omega: Array) -> np.ndarray:
    """Receptance by inverting the full matrices line by line."""
    M, K = component.mass.toarray(), component.stiffness.toarray()
    C = component.mass_damping * M + component.stiffness_damping * K
    rows = np.array(component.rows)
    return np.array([np.linalg.inv(K - w**2 * M + 1j * w * C)[np.ix_(rows, rows)] for w in omega])


def test_small_matrices_are_kept_as_they_are() -> None:
    M, K, _ = lattice(3, 3, 3)
    part = Matrices("bed", ("a.x", "b.z"), (27, 80), M, K, stiffness_damping=1e-6)
    omega = 2 * np.pi * np.linspace(50, 4000, 20)
    assert np.linalg.norm(part.receptance(omega) - direct(part, omega)) < 1e-11 * np.linalg.norm(direct(part, omega))
    assert part.remarks() == ()


@pytest.mark.parametrize("grounded", [True, False])
def test_reduced_receptance_is_within_the_error_it_tells(grounded: bool) -> None:
    M, K, _ = lattice(8, 5, 4, grounded)
    part = Matrices("bed", ("a.x", "a.y", "b.z"), (400, 401, 80), M, K, stiffness_damping=1e-6, up_to=2000.0)
    found, _ = part._reduced
    assert found is not None
    assert found.basis.shape[1] <= 3 + found.modes + 3 * found.corrections < 200
    assert found.error < 1e-6
    omega = 2 * np.pi * np.linspace(50, 2000, 8)
    want = direct(part, omega)
    assert np.linalg.norm(part.receptance(omega) - want) < 1e-5 * np.linalg.norm(want)
    assert "480 rows reduced to" in part.remarks()[0]


def test_reduction_that_is_too_coarse_says_so() -> None:
    """The error told of static shapes alone is that of a comparison with the full matrices."""
    from machines.components.craig_bampton import craig_bampton

    M, K, _ = lattice(8, 5, 4)
    rows = np.array([400, 401, 80])
    coarse = craig_bampton(M, K, rows, 3000.0, np.inf, "test")
    fine = craig_bampton(M, K, rows, 3000.0, 1e-6, "test")
    assert coarse.corrections == 0
    assert coarse.error > 100 * fine.error
    small = np.linalg.inv(coarse.reduced(K) * (1 + 0.02j) - (2 * np.pi * 3000.0) ** 2 * coarse.reduced(M))[:3, :3]
    full = np.linalg.inv(K.toarray() * (1 + 0.02j) - (2 * np.pi * 3000.0) ** 2 * M.toarray())[np.ix_(rows, rows)]
    assert np.linalg.norm(small - full) / np.linalg.norm(full) == pytest.approx(coarse.error, rel=1.0)


@pytest.mark.thorough
def test_large_sparse_model_is_reduced_by_the_sparse_road() -> None:
    """2304 rows: fixed-interface modes by shift and invert, statics exact."""
    M, K, _ = lattice(16, 8, 6)
    part = Matrices("bed", ("a.x", "a.y", "a.z"), (2301, 2302, 2303), M, K, damping_ratio=0.01, up_to=500.0)
    found, model = part._reduced
    assert found is not None
    assert found.error < 1e-6
    from scipy.sparse.linalg import spsolve

    force = np.zeros(2304)
    force[2301] = 1.0
    static = spsolve(K, force)[2301]
    compliance = model.shapes @ np.linalg.solve(model.stiffness, model.shapes.T)
    assert compliance[0, 0] == pytest.approx(static, rel=1e-9)


def test_damping_ratio_is_that_of_every_mode() -> None:
    from scipy.linalg import eigh

    M, K, _ = lattice(3, 3, 3)
    model = Matrices("bed", ("a.x",), (80,), M, K, damping_ratio=0.03).second_order()
    squared, shapes = eigh(model.stiffness, model.mass)
    assert np.diag(shapes.T @ model.damping @ shapes) / (2 * np.sqrt(squared)) == pytest.approx(0.03, rel=1e-9)


def test_millimetres_and_tonnes_are_read_in_si() -> None:
    """A cantilever's 2 × 2 stiffness of tip translation and rotation, in N/m and in N/mm."""
    EI, L, m, j = 1e4, 0.5, 3.0, 0.02
    K = EI / L**3 * np.array([[12, -6 * L], [-6 * L, 4 * L**2]])
    M = np.diag([m, j])
    to_mm = np.diag([1e-3**0.5, 1e3**0.5])
    si = Matrices("b", ("t.x", "t.ry"), (0, 1), csc_matrix(M), csc_matrix(K))
    mm = Matrices(
        "b", ("t.x", "t.ry"), (0, 1), csc_matrix(to_mm @ M @ to_mm), csc_matrix(to_mm @ K @ to_mm), units="mm"
    )
    assert mm.mass[0, 0] == pytest.approx(m * 1e-3)  # t
    assert mm.stiffness[1, 1] == pytest.approx(4 * EI / L * 1e3)  # N mm/rad
    omega = np.array([10.0, 300.0])
    assert mm.receptance(omega) == pytest.approx(si.receptance(omega), rel=1e-12)


def op4_text(A: Array, name: str, sparse: str) -> str:
    """One matrix as OUTPUT4 writes it, in text; ``sparse`` is "", "strings" or "big"."""
    n = len(A)
    lines = [f"{n:8d}{-n if sparse == 'big' else n:8d}{6:8d}{2:8d}{name:<8}1P,3E23.16"]

    def numbers(values: Array) -> list[str]:
        words = [f"{v:23.16E}" for v in values]
        return ["".join(words[i : i + 3]) for i in range(0, len(words), 3)]

    for j in range(n):
        rows = np.flatnonzero(A[:, j])
        if not len(rows):
            continue
        if not sparse:
            column = A[rows[0] : rows[-1] + 1, j]
            lines += [f"{j + 1:8d}{rows[0] + 1:8d}{2 * len(column):8d}", *numbers(column)]
            continue
        runs = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
        head = 2 if sparse == "big" else 1
        lines.append(f"{j + 1:8d}{0:8d}{sum(2 * len(r) + head for r in runs):8d}")
        for r in runs:
            length, row = 2 * len(r), r[0] + 1
            lines.append(f"{length + 1:8d}{row:8d}" if sparse == "big" else f"{row + 65536 * (length + 1):12d}")
            lines += numbers(A[r, j])
    lines += [f"{n + 1:8d}{1:8d}{2:8d}", *numbers(np.ones(1))]
    return "\n".join(lines) + "\n"


def op4_binary(A: Array, name: str, sparse: str, order: str = "<") -> bytes:
    n, out = len(A), b""

    def record(content: bytes) -> bytes:
        mark = struct.pack(order + "i", len(content))
        return mark + content + mark

    out += record(struct.pack(order + "4i8s", n, -n if sparse == "big" else n, 6, 2, name.ljust(8).encode()))
    for j in range(n):
        rows = np.flatnonzero(A[:, j])
        if not len(rows):
            continue
        if not sparse:
            column = A[rows[0] : rows[-1] + 1, j]
            head = struct.pack(order + "3i", j + 1, rows[0] + 1, 2 * len(column))
            out += record(head + column.astype(order + "f8").tobytes())
            continue
        body = b""
        for r in np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1):
            length, row = 2 * len(r), int(r[0]) + 1
            header = (length + 1, row) if sparse == "big" else (row + 65536 * (length + 1),)
            body += struct.pack(f"{order}{len(header)}i", *header) + A[r, j].astype(order + "f8").tobytes()
        out += record(struct.pack(order + "3i", j + 1, 0, len(body) // 4) + body)
    return out + record(struct.pack(order + "3id", n + 1, 1, 2, 1.0))


def dmig(A: Array, name: str, style: str) -> str:
    """One symmetric matrix, lower triangle, grid points 101, 102, … with three components each."""
    label = [(101 + i // 3, 1 + i % 3) for i in range(len(A))]
    rows = []
    head = [name, "0", "6", "2", "0", "", "", ""]
    if style == "long":
        rows.append(f"{'DMIG':<8}" + "".join(f"{w:>8}" for w in head))
    else:
        rows.append(
            ",".join(["DMIG", *head]) if style == "comma" else f"{'DMIG':<8}" + "".join(f"{w:<8}" for w in head)
        )
    for j in range(len(A)):
        entries = [(label[i], A[i, j]) for i in range(j, len(A)) if A[i, j]]
        if not entries:
            continue
        g, c = label[j]
        if style == "long":
            rows.append(f"{'DMIG*':<8}{name:<16}{g:>16}{c:>16}")
            rows += [f"{'*':<8}{a:>16}{b:>16}{f'{v:.9E}'.replace('E', 'D'):>16}" for (a, b), v in entries]
        elif style == "comma":
            first, *rest = entries
            rows.append(f"DMIG,{name},{g},{c},,{first[0][0]},{first[0][1]},{float(first[1])!r},")
            rows += [f",{a},{b},{float(v)!r}," for (a, b), v in rest]
        else:
            (a, b), v = entries[0]
            rows.append(f"{'DMIG':<8}{name:<8}{g:<8}{c:<8}{'':8}{a:<8}{b:<8}{_short(v):<8}")
            for k in range(1, len(entries), 2):
                pair = entries[k : k + 2]
                rows.append(f"{'+':<8}" + "".join(f"{a:<8}{b:<8}{_short(v):<8}{'':8}" for (a, b), v in pair))
    return "\n".join(["$ punched", *rows, "ENDDATA"]) + "\n"


def _short(value: float) -> str:
    """Eight columns, the E left out."""
    text = f"{value:.3e}"
    mantissa, exponent = text.split("e")
    return f"{mantissa[:5].rstrip('0')}{int(exponent):+d}"


def example() -> Array:
    rng = np.random.default_rng(2)
    root = rng.normal(size=(6, 6))
    A = np.round(root @ root.T * 1e3) + 1e4 * np.eye(6)
    A[0, 4:] = A[4:, 0] = A[2, 3] = A[3, 2] = A[1, 3] = A[3, 1] = 0.0
    return A


def write_hb(path: Path, A: Array) -> None:
    hb_write(path, csc_matrix(A))


def write_hb_symmetric(path: Path, A: Array) -> None:
    hb_write(path, csc_matrix(np.tril(A)))
    path.write_text(path.read_text().replace("RUA", "RSA"))


WRITERS: dict[str, tuple[str, Callable[[Path, Array], object]]] = {
    "matrix market": ("k.mtx", lambda p, A: mmwrite(p, csc_matrix(A), precision=16)),
    "matrix market, symmetric": ("k.mtx", lambda p, A: mmwrite(p, csc_matrix(A), symmetry="symmetric", precision=16)),
    "harwell-boeing": ("k.hb", write_hb),
    "harwell-boeing, symmetric": ("k.rsa", write_hb_symmetric),
    "npz, dense": ("k.npz", lambda p, A: np.savez(p, K=A)),
    "npz, scipy": ("k.npz", lambda p, A: save_npz(p, csc_matrix(A))),
    "mat": ("k.mat", lambda p, A: savemat(p, {"K": csc_matrix(A)})),
    "op4 text": ("k.op4", lambda p, A: p.write_text(op4_text(A, "KGG", ""))),
    "op4 text, strings": ("k.op4", lambda p, A: p.write_text(op4_text(A, "KGG", "strings"))),
    "op4 text, bigmat": ("k.op4", lambda p, A: p.write_text(op4_text(A, "KGG", "big"))),
    "op4 binary": ("k.op4", lambda p, A: p.write_bytes(op4_binary(A, "KGG", ""))),
    "op4 binary, strings": ("k.op4", lambda p, A: p.write_bytes(op4_binary(A, "KGG", "strings"))),
    "op4 binary, bigmat, big-endian": ("k.op4", lambda p, A: p.write_bytes(op4_binary(A, "KGG", "big", ">"))),
    "dmig, 16 columns": ("k.pch", lambda p, A: p.write_text(dmig(A, "KAAX", "long"))),
    "dmig, commas": ("k.bdf", lambda p, A: p.write_text(dmig(A, "KAAX", "comma"))),
}


@pytest.mark.parametrize("format", WRITERS)
def test_every_format_gives_the_matrix_back(tmp_path: Path, format: str) -> None:
    file, write = WRITERS[format]
    A = example()
    write(tmp_path / file, A)
    assert read_matrix(tmp_path / file).matrix.toarray() == pytest.approx(A, rel=1e-9)


def test_dmig_of_eight_columns_is_read_to_its_digits(tmp_path: Path) -> None:
    A = example()
    (tmp_path / "k.pch").write_text(dmig(A, "KAAX", "short"))
    found = read_matrix(tmp_path / "k.pch")
    assert found.matrix.toarray() == pytest.approx(A, rel=1e-3)
    assert found.labels == tuple((g, c) for g in (101, 102) for c in (1, 2, 3))


def test_one_of_several_matrices_is_named(tmp_path: Path) -> None:
    A = example()
    (tmp_path / "all.op4").write_text(op4_text(A, "KGG", "") + op4_text(2 * A, "MGG", "strings"))
    assert read_matrix(tmp_path / "all.op4", "mgg").matrix.toarray() == pytest.approx(2 * A)
    with pytest.raises(InputError, match="holds KGG, MGG, expected a name"):
        read_matrix(tmp_path / "all.op4")
    with pytest.raises(InputError, match="no matrix 'KG', did you mean 'KGG'"):
        read_matrix(tmp_path / "all.op4", "KG")


def test_complex_matrix_stands_beside_a_real_one_but_is_none_of_mass_and_stiffness(tmp_path: Path) -> None:
    """A string of one double-precision complex number in row 2 of column 1: four words, two numbers."""
    strange = (
        "       6       6       2       4CGG     1P,3E23.16\n       1       0       5\n  327682\n"
        " 1.0000000000000000E+00 2.0000000000000000E+00\n       7       1       1\n 1.0000000000000000E+00\n"
    )
    (tmp_path / "all.op4").write_text(strange + op4_text(example(), "KGG", "strings"))
    assert read_matrix(tmp_path / "all.op4", "KGG").matrix.toarray() == pytest.approx(example())
    with pytest.raises(InputError, match="expected a real matrix"):
        read_matrix(tmp_path / "all.op4", "CGG")


BROKEN = [
    ("k.mtx", b"garbage\n1 2\n", "cannot be read as a matrix"),
    ("k.mtx", b"%%MatrixMarket matrix coordinate real general\n2 3 1\n1 1 2.0\n", r"shape \(2, 3\)"),
    ("k.mtx", b"%%MatrixMarket matrix coordinate complex general\n1 1 1\n1 1 2.0 1.0\n", "expected a real matrix"),
    ("k.hb", b"title\n1\n2\n3\n4\n", "not that of a Harwell"),
    ("k.npz", b"PK", "cannot be read as npz"),
    ("k.op4", b"\x18\0\0\0\1", "broken"),
    (
        "k.op4",
        b"       2       2       6       2KGG     1P,3E23.16\n       1       1       4\n 1.0\n",
        "ends in line 3",
    ),
    ("k.op4", b"       2       2       6       5KGG     1P,3E23.16\n", "type 5"),
    ("k.pch", b"DMIG*   K                              1               1\n", "no header entry"),
    ("k.pch", b"GRID,1\n", "holds no matrix"),
    ("k.pch", b"DMIG,K,0,9,2,0\nDMIG,K,1,1,,1,1,2.0\n", "form 9"),
    ("k.pch", b"DMIG,K,0,6,2,0\nDMIG,K,1,1,,1,1,two\n", "line 2: the DMIG entry cannot be read"),
    ("k.txt", b"1 2\n", "no reader for '.txt'"),
]


@pytest.mark.parametrize(("file", "content", "words"), BROKEN)
def test_broken_matrix_is_said_in_one_sentence(tmp_path: Path, file: str, content: bytes, words: str) -> None:
    (tmp_path / file).write_bytes(content)
    with pytest.raises(InputError, match=words) as caught:
        read_matrix(tmp_path / file)
    assert str(caught.value).startswith(str(tmp_path / file))
    assert "\n" not in str(caught.value)


GOOD = """
schema = "jointlib/machine/1"
[[component]]
name = "bed"
kind = "matrices"
mass = "m.mtx"
stiffness = { file = "k.npz", name = "K" }
damping_ratio = 0.01
up_to = "2 kHz"
[[component.node]]
name = "table"
rows = { x = 1, y = 2, z = 3 }
at = ["0.1 m", 0, 0]
[[component.node]]
name = "foot"
rows = { z = 6 }
[[connection]]
name = "mount"
between = ["bed", "ground"]
at = [0.1, 0, 0]
direction = [0, 0, 1]
joint = { law = [ { kind = "linear", stiffness = "100 N/um" } ] }
[tool]
x = "bed.table.x"
"""


def files(folder: Path) -> None:
    A = example()
    mmwrite(folder / "m.mtx", csc_matrix(np.eye(6) * 2.0))
    np.savez(folder / "k.npz", K=A * 1e3, C=A * 1e-2)
    mmwrite(folder / "tilted.mtx", csc_matrix(np.eye(6) + np.eye(6, k=1)))
    mmwrite(folder / "massless.mtx", csc_matrix(np.diag([1.0, 1, 1, 1, 1, 0])))
    mmwrite(folder / "large.mtx", block_diag([csc_matrix(A)] * 40))
    mmwrite(folder / "five.mtx", csc_matrix(np.eye(5)))
    (folder / "k.pch").write_text(dmig(A * 1e3, "KAAX", "long") + dmig(np.diag([1.0, 2, 3, 4, 5, 6]), "MAAX", "long"))


def test_file_is_read(tmp_path: Path) -> None:
    files(tmp_path)
    (tmp_path / "m.toml").write_text(GOOD)
    machine = read_machine(tmp_path / "m.toml")
    (bed,) = machine.components
    assert isinstance(bed, Matrices)
    assert bed.dofs == ("table.x", "table.y", "table.z", "foot.z")
    assert machine.rows(machine.connections)[0].tolist() == [0, 0, 1, 0]
    assert linear_check(machine).passed


def test_grid_points_of_a_punch_file_are_named(tmp_path: Path) -> None:
    files(tmp_path)
    text = GOOD.replace('"m.mtx"', '{ file = "k.pch", name = "MAAX" }')
    text = text.replace('{ file = "k.npz", name = "K" }', '{ file = "k.pch", name = "KAAX" }')
    text = text.replace("rows = { x = 1, y = 2, z = 3 }", "grid = 102").replace("rows = { z = 6 }", "grid = 101")
    (tmp_path / "m.toml").write_text(text)
    machine = read_machine(tmp_path / "m.toml")
    (bed,) = machine.components
    assert isinstance(bed, Matrices)
    assert bed.dofs[:3] == ("table.x", "table.y", "table.z")
    assert bed.rows == (3, 4, 5, 0, 1, 2)
    assert bed.mass.diagonal().tolist() == [1, 2, 3, 4, 5, 6]


BAD = [
    ('mass = "m.mtx"', "", "'mass' is missing"),
    ('mass = "m.mtx"', 'mass = "lost.mtx"', "no such file"),
    ('mass = "m.mtx"', "mass = 3", "expected a file name"),
    ('mass = "m.mtx"', 'mass = "five.mtx"', r"stiffness has shape \(6, 6\)"),
    ('mass = "m.mtx"', 'mass = "tilted.mtx"', "row 2, column 1 .*symmetric"),
    ('mass = "m.mtx"', 'mass = "massless.mtx"', "mass is singular"),
    ('mass = "m.mtx"', 'mass = { file = "k.pch", name = "MAAX" }', "stiffness names no grid points"),
    (', name = "K" }', " }", "holds C, K, expected a name"),
    ("damping_ratio = 0.01", "damping_ratio = -1", "damping_ratio is -1"),
    (
        "damping_ratio = 0.01",
        'damping_ratio = 0.1\ndamping = { file = "k.npz", name = "C" }',
        "both damping and damping_ratio",
    ),
    ("rows = { z = 6 }", "rows = { z = 7 }", "row 7, expected 1 to 6"),
    ("rows = { z = 6 }", "rows = { z = 1 }", "row 1 has two names"),
    ("rows = { z = 6 }", "rows = { zz = 1 }", "unknown key 'zz'"),
    ("rows = { z = 6 }", "grid = 3", "name no grid points"),
    ("rows = { z = 6 }", "", "neither rows nor grid"),
    ('up_to = "2 kHz"', "up_to = -1", "up_to is -1"),
    ('up_to = "2 kHz"', 'units = "inch"', "units is 'inch'"),
    ("at = [0.1, 0, 0]", "at = [0.2, 0, 0]", "nearest, 'table', lies 0.1 m away"),
    ('mass = "m.mtx"\nstiffness = { file = "k.npz", name = "K" }', 'mass = "large.mtx"\nstiffness = "large.mtx"', None),
]


@pytest.mark.parametrize(("old", "new", "words"), BAD)
def test_what_is_wrong_is_said_in_one_sentence(tmp_path: Path, old: str, new: str, words: str | None) -> None:
    assert old in GOOD
    files(tmp_path)
    path = tmp_path / "m.toml"
    text = GOOD.replace(old, new, 1)
    if words is None:
        text, words = text.replace('up_to = "2 kHz"', ""), "up_to is missing; matrices of 240 rows"
    path.write_text(text)
    with pytest.raises(InputError, match=words) as caught:
        read_machine(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


def test_machine_of_matrices_passes_the_linear_check() -> None:
    M, K, _ = lattice(8, 5, 4)
    part = Matrices("bed", ("a.x", "a.y", "b.z"), (400, 401, 80), M, K, stiffness_damping=1e-6, up_to=2000.0)
    assert (
        linear_check(Machine((part,), drive="bed.a.x"), frequency=np.linspace(50, 2000, 40)).max_relative_difference
        < 1e-8
    )
