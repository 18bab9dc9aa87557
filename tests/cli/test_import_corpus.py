"""A corpus of files as laboratories have them: each is imported with the right numbers or refused with the readings.

Force and deflection of one test are written in the dialects of programs; what `jointlib import` makes of a file is read
as a measurement, in SI, and compared with the signals that were written.
"""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
import pyuff
import scipy.io
from command_line import jointlib
from nptdms import ChannelObject, TdmsWriter
from scipy.io import wavfile
from test_measurement_file import UFF58
from written_tables import Style

from jointlib.io.measurement_file import read_measurement, read_records

RATE = 1000.0
N = 240
TIME = np.arange(N) / RATE
FORCE = np.round(1500 * np.sin(2 * np.pi * 7 * TIME) + 300 * np.sin(2 * np.pi * 31 * TIME + 1), 3)
"""N"""
TRAVEL = np.round(40 * np.sin(2 * np.pi * 7 * TIME - 0.3) + 0.25, 4)
"""µm"""
NAMES = ("Zeit", "Weg", "Kraft")
UNITS = ("s", "µm", "N")
ROWS = np.column_stack([TIME, TRAVEL, FORCE]).tolist()

EUROPE = Style(";", ",", form=".6f")
OFFICE = Style(";", ",", ".", form=".4f")
PREAMBLE = ("Messung vom 3.4.2023", "Prüfer;Müller", "Abtastrate [Hz];1000", "Bemerkung;keine;weitere", "")


@dataclass(frozen=True)
class Case:
    """A file, how it is imported, and the unit that its numbers are in where the file does not say it."""

    style: Style
    options: tuple[str, ...] = ()
    names: tuple[str, ...] = NAMES
    units: tuple[str, ...] = UNITS
    suffix: str = "csv"
    columns: tuple[int, ...] = (0, 1, 2)
    scales: tuple[float, ...] = (1.0, 1.0, 1.0)
    """Numbers in the file over seconds, micrometres and newtons."""
    extra: tuple[str, ...] = field(default=())

    def write(self, folder: Path) -> Path:
        rows = [[row[k] * self.scales[k] for k in self.columns] for row in ROWS]
        names, units = ([of[k] for k in self.columns] for of in (self.names, self.units))
        return self.style.save(folder / f"record.{self.suffix}", names, units, rows)


