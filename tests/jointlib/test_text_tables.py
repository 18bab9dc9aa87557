"""Tables of numbers in any dialect: what was written is read, or refused with both readings, and never read wrongly."""

from __future__ import annotations

import random
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from repeats import repeats
from written_tables import Style, odd_table

from jointlib.errors import InputError
from jointlib.io.measurement_file import read_measurement, read_records
from jointlib.lab.dialect import Told
from jointlib.lab.text_table import read_table
from jointlib.lab.unit_words import unit_of

DECIDED = {";": (".", ","), "\t": (".", ","), " ": (".", ","), ",": (".",), "|": (".", ",")}


@st.composite
def styles(draw: st.DrawFn) -> Style:
    separator = draw(st.sampled_from(sorted(DECIDED)))
    quoted = separator not in " " and draw(st.booleans())
    decimal = draw(st.sampled_from((".", ",") if quoted else DECIDED[separator]))
    groups = [mark for mark in ("", ",", ".", " ", "'", "\u00a0") if mark != decimal and (quoted or mark != separator)]
    groups = [mark for mark in groups if separator != " " or mark not in (" ", "\u00a0")]
    encodings = ("utf-8", "utf-8-sig", "utf-16", "latin-1", "cp1252")
    return Style(
        separator=separator,
        decimal=decimal,
        thousands=draw(st.sampled_from(groups)),
        form=draw(st.sampled_from([".3f", ".6f", ".4e", ".17g", ".6g", ".1f"])),
        encoding=draw(st.sampled_from(encodings)),
        end=draw(st.sampled_from(["\n", "\r\n"])),
        units=draw(st.sampled_from(["none", "brackets", "parentheses", "row", "bracketed row", "preamble"])),
        preamble=tuple(draw(st.lists(st.sampled_from(PREAMBLE), max_size=80))),
        blank_line=draw(st.booleans()),
        quoted=quoted,
        trailing=separator != " " and draw(st.booleans()),
    )


PREAMBLE = (
    "Messung vom 3.4.2023",
    "Operator; Müller",
    "Channels;3",
    "Rate [Hz]\t51200",
    "",
    "Temperature 21,5 °C",
    "---",
)
VALUES = st.floats(-1e7, 1e7).map(lambda v: round(v, 6)) | st.integers(-5000, 5000).map(float) | st.just(0.25)
ROWS = st.integers(2, 4).flatmap(lambda n: st.lists(st.lists(VALUES, min_size=n, max_size=n), min_size=1, max_size=8))
NAMES = ("Zeit", "acc front", "Kraft P", "µ-Weg")
UNITS = ("s", "g", "N", "µm")


@pytest.mark.slow
@settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(style=styles(), rows=ROWS)
def test_numbers_in_any_dialect_come_back_equal(style: Style, rows: list[list[float]], tmp_path: Path) -> None:
    count = len(rows[0])
    names = [name.replace(" ", "_") if style.separator == " " else name for name in NAMES[:count]]
    path = style.save(tmp_path / "any.csv", names, UNITS[:count], rows)
    try:
        table = read_table(path)
    except InputError as error:
        if not re.search("in (two|several) ways", str(error)):
            raise
        thousands = " " if style.thousands == "\u00a0" else style.thousands
        table = read_table(path, Told(style.separator, style.decimal, thousands))
    heads = {"brackets": "{} [{}]", "parentheses": "{} ({})"}.get(style.units, "{}")
    assert table.names == tuple(heads.format(n, u) for n, u in zip(names, UNITS, strict=False))
    if style.units not in ("none", "preamble"):
        assert table.units == UNITS[:count]
    np.testing.assert_array_equal(np.transpose(table.columns), [[style.read_back(v) for v in row] for row in rows])


@pytest.mark.slow
@pytest.mark.parametrize("seed", repeats(range(8), lambda seed: False))
def test_no_table_is_read_wrongly_however_odd(seed: int, tmp_path: Path) -> None:
    rng, read = random.Random(seed), 0
    for _ in range(250):
        text, numbers = odd_table(rng)
        try:
            table = read_table(saved(tmp_path, text))
        except InputError as error:
            if not re.search("in (two|several) ways|names and the rows below|expected . numbers a row", str(error)):
                raise
            continue
        assert np.array_equal(np.transpose(table.columns), numbers), text[:300]
        read += 1
    assert read > 175


