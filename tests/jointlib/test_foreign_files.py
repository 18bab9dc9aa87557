"""Files of others: read as by other readers, and refused in a sentence however they are damaged."""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from scipy.io import loadmat, mmread, mmwrite, savemat
from scipy.sparse import bsr_matrix, coo_matrix, csc_matrix, csr_matrix, dia_matrix, issparse, save_npz

from jointlib.errors import InputError, few, told
from jointlib.foreign.archive import arrays_of
from jointlib.foreign.door import bytes_of, foreign, usable
from jointlib.foreign.matlab import variables_of
from jointlib.foreign.matrix_market import read_matrix_market
from jointlib.io.finite_elements.matrix_files import read_matrix
from jointlib.system.memory import ask, bytes_in, free_memory, limited, refuse_beyond


def written(variables: dict[str, Any], **how: Any) -> bytes:
    out = io.BytesIO()
    savemat(out, variables, **how)
    return out.getvalue()


NUMBERS = arrays.arrays(
    st.sampled_from(["f8", "f4", "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "c16", "?"]),
    arrays.array_shapes(min_dims=2, max_dims=3, min_side=0, max_side=4),
)


@settings(deadline=None, max_examples=60)
@given(NUMBERS, st.booleans())
@example(np.array([[complex(0, np.inf)]]), False)
def test_arrays_of_matlab_are_those_that_scipy_reads(values: np.ndarray, packed: bool) -> None:
    data = written({"a": values}, do_compression=packed)
    ours, theirs = variables_of(data)["a"], loadmat(io.BytesIO(data))["a"]
    np.testing.assert_array_equal(ours, theirs.astype(bool) if values.dtype == bool else theirs)
    assert ours.shape == theirs.shape


@pytest.mark.parametrize("how", [{"format": "4"}, {"format": "5"}, {"format": "5", "do_compression": True}])
def test_matrices_texts_and_sparse_ones_come_back(how: dict[str, Any]) -> None:
    K = csc_matrix(np.array([[2.0, 0.0, -1.0], [0.0, 3.0, 0.0]]))
    given_ = {"real": np.arange(6.0).reshape(2, 3), "complex": np.array([[1 + 2j]]), "K": K, "word": "N/m", "one": 2.5}
    found = variables_of(written(given_, **how))
    np.testing.assert_array_equal(found["real"], given_["real"])
    assert found["complex"] == given_["complex"]
    assert issparse(found["K"])
    np.testing.assert_array_equal(found["K"].toarray(), K.toarray())
    assert found["word"] == "N/m"
    assert found["one"] == 2.5


def test_structures_and_cells_are_dictionaries_and_lists() -> None:
    cell = np.array([[np.arange(3.0), "text"], [{"x": 1.0}, np.array([[1 + 1j]])]], dtype=object)
    found = variables_of(written({"run": {"y": np.ones((4, 1)), "unit": "N", "inner": {"n": 3.0}}, "cell": cell}))
    assert found["run"]["unit"] == "N"
    assert found["run"]["inner"]["n"] == 3.0
    np.testing.assert_array_equal(found["run"]["y"], np.ones((4, 1)))
    first, text, structure, number = found["cell"]
    np.testing.assert_array_equal(first.ravel(), np.arange(3.0))
    assert (text, structure["x"], number) == ("text", 1.0, 1 + 1j)


def test_big_endian_files_are_read() -> None:
    name = b"a"
    body = struct.pack(">2I2I", 6, 8, 6, 0) + struct.pack(">2I2i", 5, 8, 1, 2)
    body += struct.pack(">2H4s", 1, 1, name) + struct.pack(">2I2d", 9, 16, 1.5, -2.0)
    head = b"MATLAB 5.0".ljust(116) + bytes(8) + struct.pack(">H", 0x0100) + b"MI"
    np.testing.assert_array_equal(variables_of(head + struct.pack(">2I", 14, len(body)) + body)["a"], [[1.5, -2.0]])


@pytest.mark.parametrize("how", [{"format": "4"}, {"format": "5"}])
def test_no_cut_and_no_changed_byte_of_a_matlab_file_does_worse_than_a_sentence(how: dict[str, Any]) -> None:
    """Every length cut off and every byte replaced: what is read is whole, or a `ValueError` says what is wrong."""
    data = written({"a": np.arange(6.0).reshape(2, 3), "s": csc_matrix(np.eye(3)), "t": "word"}, **how)
    tried = [data[:n] for n in range(len(data))]
    tried += [data[:i] + bytes([b]) + data[i + 1 :] for i in range(len(data)) for b in (0, 1, 0x7F, 0xFF)]
    refused = 0
    for damaged in tried:
        try:
            variables_of(damaged)
        except ValueError:
            refused += 1
    assert refused > len(tried) // 10


def test_what_unpacks_to_more_than_the_memory_is_refused_before_it_does() -> None:
    packed = zlib.compress(bytes(50_000_000))
    with limited():
        ask(8_000_000)
        head = b"MATLAB 5.0".ljust(116) + bytes(8) + struct.pack("<H", 0x0100) + b"IM"
        with pytest.raises(ValueError, match="unpacks to more than the memory"):
            variables_of(head + struct.pack("<2I", 15, len(packed)) + packed)


@pytest.mark.parametrize("symmetry", ["general", "symmetric", "skew-symmetric"])
@pytest.mark.parametrize("full", [False, True])
def test_matrix_market_files_are_those_that_scipy_reads(symmetry: str, full: bool, tmp_path: Path) -> None:
    root = np.round(np.random.default_rng(3).normal(size=(5, 5)), 6) * (np.random.default_rng(4).random((5, 5)) < 0.6)
    A = {"general": root, "symmetric": root + root.T, "skew-symmetric": root - root.T}[symmetry]
    mmwrite(tmp_path / "a.mtx", A if full else coo_matrix(A), symmetry=symmetry, precision=17)
    theirs = mmread(tmp_path / "a.mtx", spmatrix=False)
    ours = read_matrix_market(tmp_path / "a.mtx", (tmp_path / "a.mtx").read_text())
    np.testing.assert_array_equal(ours.toarray(), theirs if full else theirs.toarray())


def test_patterns_and_whole_numbers_of_matrix_market_are_read() -> None:
    text = "%%MatrixMarket matrix coordinate {} general\n% c\n\n2 3 2\n1 1{}\n2 3{}\n"
    pattern = read_matrix_market(Path("a.mtx"), text.format("pattern", "", "")).toarray()
    whole = read_matrix_market(Path("a.mtx"), text.format("integer", " 4", " -5")).toarray()
    np.testing.assert_array_equal(pattern, [[1, 0, 0], [0, 0, 1]])
    np.testing.assert_array_equal(whole, [[4, 0, 0], [0, 0, -5]])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("%%MatrixMarket matrix coordinate real general\n3 3 1\n2147483648 1 1.0\n", "row 2147483648"),
        ("%%MatrixMarket matrix coordinate real general\n2147483648 2147483648 1\n1 1 1.0\n", "of memory"),
        ("%%MatrixMarket matrix coordinate real general\n3 3 9223372036854775808\n1 1 1.0\n", "holds 1"),
        ("%%MatrixMarket matrix coordinate real general\n3 3 1\n0 1 1.0\n", "row 0"),
        ("%%MatrixMarket matrix coordinate real general\n3 3 ²\n1 1 1.0\n", "no line with its numbers"),
        ("%%MatrixMarket matrix coordinate real general\n1 1 1\n1 1 inf\n", "row 1, column 1 is inf"),
        ("%%MatrixMarket matrix coordinate complex hermitian\n1 1 1\n1 1 1 0\n", "expected a real matrix"),
        ("%%MatrixMarket matrix array real general\n999999999 999999999\n1\n", "holds 1"),
        ("", "no head"),
    ],
)
def test_damaged_matrix_market_files_are_refused(text: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "a.mtx").write_text(text)
    with pytest.raises(InputError, match=said):
        read_matrix(tmp_path / "a.mtx")