BRACKETS = replace(EUROPE, units="brackets")
TEXT = {
    "comma": Case(Style(form=".6f", units="brackets")),
    "comma 17 digits": Case(Style(form=".17g", units="brackets")),
    "comma exponents": Case(Style(form=".9e", units="parentheses")),
    "comma, crlf": Case(Style(form=".6f", units="brackets", end="\r\n")),
    "comma, bom": Case(Style(form=".6f", units="brackets", encoding="utf-8-sig")),
    "comma, quoted": Case(Style(form=".6f", units="brackets", quoted=True)),
    "comma, trailing": Case(Style(form=".6f", units="brackets", trailing=True)),
    "comma, comment names": Case(Style(form=".6f", units="brackets", comment="# ")),
    "comma, unit row": Case(Style(form=".6f", units="row")),
    "comma, unit row in brackets": Case(Style(form=".6f", units="bracketed row")),
    "comma, quoted decimal commas": Case(Style(",", ",", quoted=True, form=".6f", units="brackets")),
    "comma, quoted groups": Case(Style(",", ".", ",", quoted=True, form=".4f", units="brackets")),
    "comma, apostrophes": Case(Style(",", ".", "'", form=".4f", units="brackets")),
    "semicolon, decimal comma": Case(BRACKETS),
    "semicolon, decimal comma, latin-1": Case(replace(BRACKETS, encoding="latin-1")),
    "semicolon, decimal comma, cp1252": Case(replace(BRACKETS, encoding="cp1252", end="\r\n")),
    "semicolon, decimal comma, utf-16": Case(replace(BRACKETS, encoding="utf-16")),
    "semicolon, decimal comma, utf-16 le": Case(replace(BRACKETS, encoding="utf-16-le")),
    "semicolon, decimal comma, bom": Case(replace(BRACKETS, encoding="utf-8-sig")),
    "semicolon, decimal comma, trailing": Case(replace(BRACKETS, trailing=True)),
    "semicolon, decimal comma, blank line": Case(replace(BRACKETS, blank_line=True)),
    "semicolon, decimal comma, unit row": Case(replace(EUROPE, units="row")),
    "semicolon, decimal comma, stroke": Case(replace(EUROPE, units="stroke")),
    "semicolon, decimal comma, units above": Case(replace(EUROPE, units="preamble")),
    "semicolon, decimal comma, quoted": Case(replace(BRACKETS, quoted=True)),
    "semicolon, decimal comma, exponents": Case(replace(BRACKETS, form=".9e")),
    "semicolon, groups": Case(replace(OFFICE, units="brackets")),
    "semicolon, groups of blanks": Case(replace(OFFICE, units="brackets", thousands=" ")),
    "semicolon, groups of narrow blanks": Case(replace(OFFICE, units="brackets", thousands="\u202f")),
    "semicolon, groups of fixed blanks": Case(replace(OFFICE, units="brackets", thousands="\u00a0", encoding="cp1252")),
    "semicolon, point": Case(Style(";", ".", form=".6f", units="brackets")),
    "semicolon, point, groups of commas": Case(Style(";", ".", ",", form=".4f", units="brackets")),
    "semicolon, point, apostrophes": Case(Style(";", ".", "'", form=".4f", units="brackets")),
    "semicolon, preamble": Case(replace(BRACKETS, preamble=PREAMBLE)),
    "semicolon, preamble of 80": Case(replace(BRACKETS, preamble=PREAMBLE * 16)),
    "semicolon, preamble, unit row, latin-1": Case(replace(EUROPE, preamble=PREAMBLE, units="row", encoding="latin-1")),
    "tab, point": Case(Style("\t", form=".6f", units="brackets"), suffix="txt"),
    "tab, point, utf-16": Case(Style("\t", form=".6f", units="brackets", encoding="utf-16"), suffix="txt"),
    "tab, decimal comma": Case(Style("\t", ",", form=".6f", units="brackets"), suffix="tsv"),
    "tab, decimal comma, groups": Case(Style("\t", ",", ".", form=".4f", units="row"), suffix="asc"),
    "tab, groups of blanks": Case(Style("\t", ",", " ", form=".4f", units="brackets"), suffix="txt"),
    "tab, preamble": Case(Style("\t", form=".6f", units="row", preamble=PREAMBLE), suffix="txt"),
    "blanks, point": Case(Style("  ", form=".6f", units="brackets"), suffix="dat"),
    "blanks, one": Case(Style(" ", form=".6f", units="brackets"), suffix="dat"),
    "blanks, decimal comma": Case(Style("   ", ",", form=".6f", units="stroke"), suffix="dat"),
    "blanks, comment names": Case(Style(" ", form=".6f", units="stroke", comment="% "), suffix="dat"),
    "bar": Case(Style("|", form=".6f", units="brackets")),
    "comma and blank": Case(Style(", ", form=".6f", units="brackets")),
    "milliseconds, millimetres, kilonewtons": Case(
        replace(BRACKETS, form=".9f"), units=("ms", "mm", "kN"), scales=(1e3, 1e-3, 1e-3)
    ),
    "inches and pounds": Case(
        Style(form=".12g", units="brackets"), units=("s", "in", "lbf"), scales=(1.0, 1e-6 / 0.0254, 1 / 4.4482216152605)
    ),
    "rate in the preamble, no time": Case(replace(BRACKETS, preamble=PREAMBLE), columns=(1, 2)),
    "dx in the preamble, no time": Case(replace(BRACKETS, preamble=("dx;0,001;s",)), columns=(1, 2)),
    "dx in milliseconds": Case(Style(form=".6f", units="brackets", preamble=("Delta t [ms]: 1.0",)), columns=(1, 2)),
    "rate in kHz": Case(Style("\t", form=".6f", units="row", preamble=("Sample rate: 1.0 kHz",)), columns=(1, 2)),
    "rate in groups": Case(replace(OFFICE, units="row", preamble=("Messrate: 1.000 Hz",)), columns=(1, 2)),
    "rate as set": Case(BRACKETS, ("--set", "sample_rate=1 kHz"), columns=(1, 2)),
    "no units": Case(EUROPE, ("--set", "channel.weg.unit=um", "--set", "channel.kraft.unit=N")),
    "no names": Case(
        replace(EUROPE, units="none"),
        (
            *("--set", "text.header=0", "--set", "sample_rate=1000", "--set", "channel.column_1.quantity=time"),
            *("--set", "channel.column_1.unit=s", "--set", "channel.column_2.quantity=displacement"),
            *("--set", "channel.column_2.unit=um", "--set", "channel.column_3.quantity=force"),
            *("--set", "channel.column_3.unit=N", "--kind", "path"),
        ),
    ),
    "names of no language": Case(
        replace(BRACKETS), ("--set", "channel.b2.quantity=force"), names=("t", "A1x", "B2"), units=("s", "µm", "N")
    ),
}
"""Dialects of text."""