def saved(folder: Path, text: str, encoding: str = "utf-8") -> Path:
    path = folder / "table.csv"
    path.write_bytes(text.encode(encoding))
    return path


def refusal(path: Path, told: Told | None = None) -> str:
    with pytest.raises(InputError) as caught:
        read_table(path, told)
    assert "\n" not in str(caught.value)
    return str(caught.value)


TWO_WAYS = [
    ("t;a\n1,234;5,678\n", ["as 1.234, 5.678", "as 1234, 5678", 'decimal = ","', 'decimal = "."']),
    ("t\ta\n21.345\t22.456\n", ["as 21.345, 22.456", "as 21345, 22456"]),
    ("t,a,b\n0,001,1,5,2,5\n", ["as 0, 1, 1, 5, 2, 5", "as 0.001, 1.5, 2.5"]),
    ("a\n1,5\n2,25\n", ["as 1, 5", "as 1.5"]),
    ("1,2\n3,4\n", ["as 1, 2", "as 1.2"]),
    ("1,2,3\n4,5,6\n", ["as 1, 2, 3", "as 1.2, 3"]),
    ("t, s,F, N\n0,001,1,5\n", ["as 0, 1, 1, 5", "as 0.001, 1, 5"]),
    ("0.5,12,345.5\n0.6,13,456.5\n", ["as 0.5, 12, 345.5", "as 0.5, 12345.5"]),
    ("force\n829,358\n", ["as 829.358", "as 829358"]),
    ("1 234\t5 678\n2 000\t3 000\n", ["as 1234, 5678", "as 1, 234, 5, 678"]),
]


@pytest.mark.parametrize(("text", "said"), TWO_WAYS, ids=[text for text, _ in TWO_WAYS])
def test_what_can_be_read_in_two_ways_is_refused_with_both(text: str, said: list[str], tmp_path: Path) -> None:
    sentence = refusal(saved(tmp_path, text))
    assert re.search("can be read in (two|several) ways", sentence)
    for words in said:
        assert words in sentence


def test_the_key_that_is_named_decides(tmp_path: Path) -> None:
    path = saved(tmp_path, "t;a\n1,234;5,678\n")
    assert [float(c[0]) for c in read_table(path, Told(decimal=",")).columns] == [1.234, 5.678]
    assert [float(c[0]) for c in read_table(path, Told(decimal=".")).columns] == [1234.0, 5678.0]
    path = saved(tmp_path, "t,a,b\n0,001,1,5,2,5\n")
    assert [float(c[0]) for c in read_table(path, Told(decimal=",")).columns] == [0.001, 1.5, 2.5]


def test_one_number_late_in_a_file_decides_for_all(tmp_path: Path) -> None:
    rows = ["1,234;5,678"] * 3000
    assert "two ways" in refusal(saved(tmp_path, "\n".join(["t;a", *rows])))
    rows[1500] = "1,234;5,67"
    table = read_table(saved(tmp_path, "\n".join(["t;a", *rows])))
    assert (table.columns[1][0], table.columns[1][1500]) == (5.678, 5.67)
    rows[1500] = "1,234;5,678.5"
    table = read_table(saved(tmp_path, "\n".join(["t;a", *rows])))
    assert (table.columns[1][0], table.columns[1][1500]) == (5678.0, 5678.5)


