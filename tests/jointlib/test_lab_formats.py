"""Formats of loggers and programs: what their own writers wrote is read equal, and a cut file is refused."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd
import pytest
import pyuff
import scipy.io
from nptdms import ChannelObject, RootObject, TdmsWriter
from scipy.io import wavfile
from test_measurement_file import UFF58
from tools import package

from jointlib.errors import InputError
from jointlib.io.readers import read_columns
from jointlib.lab.formats.wave import read_wave
from jointlib.lab.open_file import open_lab_file

RATE = 2048.0
TIME = np.arange(600) / RATE
FORCE = np.round(40 * np.exp(-200 * TIME) * np.sin(700 * TIME), 6)
ACC = np.round(3 * np.exp(-20 * TIME) * np.cos(1900 * TIME) - 0.25, 6)
SIGNALS = {"force": FORCE, "acc front": ACC}
UNITS = {"force": "N", "acc front": "g"}


def npz(path: Path) -> None:
    np.savez(path, **SIGNALS, fs=RATE)


def npz_matrix(path: Path) -> None:
    np.savez(path, data=np.column_stack([FORCE, ACC]), dt=1 / RATE)


def mat5(path: Path) -> None:
    scipy.io.savemat(path, {"force": FORCE[:, None], "acc_front": ACC[None, :], "Fs": RATE})


def mat5_packed(path: Path) -> None:
    scipy.io.savemat(path, {"force": FORCE, "acc_front": ACC, "Fs": RATE}, do_compression=True)


def mat_structure(path: Path) -> None:
    channel = {"force": {"values": FORCE, "unit": "N"}, "acc_front": {"values": ACC, "unit": "g"}}
    scipy.io.savemat(path, {"run": channel, "sample_rate": RATE})


def mat73(path: Path) -> None:
    """As MATLAB writes it: HDF5 behind 512 bytes of its own, a class with every data set."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in (("force", FORCE[None, :]), ("acc_front", ACC[:, None]), ("Fs", np.array([[RATE]]))):
            file.create_dataset(name, data=value).attrs["MATLAB_class"] = np.bytes_("double")
        file.create_dataset("note", data=np.array([[104], [105]], dtype="uint16")).attrs["MATLAB_class"] = np.bytes_(
            "char"
        )
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + b"\0" * 8 + b"\x00\x02IM"
    with path.open("r+b") as raw:
        raw.write(head)


def hdf5(path: Path) -> None:
    with h5py.File(path, "w") as file:
        for name, value in SIGNALS.items():
            file.create_dataset(name, data=value, compression="gzip").attrs["unit"] = UNITS[name]
        file.attrs["sample_rate"] = RATE


def hdf5_table(path: Path) -> None:
    with h5py.File(path, "w") as file:
        rows = np.array(list(zip(FORCE, ACC, strict=True)), dtype=[("force", "f8"), ("acc front", "f8")])
        file.create_dataset("log", data=rows).attrs["dt"] = 1 / RATE


def tdms(path: Path) -> None:
    with TdmsWriter(path) as writer:
        told = {"wf_increment": 1 / RATE}
        objects = [ChannelObject("log", n, v, {**told, "unit_string": UNITS[n]}) for n, v in SIGNALS.items()]
        writer.write_segment([RootObject({"author": "lab"}), *objects])


def tdms_groups(path: Path) -> None:
    with TdmsWriter(path) as writer:
        for first, last in ((0, 250), (250, 600)):  # two segments of each channel
            for group, name in (("a", "force"), ("b", "acc front")):
                writer.write_segment(
                    [ChannelObject(group, name, SIGNALS[name][first:last], {"wf_increment": 1 / RATE})]
                )


def universal(path: Path, **changes: Any) -> None:
    path.unlink(missing_ok=True)
    for k, (name, value) in enumerate(SIGNALS.items()):
        data = {
            **UFF58,
            "id1": name,
            "x": TIME,
            "data": value,
            "num_pts": len(value),
            "abscissa_inc": 1 / RATE,
            **changes,
        }
        data |= {"ordinate_spec_data_type": (13, 12)[k], "ordinate_axis_units_lab": UNITS[name]}
        pyuff.UFF(str(path)).write_sets([data], "add")


def universal_binary(path: Path, order: str = "<") -> None:
    """The head of the text form, and behind it the samples as bytes."""
    universal(path)
    out = b""
    values = iter(SIGNALS.values())
    lines = path.read_bytes().split(b"\n")
    for at in [i for i, line in enumerate(lines) if line.strip() == b"58"]:
        data = next(values).astype(f"{order}f8").tobytes()
        form = f"    58b{1 if order == '<' else 2:6d}{2:6d}{11:12d}{len(data):12d}{0:6d}{0:6d}{0:12d}{0:12d}"
        out += b"\n".join([b"    -1", form.encode(), *lines[at + 1 : at + 12]]) + b"\n" + data + b"\n    -1\n"
    path.write_bytes(out)