def compared(measurement_file: Path, near: float) -> None:
    """The force in N and the travel in m of the imported record are those that were written."""
    measurement = read_measurement(measurement_file)
    (record,) = read_records(measurement, measurement.records)
    assert record.sample_rate == RATE
    (force,) = (record.channels[c.name] for c in measurement.of("force"))
    (travel,) = (record.channels[c.name] for c in (*measurement.of("displacement"), *measurement.of("position")))
    np.testing.assert_allclose(force, FORCE, rtol=near, atol=near * 1e3)
    np.testing.assert_allclose(travel, TRAVEL * 1e-6, rtol=near, atol=near * 1e-6)


@pytest.mark.parametrize("case", TEXT.values(), ids=TEXT.keys())
def test_a_table_in_some_dialect_becomes_a_measurement(case: Case, tmp_path: Path) -> None:
    record, file = case.write(tmp_path), tmp_path / "m.measurement.toml"
    done = jointlib(["import", str(record), *case.options, "-o", str(file)])
    assert done.status == 0, done
    compared(file, 2e-9 if "e" in case.style.form or case.scales != (1.0, 1.0, 1.0) else 1e-12)


def pandas_excel(path: Path) -> None:
    pd.DataFrame({"Zeit [s]": TIME, "Weg [µm]": TRAVEL, "Kraft [N]": FORCE}).to_csv(
        path, sep=";", decimal=",", index=False, encoding="utf-16"
    )


def csv_module(path: Path) -> None:
    with path.open("w", newline="") as file:
        writer = csv.writer(file, quoting=csv.QUOTE_ALL)
        writer.writerows([["t [s]", "defl. [µm]", "force, P [N]"], *ROWS])


def numpy_text(path: Path) -> None:
    np.savetxt(path, ROWS, delimiter="\t", header="t/s\tx/um\tF/N", fmt="%.9g")


def clock_times(path: Path) -> None:
    rows = [f"2023-05-01 10:00:{t:09.6f},{z!r},{f!r}" for t, z, f in ROWS]
    path.write_text("\n".join(["Timestamp,travel [um],load [N]", *rows]))


def labview(path: Path) -> None:
    head = "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t,\nX_Columns\tOne\n***End_of_Header***\t\n\t\n"
    head += "Channels\t2\nSamples\t240\t240\nY_Unit_Label\tum\tN\nDelta_X\t0,001\t0,001\n***End_of_Header***\t\t\n"
    rows = [f"{t:.6f}\t{z:.6f}\t{f:.6f}".replace(".", ",") for t, z, f in ROWS]
    path.write_text(head + "\n".join(["X_Value\ttravel\tforce\tComment", *rows]) + "\n", encoding="latin-1")


def npz(path: Path) -> None:
    np.savez(path, travel_um=TRAVEL, force=FORCE, fs=RATE)


def mat5(path: Path) -> None:
    scipy.io.savemat(path, {"time": TIME, "travel_um": TRAVEL, "force": FORCE})


def mat_structure(path: Path) -> None:
    signals = {"travel": {"y": TRAVEL, "unit": "um"}, "force": {"y": FORCE, "unit": "N"}}
    scipy.io.savemat(path, {"rec": signals, "dt": 1 / RATE})


def mat73(path: Path) -> None:
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in (("time", TIME), ("travel_um", TRAVEL), ("force", FORCE)):
            file.create_dataset(name, data=value[None, :])
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file".ljust(116) + b"\0" * 8 + b"\x00\x02IM")


def hdf5(path: Path) -> None:
    with h5py.File(path, "w") as file:
        for name, value, unit in (("run/travel", TRAVEL, "um"), ("run/force", FORCE, "N")):
            file.create_dataset(name, data=value).attrs["units"] = unit
        file["run"].attrs["sampling_rate"] = RATE


def tdms(path: Path) -> None:
    with TdmsWriter(path) as writer:
        for name, value, unit in (("travel", TRAVEL, "um"), ("force", FORCE, "N")):
            writer.write_segment([ChannelObject("run", name, value, {"wf_increment": 1 / RATE, "unit_string": unit})])


def universal(path: Path, **changes: object) -> None:
    for name, value, code, unit in (("travel", TRAVEL, 8, "um"), ("force", FORCE, 13, "N")):
        data = {**UFF58, "id1": name, "x": TIME, "data": value, "num_pts": N, "ordinate_spec_data_type": code}
        pyuff.UFF(str(path)).write_sets([{**data, "ordinate_axis_units_lab": unit, **changes}], "add")


