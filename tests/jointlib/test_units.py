"""Units at the door: what is read, what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from jointlib.errors import InputError
from jointlib.units import _COMMON, _factor, quantity, with_error


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("25 N/um", "N/m", 25e6),
        ("1um", "m", 1e-6),
        ("654.164 N/µm", "N/m", 654.164e6),
        ("45 deg", "rad", np.pi / 4),
        ("3.9e-8 m/N^(2/3)", "m/N^(2/3)", 3.9e-8),
        ("503 N s/m", "N s/m", 503.0),
        ("9.81 m/s2", "m/s^2", 9.81),
        ("4000 rpm", "rpm", 4000.0),
        ("2 kHz", "Hz", 2000.0),
        (0.942, "kg", 0.942),
        ("50", "N", 50.0),
    ],
)
def test_a_value_is_read_in_si(text: object, unit: str, value: float) -> None:
    assert quantity(text, unit, "here") == value


@pytest.mark.parametrize(
    ("text", "unit", "said"),
    [
        ("1 N/mm", "kg", "file: key: unit 'N/mm' does not fit, expected one like 'kg'"),
        ("3 parsecs/fortnight^", "m", "is not known"),
        ("1 foo", "kg", "unit 'foo' is not known"),
        ("abc", "kg", "expected a number with a unit"),
        ("3,5 mm", "m", "file: key: '3,5 mm', a decimal comma: write 3.5 mm"),
        ("-0,25", "N", "file: key: '-0,25', a decimal comma: write -0.25"),
        ("1.200,5 rpm", "rpm", "a decimal comma: write 1200.5 rpm"),
        ("7,5 kHz", "Hz", "a decimal comma: write 7.5 kHz"),
        ("1,200 rpm", "rpm", "a decimal comma: write 1.200 rpm, or 1200 rpm where it groups thousands"),
        (float("nan"), "kg", "expected a finite value"),
        ("nan kg", "kg", "expected a number"),
        ("1e999 kg", "kg", "expected a finite value"),
        (True, "kg", "expected a number"),
        ([1], "kg", "expected a number"),
        ("5 rpm", "Hz", "expected Hz"),
        ("5 rad/s", "rpm", "expected rpm"),
    ],
)
def test_what_does_not_fit_is_refused_in_one_sentence(text: object, unit: str, said: str) -> None:
    with pytest.raises(InputError) as refusal:
        quantity(text, unit, "file: key")
    assert said in str(refusal.value)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    "unit", ["m # /s", "m;", "m\\", "m\nN", "m 'a'", "$m", "m{}", "m @", "m,m", "m\u200b", "m[0]", "m)"]
)
def test_a_sign_that_no_unit_has_is_not_passed_over(unit: str) -> None:
    """The reader of units takes ``m,m`` as mm, and reads no further than a ``#``."""
    with pytest.raises(InputError, match="is not known, expected one like 'm'"):
        quantity(f"1 {unit}", "m", "x")


@pytest.mark.parametrize(
    ("unit", "expected", "value"),
    [
        ("N·m", "N m", 1.0),
        ("kN/(mm s^2)", "N/m/s^2", 1e6),
        ("N/mm²", "N/m^2", 1e6),
        ("%", "1", 0.01),
        ("°", "rad", 0.0174533),
    ],
)
def test_signs_that_units_have_are_read(unit: str, expected: str, value: float) -> None:
    assert quantity(f"1 {unit}", expected, "x") == pytest.approx(value, rel=1e-6)


def test_a_unit_with_another_zero_is_no_factor() -> None:
    with pytest.raises(InputError, match="unit 'degC' has its zero elsewhere, expected one like 'K'"):
        quantity("20 degC", "K", "reference")


def test_g_is_that_of_free_fall_where_no_mass_fits() -> None:
    assert quantity("0.5 g", "m/s^2", "x") == pytest.approx(4.903325)
    assert quantity("2 g/N", "m/s^2/N", "x") == pytest.approx(19.6133)
    assert quantity("500 g", "kg", "x") == 0.5


@pytest.mark.parametrize(("expected", "unit"), [(e, u) for e, units in _COMMON.items() for u in units])
def test_common_units_are_those_of_the_units_package_to_the_last_bit(expected: str, unit: str) -> None:
    assert _COMMON[expected][unit] == _factor(unit, expected)


@pytest.mark.parametrize(
    ("value", "error", "unit", "said"),
    [
        (39.1481e6, 0.0213e6, "N/m", "39.148 ± 0.021 N/µm"),
        (11.5291e-3, 2.2e-3, "s", "11.5 ± 2.2 ms"),
        (431.27e-6, 12e-6, "s", "431 ± 12 µs"),
        (11529.1, 2213.0, "N", "11500 ± 2200 N"),
        (99.96, 9.96, "N", "100 ± 10 N"),
        (0.2, 4.4, "N", "0.2 ± 4.4 N"),
        (12345678.0, 23456.0, "W", "1.2346e7 ± 0.0023e7 W"),
        (3.931408e-8, 2.2e-10, "m/N^(2/3)", "3.931e-8 ± 0.022e-8 m/N^(2/3)"),
        (12.34567, 0.0, "N", "12.35 N"),
        (12.34567, float("nan"), "1", "12.35"),
    ],
)
def test_a_value_has_the_digits_that_its_error_bears(value: float, error: float, unit: str, said: str) -> None:
    assert with_error(value, error, unit) == said
