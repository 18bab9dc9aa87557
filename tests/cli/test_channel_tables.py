"""Channels as a laboratory has them: its headings, sensitivities, units and signs; keys that nobody reads."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from command_line import jointlib

from jointlib.errors import InputError
from jointlib.io.measurement_file import read_measurement, read_records
from jointlib.measurement import Measurement, Record

HEAD = 'schema = "jointlib/measurement/1"\n'
PATH = HEAD + 'kind = "path"\nsample_rate = 1000\n'
TWO = '[[channel]]\nname = "F"\nquantity = "force"\n[[channel]]\nname = "z"\nquantity = "position"\n'
RECORD = '[[record]]\nfile = "r.csv"\n'


def written(folder: Path, text: str) -> Path:
    file = folder / "m.measurement.toml"
    file.write_text(text, "utf-8")
    return file


def opened(folder: Path, text: str) -> tuple[Measurement, Record]:
    measurement = read_measurement(written(folder, text))
    (record,) = read_records(measurement, measurement.records)
    return measurement, record


def of_one_channel(folder: Path, keys: str) -> np.ndarray:
    """The record of a path whose third channel, over a column 1, 2, 3, has these keys."""
    (folder / "r.csv").write_text("F,z,x\n" + "".join(f"0.5,0.25,{i}\n" for i in (1, 2, 3)))
    _, record = opened(folder, f'{PATH}{TWO}[[channel]]\nname = "x"\n{keys}\n{RECORD}')
    return record.channels["x"]


@pytest.mark.parametrize(
    ("keys", "factor"),
    [
        ('quantity = "acceleration"\nunit = "g"', 9.80665),
        ('quantity = "acceleration"\nunit = "G"', 9.80665),
        ('quantity = "acceleration"\nunit = "g_n"', 9.80665),
        ('quantity = "acceleration"\nunit = "mg"', 9.80665e-3),
        ('quantity = "acceleration"\nunit = "m/sec2"', 1.0),
        ('quantity = "acceleration"\nunit = "mm/s²"', 1e-3),
        ('quantity = "force"\nunit = "kN"', 1e3),
        ('quantity = "force"\nunit = "lbf"', 4.4482216152605),
        ('quantity = "displacement"\nunit = "µm"', 1e-6),
        ('quantity = "displacement"\nunit = "\u03bcm"', 1e-6),
        ('quantity = "displacement"\nunit = "um"', 1e-6),
        ('quantity = "displacement"\nunit = "in"', 0.0254),
        ('quantity = "displacement"\nunit = "mil"', 2.54e-5),
        ('quantity = "position"\nunit = "in"', 0.0254),
        ('quantity = "acceleration"\nsensitivity = "100 mV/g"', 98.0665),
        ('quantity = "acceleration"\nsensitivity = "10.2 mV/(m/s^2)"', 1 / 0.0102),
        ('quantity = "acceleration"\nsensitivity = "100 mV/g"\nunit = "mV"', 0.0980665),
        ('quantity = "acceleration"\nsensitivity = "100 mV/g"\ngain = 0.1', 9.80665),
        ('quantity = "force"\nsensitivity = "2.5 mV/N"', 400.0),
        ('quantity = "force"\nsensitivity = "4 pC/N"\nunit = "pC"', 0.25),
        ('quantity = "force"\nsensitivity = "10 mV/lbf"', 444.82216152605),
        ('quantity = "force"\nsensitivity = "14.7 N/A"', 14.7),
        ('quantity = "force"\nsensitivity = "20 mA/N"', 50.0),
        ('quantity = "force"\nsensitivity = "0.5 kN/A"\nunit = "mA"', 0.5),
        ('quantity = "force"\nsensitivity = "35 N/V"', 35.0),
        ('quantity = "velocity"\nunit = "mm/s"\ndirection = "-z"', -1e-3),
        ('quantity = "force"\ndirection = "+x"', 1.0),
    ],
)
def test_units_sensitivities_and_signs_of_a_lab(keys: str, factor: float, tmp_path: Path) -> None:
    np.testing.assert_allclose(of_one_channel(tmp_path, keys), factor * np.array([1, 2, 3]), rtol=1e-13)


def test_temperatures_are_shifted_to_kelvin(tmp_path: Path) -> None:
    celsius = of_one_channel(tmp_path, 'quantity = "temperature"\nunit = "degC"')
    np.testing.assert_allclose(celsius, [274.15, 275.15, 276.15])
    fahrenheit = of_one_channel(tmp_path, 'quantity = "temperature"\nunit = "degF"\ngain = 32')
    np.testing.assert_allclose(fahrenheit, np.array([0.0, 32.0, 64.0]) * 5 / 9 + 273.15)


def test_full_scale_and_clipping_follow_the_sensitivity(tmp_path: Path) -> None:
    text = f'{PATH}{TWO}[[channel]]\nname = "x"\nquantity = "force"\nsensitivity = "2 mV/N"\nrange = 5\n{RECORD}'
    assert read_measurement(written(tmp_path, text)).channel("x").full_scale == pytest.approx(2500.0)


RIG = (
    HEAD
    + """kind = "rig"
