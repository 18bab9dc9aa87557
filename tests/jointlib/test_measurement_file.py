"""Measurement files and records: every format read, every fault named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import pyuff
import scipy.io

from jointlib.errors import InputError
from jointlib.io.measurement_file import read_measurement, read_records

RIG = """schema = "jointlib/measurement/1"
kind = "rig"
sample_rate = "1 kHz"
period = 10
driven = "runner_block"
[bodies]
runner_block = { mass = 0.942, u = 1e-4 }
rail = "2200 g"
[[channel]]
name = "a1"
quantity = "acceleration"
body = "runner_block"
unit = "g0"
[[channel]]
name = "a2"
quantity = "acceleration"
body = "rail"
unit = "mm/s^2"
gain = 2.0
[[channel]]
name = "P"
quantity = "force"
unit = "kN"
[[record]]
file = "r.csv"
"""
COLUMNS = {"a1": np.arange(40.0), "a2": np.sin(np.arange(40.0)), "P": np.ones(40), "note": np.zeros(40)}

EXPONENTS = [
    f"{axis}_{of}_unit_exp"
    for axis in ("abscissa", "ordinate", "orddenom", "z_axis")
    for of in ("len", "force", "temp")
]
LABELS = [
    f"{axis}_axis{part}_lab" for axis in ("abscissa", "ordinate", "orddenom", "z_axis") for part in ("", "_units")
]
TYPES = [f"{axis}_spec_data_type" for axis in ("abscissa", "ordinate", "orddenom", "z_axis")]
UFF58 = {
    **{"type": 58, "binary": 0, "func_type": 1, "ver_num": 0, "load_case_id": 0, "ord_data_type": 4, "num_pts": 40},
    **{f"id{i}": "none" for i in range(2, 6)},
    **{"rsp_ent_name": "NONE", "rsp_node": 1, "rsp_dir": 1, "ref_ent_name": "NONE", "ref_node": 1, "ref_dir": 1},
    **{"abscissa_spacing": 1, "abscissa_min": 0.0, "abscissa_inc": 1e-3, "z_axis_value": 0.0},
    **dict.fromkeys(EXPONENTS, 0),
    **dict.fromkeys(LABELS, "NONE"),
    **dict.fromkeys(TYPES, 0),
}
"""A time history as a universal file wants it: every field filled."""


def save_csv(path: Path, columns: dict[str, np.ndarray]) -> None:
    rows = zip(*columns.values(), strict=True)
    text = [",".join(columns), *(",".join(repr(float(x)) for x in row) for row in rows)]
    path.write_text("\n".join(text) + "\n")


@pytest.fixture
def rig(tmp_path: Path) -> Path:
    save_csv(tmp_path / "r.csv", COLUMNS)
    (tmp_path / "rig.measurement.toml").write_text(RIG)
    return tmp_path / "rig.measurement.toml"


def changed(rig: Path, old: str, new: str) -> Path:
    text = rig.read_text()
    assert old in text
    rig.write_text(text.replace(old, new, 1))
    return rig


def refusal(path: Path) -> str:
    def read() -> None:
        measurement = read_measurement(path)
        read_records(measurement, measurement.records)

    with pytest.raises(InputError) as caught:
        read()
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_channels_are_converted_to_si_and_other_columns_reported(rig: Path) -> None:
    measurement = read_measurement(rig)
    (record,) = read_records(measurement, measurement.records)
    np.testing.assert_allclose(record.channels["a1"], 9.80665 * COLUMNS["a1"])
    np.testing.assert_allclose(record.channels["a2"], 2e-3 * COLUMNS["a2"])
    np.testing.assert_allclose(record.channels["P"], 1000.0)
    assert record.ignored == ("note",)
    assert measurement.bodies["rail"].value == pytest.approx(2.2)
    assert measurement.bodies["runner_block"].uncertainty == 1e-4


@pytest.mark.parametrize("suffix", ["csv", "npz", "mat", "uff"])
def test_every_format_gives_the_same_samples(rig: Path, suffix: str) -> None:
    path = rig.parent / f"r.{suffix}"
    if suffix == "npz":
        np.savez(path, **COLUMNS)
    elif suffix == "mat":
        scipy.io.savemat(path, {name: value[:, None] for name, value in COLUMNS.items()})
    elif suffix == "uff":
        for name, value in COLUMNS.items():
            data = {**UFF58, "id1": name, "x": np.arange(40) / 1e3, "data": value}
            pyuff.UFF(str(path)).write_sets([data], "add")
    measurement = read_measurement(changed(rig, "r.csv", f"r.{suffix}"))
    (record,) = read_records(measurement, measurement.records)
    # ASCII universal files carry single precision.
    np.testing.assert_allclose(record.channels["a2"], 2e-3 * COLUMNS["a2"], rtol=1e-6 if suffix == "uff" else 1e-14)


def test_rows_take_a_part_of_a_file(rig: Path) -> None:
    measurement = read_measurement(changed(rig, 'file = "r.csv"', 'file = "r.csv"\nrows = [10, 30]'))
    (record,) = read_records(measurement, measurement.records)
    np.testing.assert_allclose(record.channels["P"], np.full(20, 1000.0))
    np.testing.assert_allclose(record.channels["a1"], 9.80665 * np.arange(10, 30))


def test_a_missing_mass_that_was_found_is_added_and_a_gain_undone(rig: Path) -> None:
    faults = '[[correction]]\nfamily = "missing-mass"\nbody = "rail"\nmass = 0.05\n'
    faults += '[[correction]]\nfamily = "gain"\nchannel = "P"\ngain = 0.25\n'
    rig.write_text(rig.read_text() + faults)
    measurement = read_measurement(rig)
    assert measurement.bodies["rail"].value == pytest.approx(2.25)
    np.testing.assert_allclose(read_records(measurement, measurement.records)[0].channels["P"], 800.0)


def test_volts_are_accepted_on_a_path(tmp_path: Path) -> None:
    save_csv(tmp_path / "c.csv", {"V1": np.arange(5.0), "V2": np.arange(5.0)})
    path = tmp_path / "c.measurement.toml"
    path.write_text(
        'schema = "jointlib/measurement/1"\nkind = "path"\nsample_rate = 610.35\n'
        '[[channel]]\nname = "V1"\nquantity = "force"\nunit = "V"\n'
        '[[channel]]\nname = "V2"\nquantity = "displacement"\nunit = "V"\n[[record]]\nfile = "c.csv"\n'
    )
    assert read_measurement(path).channel("V2").si_unit == "V"


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"r.csv"', '"absent.csv"', "absent.csv: no such file"),
        ('name = "a2"', 'name = "acc2"', "channel 'a2' is missing"),
        ('name = "P"', 'name = "Q"', "no column 'Q'"),
        ('rail = "2200 g"', 'rail = "2200 N/mm"', "unit 'N/mm' does not fit, expected one like 'kg'"),
        ('rail = "2200 g"', "rail = -1", "expected a positive mass"),
        ('unit = "kN"', 'unit = "kg"', "unit 'kg' does not fit, expected one like 'N'"),
        ('file = "r.csv"', 'file = "r.csv"\nsample_rate = "2 kHz"', "different sample rates (1000 Hz and 2000 Hz)"),
        ("period = 10", "perod = 10", "unknown key 'perod', did you mean 'period'?"),
        ("period = 10", 'band = ["5 kHz", "2 kHz"]', "expected low before high"),
        ('kind = "rig"', 'kind = "rigg"', "did you mean 'rig'?"),
        ('driven = "runner_block"', 'driven = "runner"', "did you mean 'runner_block'?"),
        ('quantity = "force"', 'quantity = "forse"', "did you mean 'force'?"),
        ('file = "r.csv"', 'file = "r.csv"\nrows = [30, 10]', "expected [first, end)"),
        ('file = "r.csv"', 'file = "r.csv"\nrows = [0, 99]', "the file has 40"),
        ('file = "r.csv"', 'file = "r.csv"\nrole = "sealed"', 'no record has role = "fit"'),
        ('"r.csv"', '"r.xyz"', "r.xyz: no such file"),
        ('sample_rate = "1 kHz"', "", "sample_rate is missing"),
    ],
)
def test_a_wrong_declaration_gets_one_sentence(rig: Path, old: str, new: str, said: str) -> None:
    assert said in refusal(changed(rig, old, new))


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("", "empty, expected a header row"),
        ("a1,a2,P\n", "has a header but no samples"),
        ("a1,a2,P\n1,2,3\n4,nan,6\n", "column 'a2' row 1 is nan"),
        ("a1,a2,P\n1,2,3\n4,x,6\n", "expected 3 numbers a row"),
        ("1.5,2,3\n4,5.5,6\n", "expected a header row with channel names"),
        ("a1,a1,P\n1,2,3\n", "a column name stands twice"),
    ],
)
def test_a_wrong_record_gets_one_sentence(rig: Path, content: str, said: str) -> None:
    (rig.parent / "r.csv").write_text(content)
    assert said in refusal(rig)


def test_channels_of_different_length_are_named(rig: Path) -> None:
    np.savez(rig.parent / "r.npz", **{**COLUMNS, "P": np.ones(39)})
    assert "channels of different length (a1 40, a2 40, P 39)" in refusal(changed(rig, "r.csv", "r.npz"))


@pytest.mark.parametrize(
    ("step", "said"), [(-1e-3, "time goes backwards at row 1"), (2e-3, "the time column runs at 500 Hz")]
)
def test_a_clock_that_contradicts_the_rate_is_named(rig: Path, step: float, said: str) -> None:
    save_csv(rig.parent / "r.csv", {**COLUMNS, "t": step * np.arange(40)})
    rig.write_text(rig.read_text().replace("[[record]]", '[[channel]]\nname = "t"\nquantity = "time"\n[[record]]'))
    assert said in refusal(rig)


def test_pickled_arrays_are_not_opened(rig: Path) -> None:
    np.savez(rig.parent / "r.npz", a1=np.array([{"a": 1}], dtype=object))
    assert "cannot be read as npz" in refusal(changed(rig, "r.csv", "r.npz"))