@pytest.mark.parametrize("form", [csc_matrix, csr_matrix, coo_matrix, dia_matrix, bsr_matrix])
def test_sparse_archives_come_back_and_their_indices_are_looked_at(form: Callable[..., Any], tmp_path: Path) -> None:
    A = np.array([[4.0, 1.0, 0.0], [1.0, 5.0, 2.0], [0.0, 2.0, 6.0]])
    save_npz(tmp_path / "a.npz", form(A))
    np.testing.assert_array_equal(read_matrix(tmp_path / "a.npz").matrix.toarray(), A)
    held = arrays_of(tmp_path / "a.npz")
    for key in {"indices", "row", "indptr"} & set(held):
        np.savez(tmp_path / "b.npz", **{**held, key: np.full_like(held[key], 2**30)})
        with pytest.raises(InputError, match="cannot be read as a matrix"):
            read_matrix(tmp_path / "b.npz")


def npz_with_header(path: Path, header: str) -> None:
    import zipfile

    text = header.encode() + b"\n"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a.npy", b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + bytes(64))


@pytest.mark.parametrize(
    "header",
    [
        "{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000,)}",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (-8,)}",
        "{'descr': '|O', 'fortran_order': False, 'shape': (8,)}",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (8,)",
        "{'descr': 5, 'fortran_order': False, 'shape': (8,)}",
        "{'descr': '<f8', 'fortran_order': 3, 'shape': None}",
        "((((",
        "'",
    ],
)
def test_headers_of_archives_that_do_not_fit_are_refused(header: str, tmp_path: Path) -> None:
    npz_with_header(tmp_path / "a.npz", header)
    with pytest.raises(InputError, match=r"a\.npz: cannot be read as npz") as refusal:
        arrays_of(tmp_path / "a.npz")
    assert "\n" not in str(refusal.value)