def test_groups_that_begin_late_are_read(tmp_path: Path) -> None:
    rows = [f"{i / 10:.1f}".replace(".", ",") + ";0,5" for i in range(3000)]
    rows[2000] = "200,0;1.234,5"
    table = read_table(saved(tmp_path, "\n".join(["t;a", *rows])))
    assert (table.columns[0][1999], table.columns[1][2000]) == (199.9, 1234.5)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("t;a\n0.1;0,1\n0.2;0,2\n", "line 2 is '0.1;0,1', expected 2 numbers a row"),
        ("t,a\n0.1,1\n0.2\n0.3,3\n", "line 3 is '0.2', expected 2 numbers a row"),
        ("t,a\n0.1,1\n0.2,OVLD\n0.3,3\n", "line 3 is '0.2,OVLD', expected 2 numbers a row"),
        ("t,a\n0.1,1,7\n0.2,2,8\n", "line 1 has 2 names and the rows below it 3 cells"),
        ("t,a\n0.1,1\n0.2,1\n0.3", "line 4 is '0.3', expected 2 numbers a row"),
        ("t;a\n0,1;1;7\n0,2;2\n0,3;3\n", "line 2 is '0,1;1;7', expected 2 numbers a row"),
        ("t;a\n0,1;OVLD\n0,2;2\n0,3;3\n", "line 2 is '0,1;OVLD', expected 2 numbers a row"),
        ("some words\nand more\n", "no row of numbers"),
        ("t;a\n" + "0,1;1,5\n" * 5 + "\nt;a\n" + "0,1;1,5\n" * 7, "lines 2 to 6 and 9 to 15 are tables of their own"),
        (
            "t;a\n" + "0,1;1\n" * 5 + "again\nt;x;b\n" + "0,1;1;A\n" * 7,
            "lines 2 to 6 and 8 to 15 are tables of their own",
        ),
        ("t a\n" + "1 2\n" * 3 + "t a\n" + "1 2\n" * 9, "lines 2 to 4 and 6 to 14 are tables of their own"),
        ("t;a\n" + "0,1;1,5\n" * 2000 + "0,1;1.5\n", "line 2002 is '0,1;1.5', expected 2 numbers a row"),
    ],
)
def test_a_row_unlike_the_others_is_named(text: str, said: str, tmp_path: Path) -> None:
    assert said in refusal(saved(tmp_path, text))


def test_clock_times_are_seconds_since_the_first_row(tmp_path: Path) -> None:
    text = "Date;Time;acc [g];note\n" + "".join(
        f"31.12.2023;{t};{a};ok\n" for t, a in (("23:59:58,5", "1,5"), ("23:59:59,0", "2,5"), ("23:59:59,5", "3,5"))
    )
    table = read_table(saved(tmp_path, text))
    assert (table.names, table.clocks, table.left_out) == (("Time", "acc [g]"), ("Time",), ("Date", "note"))
    np.testing.assert_array_equal(table.columns[0], [0.0, 0.5, 1.0])
    stamps = read_table(saved(tmp_path, "t,a\n2023-12-31T23:59:59.5Z,1\n2024-01-01T00:00:00.25Z,2\n"))
    np.testing.assert_array_equal(stamps.columns[0], [0.0, 0.75])


def test_minutes_and_seconds_with_decimals_are_a_clock(tmp_path: Path) -> None:
    table = read_table(saved(tmp_path, "t,a\n09:59.998,1\n09:59.999,2\n10:00.000,3\n"))
    np.testing.assert_allclose(table.columns[0], [0, 1e-3, 2e-3], atol=1e-9)
    assert table.clocks == ("t",)


def test_a_measurement_reads_semicolons_with_decimal_commas(tmp_path: Path) -> None:
    saved(tmp_path, "Weg;Kraft\n0,5;10,25\n-1,5;20,75\n", "latin-1")
    file = tmp_path / "m.measurement.toml"
    file.write_text(
        'schema = "jointlib/measurement/1"\nkind = "static"\n'
        '[[channel]]\nname = "Weg"\nquantity = "displacement"\nunit = "mm"\n'
        '[[channel]]\nname = "Kraft"\nquantity = "force"\n[[record]]\nfile = "table.csv"\n'
    )
    measurement = read_measurement(file)
    (record,) = read_records(measurement, measurement.records)
    np.testing.assert_allclose(record.channels["Weg"], [5e-4, -1.5e-3])
    np.testing.assert_array_equal(record.channels["Kraft"], [10.25, 20.75])


@pytest.mark.parametrize(
    ("first", "what"),
    [(b"PK\x03\x04..", "a zip archive"), (b"TDSm\0\0", "a TDMS file"), (b"\x89HDF\r\n", "an HDF5 file")],
)
def test_another_format_called_csv_is_named(first: bytes, what: str, tmp_path: Path) -> None:
    path = tmp_path / "wrong.csv"
    path.write_bytes(first)
    assert f"is {what}" in refusal(path)


