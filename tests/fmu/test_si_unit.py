"""Units in the model description."""

from __future__ import annotations

import pytest

from fmu.system.si_unit import exponents, table_unit, turned
from machines.components.connection import units_between


@pytest.mark.parametrize(
    ("unit", "expected"),
    [
        ("N", {"kg": 1, "m": 1, "s": -2}),
        ("N/m", {"kg": 1, "s": -2}),
        ("N s/m", {"kg": 1, "s": -1}),
        ("N s^2/m^2", {"kg": 1, "m": -1}),
        ("N/m^3", {"kg": 1, "m": -2, "s": -2}),
        ("N/(m^2 (m/s)^1)", {"kg": 1, "m": -2, "s": -1}),
        ("1", {}),
        ("rad", {"rad": 1}),
        ("m/N^(2/3)", None),
        ("furlong", None),
        ("N/", None),
    ],
)
def test_exponents_of_the_base_units(unit: str, expected: dict[str, int] | None) -> None:
    assert exponents(unit) == expected


@pytest.mark.parametrize("i", range(4))
@pytest.mark.parametrize("j", range(4))
def test_entry_of_a_table_times_its_powers_is_a_force(i: int, j: int) -> None:
    entry = exponents(table_unit("N/(m^i (m/s)^j)", i, j))
    assert entry is not None
    total = {base: entry.get(base, 0) for base in ("kg", "m", "s")}
    total["m"] += i + j
    total["s"] -= j
    assert total == exponents("N")


@pytest.mark.parametrize(
    ("along", "about"),
    [
        *units_between(["table.ry", "ground"]).items(),
        ("m/N^(2/3)", "rad/(N m)^(2/3)"),
        ("N s^2/m^2", "N m s^2/rad^2"),
        ("N s/m^3", "N m s/rad^3"),
        *((unit, unit) for unit in ("1", "Hz", "rad", "")),
    ],
)
def test_what_turns_has_angles_and_moments(along: str, about: str) -> None:
    assert turned(along) == about


def test_entries_are_written_without_needless_powers() -> None:
    written = [table_unit("N/(m^i (m/s)^j)", i, j) for i, j in ((0, 0), (1, 0), (0, 1), (2, 1))]
    assert written == ["N", "N/m", "N s/m", "N s/m^3"]
    assert table_unit("N", 2, 1) == "N"