def universal_big_endian(path: Path) -> None:
    universal_binary(path, ">")


def universal_uneven(path: Path) -> None:
    universal(path, abscissa_spacing=0)


def universal_of_one_title(path: Path) -> None:
    universal(path, id1="Record 1")


def wav16(path: Path) -> None:
    wavfile.write(path, int(RATE), np.round(np.column_stack([FORCE / 64, ACC / 4]) * 2**15).astype("<i2"))


def wav_float(path: Path) -> None:
    wavfile.write(path, int(RATE), np.column_stack([FORCE, ACC]))


LVM = """LabVIEW Measurement\t
Writer_Version\t2
Reader_Version\t2
Separator\tTab
Decimal_Separator\t{decimal}
Multi_Headings\tNo
X_Columns\t{columns}
Time_Pref\tRelative
***End_of_Header***\t
\t
Channels\t2\t\t
Samples\t600\t600\t
Y_Unit_Label\tN\tg\t
X_Dimension\tTime\tTime\t
X0\t0.0000000000000000E+0\t0.0000000000000000E+0\t
Delta_X\t{step}\t{step}\t
***End_of_Header***\t\t\t
X_Value\tforce\tacc front\tComment
"""


def lvm(path: Path, decimal: str = ".", with_time: bool = True) -> None:
    head = LVM.format(decimal=decimal, columns="One" if with_time else "No", step="0.00048828125".replace(".", decimal))
    rows = [
        f"{t:.9f}\t{f:.6f}\t{a:.6f}" if with_time else f"\t{f:.6f}\t{a:.6f}"
        for t, f, a in zip(TIME, FORCE, ACC, strict=True)
    ]
    rows[0] += "\tbegun"
    path.write_text(head + "\n".join(rows).replace(".", decimal) + "\n", encoding="latin-1")


def lvm_comma(path: Path) -> None:
    lvm(path, ",", with_time=False)


def pandas_csv(path: Path) -> None:
    pd.DataFrame({"t [s]": TIME} | {f"{n} [{UNITS[n]}]": v for n, v in SIGNALS.items()}).to_csv(path, index=False)


def pandas_european(path: Path) -> None:
    pd.DataFrame(SIGNALS).to_csv(path, index=False, sep=";", decimal=",", encoding="utf-16")


def numpy_text(path: Path) -> None:
    np.savetxt(path, np.column_stack([FORCE, ACC]), header="force acc_front")


@pytest.mark.parametrize(
    ("write", "suffix", "names", "rate", "near"),
    [
        (npz, "npz", ("force", "acc front"), RATE, 0),
        (npz_matrix, "npz", ("data 1", "data 2"), RATE, 0),
        (mat5, "mat", ("force", "acc_front"), RATE, 0),
        (mat5_packed, "mat", ("force", "acc_front"), RATE, 0),
        (mat_structure, "mat", ("run.force.values", "run.acc_front.values"), RATE, 0),
        (mat73, "mat", ("force", "acc_front"), RATE, 0),
        (hdf5, "h5", ("force", "acc front"), RATE, 0),
        (hdf5_table, "hdf5", ("log/force", "log/acc front"), RATE, 0),
        (tdms, "tdms", ("force", "acc front"), RATE, 0),
        (tdms_groups, "tdms", ("a/force", "b/acc front"), RATE, 0),
        (universal, "uff", ("force", "acc front"), RATE, 1e-11),
        (universal_binary, "unv", ("force", "acc front"), RATE, 0),
        (universal_big_endian, "unv", ("force", "acc front"), RATE, 0),
        (universal_uneven, "uff", ("force", "acc front"), RATE, 1e-11),
        (universal_of_one_title, "uff", ("Record 1 1+X", "Record 1 1+X (2)"), RATE, 1e-11),
        (wav_float, "wav", ("channel 1", "channel 2"), RATE, 0),
        (lvm, "lvm", ("force", "acc front"), RATE, 0),
        (lvm_comma, "lvm", ("force", "acc front"), RATE, 0),
        (pandas_csv, "csv", ("force [N]", "acc front [g]"), None, 0),
        (pandas_european, "txt", ("force", "acc front"), None, 0),
        (numpy_text, "dat", ("force", "acc_front"), None, 0),
    ],
)
def test_what_other_writers_wrote_is_read(
    write: Callable[[Path], None], suffix: str, names: tuple[str, str], rate: float | None, near: float, tmp_path: Path
) -> None:
    path = tmp_path / f"record.{suffix}"
    write(path)
    columns = read_columns(path)
    for name, value in zip(names, (FORCE, ACC), strict=True):
        np.testing.assert_allclose(columns[name], value, rtol=near, atol=near)
    told = {column.name: column for column in open_lab_file(path).columns}
    assert [told[name].rate for name in names] == ([rate, rate] if rate is None else pytest.approx([rate, rate]))