def universal_in_mm(path: Path) -> None:
    """Sets 151, 164 and 15 before the signals, as modal files have: lengths in mm, forces in mN, no units."""
    sets = [
        pyuff.prepare_151("m", "d", "p", "01-JAN-23", "10:00:00", 0, 0, 0, "01-JAN-23", "10:00:00", "p", "", ""),
        pyuff.prepare_164(
            units_code=9, units_description="mm", temp_mode=1, length=1e3, force=1e3, temp=1.0, temp_offset=0.0
        ),
        pyuff.prepare_15(node_nums=[1], def_cs=[0], disp_cs=[0], color=[0], x=[0.0], y=[0.0], z=[0.0]),
    ]
    for one in sets:
        pyuff.UFF(str(path)).write_sets([one], "add")
    for name, value, code in (("travel", TRAVEL * 1e-3, 8), ("force", FORCE * 1e3, 13)):
        data = {**UFF58, "id1": name, "x": TIME, "data": value, "num_pts": N, "ordinate_spec_data_type": code}
        pyuff.UFF(str(path)).write_sets([data], "add")


def wav(path: Path) -> None:
    wavfile.write(path, int(RATE), np.column_stack([TRAVEL / 64, FORCE / 2048]))


FORMATS: dict[str, tuple[Callable[[Path], None], str, tuple[str, ...]]] = {
    "pandas": (pandas_excel, "csv", ()),
    "csv module": (csv_module, "csv", ()),
    "numpy text": (numpy_text, "txt", ()),
    "clock times": (clock_times, "csv", ()),
    "LabVIEW text": (labview, "lvm", ()),
    "npz": (npz, "npz", ("--set", "channel.travel_um.quantity=displacement", "--set", "channel.travel_um.unit=um")),
    "MATLAB 5": (mat5, "mat", ("--set", "channel.travel_um.unit=um", "--set", "channel.time.quantity=time")),
    "MATLAB structure": (mat_structure, "mat", ()),
    "MATLAB 7.3": (mat73, "mat", ("--set", "channel.travel_um.unit=um")),
    "HDF5": (hdf5, "h5", ()),
    "TDMS": (tdms, "tdms", ()),
    "universal": (universal, "uff", ()),
    "universal, uneven": (lambda path: universal(path, abscissa_spacing=0), "unv", ()),
    "universal in mm": (universal_in_mm, "unv", ()),
    "WAV": (
        wav,
        "wav",
        (
            *(
                "--set",
                "channel.channel_1.quantity=displacement",
                "--set",
                "channel.channel_1.unit=um",
                "--kind",
                "path",
            ),
            *("--set", "channel.channel_1.gain=64", "--set", "channel.channel_2.quantity=force"),
            *("--set", "channel.channel_2.gain=2048"),
        ),
    ),
}


@pytest.mark.parametrize(("write", "suffix", "options"), FORMATS.values(), ids=FORMATS.keys())
def test_what_another_program_wrote_becomes_a_measurement(
    write: Callable[[Path], None], suffix: str, options: tuple[str, ...], tmp_path: Path
) -> None:
    record, file = tmp_path / f"record.{suffix}", tmp_path / "m.measurement.toml"
    write(record)
    done = jointlib(["import", str(record), *options, "-o", str(file)])
    assert done.status == 0, done
    compared(file, 1e-10)


REFUSED = {
    "three decimals, all above one": ("t;z;F\n1,234;5,678;9,123\n", "as 1.234, 5.678, 9.123", "as 1234, 5678, 9123"),
    "three decimals and points": ("t;z;F\n1.234;5.678;9.123\n", "as 1.234, 5.678, 9.123", "as 1234, 5678, 9123"),
    "three decimals between tabs": ("t\tz\tF\n1.234\t5.678\t9.123\n", "--set text.decimal=", "as 1234, 5678, 9123"),
    "commas in two meanings": ("t,z,F\n0,001,1,5,2,5\n", "as 0, 1, 1, 5, 2, 5", "as 0.001, 1.5, 2.5"),
    "one column": ("F\n1,5\n2,25\n", "as 1, 5", "as 1.5"),
    "no names, commas": ("1,5\n2,25\n", "as 1, 5", "as 1.5"),
    "groups of blanks between tabs": ("1 234\t5 678\n2 000\t3 000\n", "as 1234, 5678", "as 1, 234, 5, 678"),
    "large numbers between semicolons": ("z;F\n" + "1,000;12,345\n" * 3000, "as 1, 12.345", "as 1000, 12345"),
}


@pytest.mark.parametrize(("text", "one", "other"), REFUSED.values(), ids=REFUSED.keys())
def test_what_can_be_read_in_two_ways_is_refused(text: str, one: str, other: str, tmp_path: Path) -> None:
    (tmp_path / "record.csv").write_text(text)
    done = jointlib(["import", str(tmp_path / "record.csv"), "-o", str(tmp_path / "m.measurement.toml")])
    assert (done.status, done.out) == (2, "")
    assert "can be read in two ways" in done.err
    assert one in done.err
    assert other in done.err
    assert [path.name for path in tmp_path.iterdir()] == ["record.csv"]


def test_the_corpus_is_as_large_as_it_should_be() -> None:
    assert len(TEXT) + len(FORMATS) + len(REFUSED) >= 80
