"""TOML documents read key by key: units, nearest names for typos, one sentence for whatever is wrong."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import tomli_w

from jointlib.errors import InputError, nearest
from jointlib.io.atomic import write_text
from jointlib.units import quantity


class Section:
    """One table of a document; every key is taken once and :meth:`done` refuses what is left.

    ``where`` starts every message: the file, then the path of keys.
    """

    def __init__(self, table: dict[str, Any], where: str, folder: Path) -> None:
        self.where = where
        self.folder = folder
        self._left = dict(table)
        self._known: set[str] = set()

    def has(self, key: str) -> bool:
        """True if the key is there and not yet taken."""
        self._known.add(key)
        return key in self._left

    def take(self, key: str, default: Any = ...) -> Any:
        """The raw value of a key; without a default it must be there."""
        self._known.add(key)
        if key in self._left:
            return self._left.pop(key)
        if default is ...:
            close = difflib.get_close_matches(key, self._left, n=1, cutoff=0.7)
            meant = f", did you mean it by {close[0]!r}?" if close else ""
            raise InputError(f"{self.where}: key {key!r} is missing{meant}")
        return default

    def text(self, key: str, default: Any = ..., choices: tuple[str, ...] = ()) -> str:
        """A string, one of ``choices`` if given."""
        value = self.take(key, default)
        if value is default:
            return value  # type: ignore[no-any-return]
        if not isinstance(value, str):
            raise InputError(f"{self.where}: {key} is {value!r}, expected a string")
        if choices and value not in choices:
            raise InputError(f"{self.where}: {key} is {value!r}, {nearest(value, choices)}")
        return value

    def flag(self, key: str, default: bool = False) -> bool:
        """true or false."""
        value = self.take(key, default)
        if not isinstance(value, bool):
            raise InputError(f"{self.where}: {key} is {value!r}, expected true or false")
        return value

    def integer(self, key: str, default: Any = ..., lower: int = 0) -> int:
        """A whole number of at least ``lower``."""
        value = self.take(key, default)
        if value is default:
            return value  # type: ignore[no-any-return]
        if not isinstance(value, int) or isinstance(value, bool) or value < lower:
            raise InputError(f"{self.where}: {key} is {value!r}, expected a whole number of at least {lower}")
        return value

    def number(self, key: str, unit: str, default: Any = ...) -> float:
        """A value in ``unit`` (SI; Hz and rpm for frequency and spindle speed)."""
        value = self.take(key, default)
        return value if value is default else quantity(value, unit, f"{self.where}: {key}")

    def numbers(self, key: str, unit: str, default: Any = ..., length: int | None = None) -> tuple[float, ...]:
        """A list of values in ``unit``."""
        value = self.take(key, default)
        if value is default:
            return value  # type: ignore[no-any-return]
        if not isinstance(value, list) or (length is not None and len(value) != length):
            wanted = f"a list of {length} values" if length is not None else "a list"
            raise InputError(f"{self.where}: {key} is {value!r}, expected {wanted}")
        return tuple(quantity(v, unit, f"{self.where}: {key}[{i}]") for i, v in enumerate(value))

    def matrix(self, key: str, unit: str, default: Any = ...) -> tuple[tuple[float, ...], ...]:
        """A list of rows of one length."""
        value = self.take(key, default)
        if value is default:
            return value  # type: ignore[no-any-return]
        rows = value if isinstance(value, list) else []
        if not rows or not all(isinstance(row, list) and len(row) == len(rows[0]) > 0 for row in rows):
            raise InputError(f"{self.where}: {key} is {value!r}, expected a list of rows of equal length")
        spot = f"{self.where}: {key}"
        return tuple(
            tuple(quantity(v, unit, f"{spot}[{i}][{j}]") for j, v in enumerate(row)) for i, row in enumerate(rows)
        )

    def words(self, key: str, default: Any = ...) -> tuple[str, ...]:
        """A list of strings."""
        value = self.take(key, default)
        if value is default:
            return value  # type: ignore[no-any-return]
        if not isinstance(value, list) or not all(isinstance(v, str) for v in value):
            raise InputError(f"{self.where}: {key} is {value!r}, expected a list of strings")
        return tuple(value)

    def section(self, key: str) -> Section:
        """A sub-table; empty if it is not there."""
        value = self.take(key, {})
        if not isinstance(value, dict):
            raise InputError(f"{self.where}: {key} is {value!r}, expected a table")
        return Section(value, f"{self.where}: [{key}]", self.folder)

    def sections(self, key: str) -> Iterator[Section]:
        """Every table of an array of tables ``[[key]]``."""
        value = self.take(key, [])
        if not isinstance(value, list) or not all(isinstance(v, dict) for v in value):
            raise InputError(f"{self.where}: {key} is {value!r}, expected tables [[{key}]]")
        for i, table in enumerate(value):
            label = table.get("name", table.get("kind", table.get("file", "")))
            tag = f" ({label})" if isinstance(label, str) and label else ""
            yield Section(table, f"{self.where}: [[{key}]] {i + 1}{tag}", self.folder)

    def raw(self) -> dict[str, Any]:
        """The table as it was parsed, without the keys already taken; what is changed in it is read changed."""
        return self._left

    def keys(self) -> tuple[str, ...]:
        """Keys not yet taken."""
        return tuple(self._left)

    def path(self, key: str, default: Any = ...) -> Path:
        """A file name relative to the document."""
        value = self.text(key, default)
        return value if value is default else self.folder / value

    def done(self) -> None:
        """Refuse the first key that nobody asked for, naming the nearest valid one."""
        for key in self._left:
            raise InputError(f"{self.where}: unknown key {key!r}, {nearest(key, self._known)}")


def read_toml(path: Path, kind: str) -> Section:
    """Open ``schema = "jointlib/<kind>/1"``."""
    try:
        table = tomllib.loads(Path(path).read_bytes().decode("utf-8-sig"))
    except FileNotFoundError:
        raise InputError(f"{path}: no such file, expected a {kind} file") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read ({error})") from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: not valid TOML: {error}") from None
    section = Section(table, str(path), Path(path).parent)
    schema = section.take("schema", None)
    if schema != f"jointlib/{kind}/1":
        raise InputError(f'{path}: schema is {schema!r}, expected "jointlib/{kind}/1"')
    return section


def write_toml(path: Path, kind: str, table: dict[str, Any]) -> None:
    """Write a document whole or not at all; floats read back exactly."""
    write_text(path, tomli_w.dumps({"schema": f"jointlib/{kind}/1", **table}))