def test_whatever_a_reader_does_comes_out_as_a_sentence() -> None:
    import warnings

    def warn() -> None:
        warnings.warn("odd", RuntimeWarning, stacklevel=1)

    def ask_too_much() -> None:
        raise MemoryError

    def dive() -> None:
        dive()

    for read in (warn, ask_too_much, dive, lambda: 1 / 0, lambda: {}["x"], lambda: [][3]):
        with pytest.raises(InputError, match="f: cannot be read as a record"):
            foreign(Path("f"), "a record", read)  # type: ignore[arg-type]


def test_devices_folders_and_names_that_cannot_be_are_said(tmp_path: Path) -> None:
    for path, said in (
        (Path("/dev/zero"), "is a device or pipe"),
        (tmp_path, "^\\S*: cannot be read, it is a folder, expected a record$"),
        (tmp_path / "none", "no such file"),
        (tmp_path / ("x" * 4000), "name too long"),
        (Path("a\0b"), "cannot be read"),
    ):
        with pytest.raises(InputError, match=said):
            bytes_of(path, "a record")


def test_a_file_larger_than_the_memory_is_told_once(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_bytes(bytes(500_000))
    with limited():
        ask(1_000_000)
        with pytest.raises(InputError, match=r"^\S*a\.csv: a file of 500000 bytes would take 6 MB of memory, expected"):
            bytes_of(tmp_path / "a.csv", "a record")


def test_the_first_number_that_is_none_is_told_with_its_place() -> None:
    values = np.ones((3, 4))
    values[1, 2] = np.inf
    with pytest.raises(InputError, match="f: H at 2, 3 is inf, expected finite numbers"):
        usable(Path("f"), "H", values)
    with pytest.raises(InputError, match="1e\\+80"):
        usable(Path("f"), "H", np.array([1.0, 1e80]))


def test_sentences_stay_on_a_line_and_short() -> None:
    assert told("a\nb\x1b[31m\u202e\udcff") == "a\\nb\\x1b[31m\\u202e\\udcff"
    for text in ("x" * 5000, "'" + "a b " * 2000 + "', expected a number", "word " * 3000):
        assert len(told(text)) <= 300
    assert told("f: is '" + "x y" * 999 + "', expected a number").endswith("expected a number")
    many = InputError(*(f"{i} " + "x\n" * 400 for i in range(50)))
    assert len(str(many).splitlines()) == len(many.shortened().splitlines()) == 22
    assert all(len(line) <= 300 for line in many.shortened().splitlines())
    assert few([f"column {i}" for i in range(10_000)], "colum 77").endswith("or 9995 others")
    assert "column 77" in few([f"column {i}" for i in range(10_000)], "colum 77")


def test_what_needs_too_much_memory_is_refused_with_the_number() -> None:
    assert 0 < free_memory() < 1e15
    with pytest.raises(InputError, match=r"8000 lines would take 1e\+03 TB of memory, expected at most .*--limit"):
        refuse_beyond(1e15, "8000 lines")
    assert bytes_in("1.5 GB", "--limit") == 1_500_000_000
    for text in ("", "4", "4 GN", "²GB", "-1GB", "1e99", "9" * 400):
        with pytest.raises(InputError, match="--limit"):
            bytes_in(text, "--limit")