def test_rows_of_labels_between_names_and_numbers_are_no_names(tmp_path: Path) -> None:
    text = "Zeit;Weg;Kraft\ns;mm;N\nSensor;100;10,2\n0,0;0,5;1,5\n0,1;0,25;1,75\n"
    table = read_table(saved(tmp_path, text))
    assert (table.names, table.units) == (("Zeit", "Weg", "Kraft"), ("s", "mm", "N"))
    np.testing.assert_array_equal(table.columns[1], [0.5, 0.25])


def test_cells_in_quotation_marks_may_begin_late(tmp_path: Path) -> None:
    rows = ["1,2"] * 2000
    rows[1000] = '"1","2"'
    table = read_table(saved(tmp_path, "\n".join(['"a","b"', *rows])))
    assert [len(c) for c in table.columns] == [2000, 2000]
    assert all(np.all(c == v) for c, v in zip(table.columns, (1.0, 2.0), strict=True))


@pytest.mark.parametrize("remarks", [{}, {7: "knocked"}, {0: "start", 30: "stop 2"}, {59: "end"}], ids=len)
@pytest.mark.parametrize("mark", [";", "\t", "|"])
def test_a_column_of_remarks_that_few_rows_have_is_left_out(mark: str, remarks: dict[int, str], tmp_path: Path) -> None:
    rows = ["Rig 3;Date: 3 November", "t;F;s;remark", "ms;kN;um;"]
    rows += [f"{i};{0.5 * i:.2f};{3.0 - i:.1f};{remarks.get(i, '')}" for i in range(60)]
    (tmp_path / "a.csv").write_text("\n".join(rows).replace(";", mark) + "\n")
    found = read_table(tmp_path / "a.csv")
    assert found.names == ("t", "F", "s")
    assert found.units == ("ms", "kN", "um")
    assert found.left_out == ("remark",)
    np.testing.assert_array_equal(found.columns[1], 0.5 * np.arange(60))


def test_two_tables_of_which_one_has_a_text_behind_its_last_row_are_two(tmp_path: Path) -> None:
    rows = ["a,b", *(f"{i},{i * i}" for i in range(9)), "second, and last", "c,d", *(f"{i},{i}" for i in range(9))]
    with pytest.raises(InputError, match="lines 2 to 10 and 13 to 21 are tables of their own"):
        read_table(saved(tmp_path, "\n".join(rows)))


@pytest.mark.parametrize("mark", [";", "\t", "|", ","])
def test_rows_may_end_before_a_column_of_remarks(mark: str, tmp_path: Path) -> None:
    rows = [f"{i};{0.5 * i:.2f}" + (";knocked" if i in (34, 52) else "") for i in range(60)]
    text = "\n".join(["t;F;remark", *rows])
    found = read_table(saved(tmp_path, text.replace(";", mark)))
    assert found.names == ("t", "F")
    assert found.left_out == ("remark",)
    np.testing.assert_array_equal(found.columns[1], [float(f"{0.5 * i:.2f}") for i in range(60)])


def test_a_name_too_many_without_any_remark_is_refused(tmp_path: Path) -> None:
    assert "3 names" in refusal(saved(tmp_path, "t;F;s\n0;1\n1;2\n2;3\n"))


@pytest.mark.parametrize("unit", ["deg_C", "Celsius", "degSpecimen"])
def test_one_unit_that_nobody_knows_makes_a_row_of_units_none_of_names(unit: str, tmp_path: Path) -> None:
    """As a testing machine for elastomers writes it; the units were taken for names, and the names for a title."""
    path = tmp_path / "mount.txt"
    head = f"# specimen 4711\nTime\tAxial Displacement\tAxial Force\tTemperature\nsec\tmm\tNewtons\t{unit}\n"
    path.write_text(head + "".join(f"{k / 100}\t{0.1 * k}\t{3.5 * k}\t23.4\n" for k in range(20)))
    table = read_table(path)
    assert table.names == ("Time", "Axial Displacement", "Axial Force", "Temperature")
    assert [unit_of(u) for u in table.units[:3]] == ["s", "mm", "N"]