@pytest.mark.parametrize("write", [mat_structure, hdf5, tdms, universal, lvm, pandas_csv])
def test_units_that_a_file_says_are_told(write: Callable[[Path], None], tmp_path: Path) -> None:
    suffixes = {"mat_structure": "mat", "hdf5": "h5", "universal": "uff", "pandas_csv": "csv"}
    path = tmp_path / f"record.{suffixes.get(write.__name__, write.__name__)}"
    write(path)
    units = {c.name: c.unit for c in open_lab_file(path).columns}
    assert {next(u for n, u in units.items() if word in n) for word in ("force", "acc")} == {"N", "g"}


def test_samples_of_a_wav_file_are_fractions_of_full_scale(tmp_path: Path) -> None:
    for dtype, step in (("<i2", 2.0**-15), ("<i4", 2.0**-31), ("u1", 2.0**-7)):
        full = 1 / step
        samples = np.round(0.5 * np.sin(2 * np.pi * np.arange(200) / 50) * full)
        wavfile.write(tmp_path / "r.wav", 8000, (samples + (128 if dtype == "u1" else 0)).astype(dtype))
        np.testing.assert_array_equal(read_columns(tmp_path / "r.wav")["channel 1"], samples * step)


CUT = [
    (npz, "npz"),
    (mat5, "mat"),
    (mat5_packed, "mat"),
    (mat73, "mat"),
    (hdf5, "h5"),
    (tdms, "tdms"),
    (universal, "uff"),
]
CUT += [(universal_binary, "uff"), (wav16, "wav")]


@pytest.mark.parametrize(("write", "suffix"), CUT)
def test_a_file_that_was_cut_off_is_refused(write: Callable[[Path], None], suffix: str, tmp_path: Path) -> None:
    whole, path = tmp_path / f"whole.{suffix}", tmp_path / f"cut.{suffix}"
    write(whole)
    data = whole.read_bytes()
    for part in (0.0, 0.001, 0.1, 0.47, 0.9, 0.99):
        path.write_bytes(data[: int(part * len(data))])
        with pytest.raises(InputError) as caught:
            read_columns(path)
        assert "\n" not in str(caught.value)
        assert str(path) in str(caught.value)


@pytest.mark.parametrize(
    ("write", "suffix", "said"),
    [
        (tdms, "wav", "is a .tdms file by its first bytes"),
        (hdf5, "tdms", "is a .h5 file by its first bytes"),
        (wav16, "mat", "is a .wav file by its first bytes"),
        (npz, "h5", "is a .npz file by its first bytes"),
        (mat5, "uff", "is a .mat file by its first bytes"),
        (tdms, "csv", "is a TDMS file by its first bytes, expected text"),
        (pandas_csv, "tdms", "cannot be read as a TDMS file"),
        (pandas_csv, "wav", "cannot be read as a WAV file"),
        (pandas_csv, "mat", "cannot be read as a MATLAB file"),
        (pandas_csv, "h5", "cannot be read as an HDF5 file"),
        (pandas_csv, "npz", "cannot be read as npz"),
        (pandas_csv, "uff", "does not end with the line '-1'"),
        (pandas_csv, "lvm", "does not begin with 'LabVIEW Measurement'"),
    ],
)
def test_a_format_under_the_suffix_of_another_is_named(
    write: Callable[[Path], None], suffix: str, said: str, tmp_path: Path
) -> None:
    written = tmp_path / (
        "own" + {"wav16": ".wav", "tdms": ".tdms", "npz": ".npz", "mat5": ".mat"}.get(write.__name__, "")
    )
    write(written)
    path = tmp_path / f"wrong.{suffix}"
    path.write_bytes(written.read_bytes())
    with pytest.raises(InputError) as caught:
        read_columns(path)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_without_the_extra_the_sentence_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package("h5py")
    tdms(tmp_path / "r.tdms")
    monkeypatch.setitem(sys.modules, "nptdms", None)
    with pytest.raises(InputError, match=r"nptdms is not installed, expected pip install 'jointlib\[lab\]'"):
        read_columns(tmp_path / "r.tdms")


@pytest.mark.parametrize("lost", [2, 3, 1001])
def test_a_wav_file_that_was_cut_short_says_so(tmp_path: Path, lost: int) -> None:
    wavfile.write(tmp_path / "a.wav", 8192, np.zeros((5000, 2), dtype=np.int16))
    (tmp_path / "b.wav").write_bytes((tmp_path / "a.wav").read_bytes()[:-lost])
    with pytest.raises(InputError, match=r"b\.wav: ends in the middle of its samples, expected a whole WAV file"):
        read_wave(tmp_path / "b.wav")