sample_rate = 1000
driven = "block"
[bodies]
block = 1
rail = 2
[[channel]]
name = "front"
column = "acc front [g]"
role = "a1"
quantity = "acceleration"
unit = "g"
body = "block"
[[channel]]
name = "back"
column = "acc back [g]"
role = "a2"
quantity = "acceleration"
unit = "g"
direction = "-x"
body = "rail"
"""
)


def test_a_rig_knows_its_channels_by_role(tmp_path: Path) -> None:
    (tmp_path / "r.csv").write_text("t [s];acc front [g];acc back [g]\n0,000;0,5;1\n0,001;0,25;2\n")
    more = '[[correction]]\nfamily = "gain"\nchannel = "back"\ngain = 1.0\n'
    measurement, record = opened(tmp_path, RIG + RECORD + more)
    assert [c.name for c in measurement.channels] == ["a1", "a2"]
    np.testing.assert_allclose(record.channels["a1"], [0.5 * 9.80665, 0.25 * 9.80665])
    np.testing.assert_allclose(record.channels["a2"], [-9.80665 / 2, -9.80665])
    assert record.ignored == ("t [s]",)
    assert measurement.corrections[0].channel == "a2"


def test_inspect_tells_the_column_of_a_channel_and_what_is_done_to_it(tmp_path: Path) -> None:
    (tmp_path / "r.csv").write_text("t [s];acc front [g];acc back [g];T\n0,000;0,5;1;20,5\n0,001;0,25;2;21\n")
    warm = '[[channel]]\nname = "T"\nquantity = "temperature"\nunit = "degC"\n'
    done = jointlib(["inspect", str(written(tmp_path, RIG + warm + RECORD))])
    assert "channel a2 (column 'acc back [g]'): acceleration of rail in g, times -9.80665 gives m/s^2" in done.out
    assert "channel T: temperature in degC, times 1 and 273.15 more gives K" in done.out


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            PATH + '[bodies]\ncarriage = "unknown"\n' + TWO + RECORD,
            "bodies has no place in a measurement of kind 'path'",
        ),
        (PATH + 'driven = "x"\n' + TWO + RECORD, "driven has no place in a measurement of kind 'path'"),
        (PATH + TWO + 'body = "x"\n' + RECORD, "body has no place in a measurement of kind 'path'"),
        (PATH + TWO + 'role = "a1"\n' + RECORD, "role has no place in a measurement of kind 'path'"),
        (
            PATH.replace("path", "static") + "period = 10\n" + TWO + RECORD,
            "period has no place in a measurement of kind 's",
        ),
        (
            PATH.replace("path", "static") + TWO + RECORD + "start = 1\n",
            "start has no place in a measurement of kind 'sta",
        ),
        (RIG.replace('driven = "block"', 'driven = "block"\ncarriage = 3') + RECORD, "carriage has no place"),
        (
            HEAD
            + 'kind = "frf"\nsample_rate = 10\n[[record]]\nfile = "f.csv"\ndrive = "a"\nresponse = "a"\nforce = 1\n',
            "sample_rate has no place in a measurement of kind 'frf'",
        ),
        (PATH + "[notes]\na = 1\n" + TWO + RECORD, "unknown key 'notes'"),
        (RIG.replace('"a1"', '"a9"') + RECORD, "role is 'a9', did you mean 'a3'?"),
        (RIG.replace('direction = "-x"', 'direction = "up"') + RECORD, "direction is 'up', expected one of"),
        (
            RIG.replace('unit = "g"\ndirection', 'sensitivity = "100 mV"\ndirection') + RECORD,
            "expected volts, coulombs or amperes",
        ),
        (RIG.replace('unit = "g"\ndirection', 'sensitivity = "9 mV/N"\ndirection') + RECORD, "unit 'N' does not fit"),
        (PATH + '[text]\nseparator = "dot"\n' + TWO + RECORD, "separator is 'dot', expected one of"),
        (PATH + '[text]\ndecimal = ","\nthousands = ","\n' + TWO + RECORD, "the decimal mark too"),
    ],
)
def test_what_nobody_reads_or_understands_is_refused(text: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        read_measurement(written(tmp_path, text))
    assert said in str(caught.value)
    assert "(line " in str(caught.value)


def test_the_dialect_that_a_file_tells_is_used(tmp_path: Path) -> None:
    (tmp_path / "r.csv").write_text("F;z\n1,234;5,678\n")
    with pytest.raises(InputError, match="can be read in two ways"):
        opened(tmp_path, PATH + TWO + RECORD)
    _, record = opened(tmp_path, PATH + '[text]\ndecimal = "."\n' + TWO + RECORD)
    assert (record.channels["F"][0], record.channels["z"][0]) == (1234.0, 5678.0)
    (tmp_path / "r.csv").write_text("1.5;2.5\n3.5;4.5\n")
    named = TWO.replace('"F"', '"column 1"').replace('"z"', '"column 2"')
    _, record = opened(tmp_path, PATH + "[text]\nheader = 0\n" + named + RECORD)
    np.testing.assert_array_equal(record.channels["column 2"], [2.5, 4.5])


def test_many_faults_are_told_twenty_at_a_time_and_all_as_data(tmp_path: Path) -> None:
    wrong = "".join(f'[[channel]]\nname = "c{i}"\nquantity = "foo"\n' for i in range(23))
    file = written(tmp_path, PATH + TWO + wrong + RECORD)
    done = jointlib(["inspect", str(file)])
    first, *told, last = done.err.splitlines()
    assert (done.status, first, last) == (2, "jointlib: 23 faults", "and 3 more")
    assert len(told) == 20
    done = jointlib(["inspect", str(file), "--json"])
    faults = json.loads(done.out)["faults"]
    lines = file.read_text("utf-8").splitlines()
    assert len(faults) == 23
    for i, fault in enumerate(faults):
        assert fault["file"] == str(file)
        assert lines[fault["line"] - 1] == 'quantity = "foo"'
        assert fault["fault"].startswith(f"[[channel]] {i + 3} (c{i}): quantity is 'foo'")


def test_a_fault_without_a_file_is_data_too() -> None:
    done = jointlib("df none.joint.toml --amplitude 1um --frequency 500 --json")
    said = "no such file, expected a joint file"
    assert json.loads(done.out) == {"faults": [{"file": "none.joint.toml", "line": None, "fault": said}]}
    assert done.err == f"jointlib: none.joint.toml: {said}\n"
    done = jointlib("df none.joint.toml --amplitude 1N --frequency 500 --json")
    assert json.loads(done.out)["faults"][0]["file"] is None


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ('column = "acc [g]"\nquantity = "acceleration"', "the heading 'acc [g]' says 'g', expected unit = 'g'"),
        ('column = "F (mV)"\nquantity = "force"\nsensitivity = "2.5 mV/N"', "expected unit = 'mV'"),
        ('column = "F [V]"\nquantity = "force"', "expected unit = 'V'"),
    ],
)
def test_a_unit_that_the_heading_denies_is_not_assumed(keys: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=re.escape(said)):
        read_measurement(written(tmp_path, f'{PATH}{TWO}[[channel]]\nname = "x"\n{keys}\n{RECORD}'))
    (channel,) = read_measurement(
        written(
            tmp_path, f'{PATH}{TWO}[[channel]]\nname = "x"\ncolumn = "a [m/s²]"\nquantity = "acceleration"\n{RECORD}'
        )
    ).channels[2:]
    assert channel.factor == 1.0
