"""Arguments that carry units, and options that take several values in a row."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from jointlib.cli.alone import alone_in
from jointlib.errors import InputError
from jointlib.io.atomic import no_name, to_write
from jointlib.units import frequency_range, quantity, within

_VALUE = re.compile(r"[+-]?(\d|\.\d)", re.ASCII)
_NUMBER = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(\D.*)?", re.ASCII)
_DECIMAL_COMMA = re.compile(r"(\d+),(\d+)\s*([^\d\s.,eE].*)")


class Quantity(click.ParamType[float]):
    """A number in SI (Hz, rpm) or with its unit: ``1e-6``, ``1um``, ``50N``; within what ``lower``, ``upper`` say."""

    def __init__(self, unit: str, lower: float | None = None, upper: float | None = None) -> None:
        self.unit = unit
        self.name = unit
        self.lower = lower
        self.upper = upper

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        where = param.opts[0] if param is not None else "value"
        found = quantity(value.strip() if isinstance(value, str) else value, self.unit, where)
        return within(found, self.lower, self.upper, self.unit, where, value)


class Words(click.ParamType[str]):
    """A word of its own kind, of which several may follow in a row; files and options are none."""

    name = "words"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        return str(value)


class FrequencyRange(click.ParamType[tuple[float, float, int | None]]):
    """``lo:hi`` or ``lo:hi:n`` in Hz or with units."""

    name = "lo:hi:n"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[float, float, int | None]:
        where = param.opts[0] if param is not None else "frequency"
        return frequency_range(str(value).split(":"), where, str(value))


class Target(click.ParamType[Path]):
    """A file to write, or a folder to write into; what stands in the way is said before any work is done."""

    name = "path"

    def __init__(self, *suffixes: str, folder: bool = False, shared: bool = False) -> None:
        self.suffixes = suffixes
        self.folder = folder
        self.shared = shared  # with others of its kind, which see to what each of them writes

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        where = param.opts[0] if param is not None else "output"
        found = to_write(value, where, *self.suffixes, folder=self.folder)
        if self.folder and ctx is not None and not ctx.resilient_parsing:
            ctx.with_resource(alone_in(found, where, self.shared))
        return found


class Verb(click.Command):
    """A verb whose options with ``multiple=True`` also take several values in a row, or joined by commas."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        listed = {
            name: option.type
            for option in self.params
            if isinstance(option, click.Option) and option.multiple
            for name in option.opts
        }
        out: list[str] = []
        rest = list(args)
        while rest:
            token = rest.pop(0)
            name, equals, first = token.partition("=")
            if name not in listed:
                out.append(token)
                continue
            taken = [first] if equals else rest[:1]
            rest = rest if equals else rest[1:]
            belongs = _belongs(listed[name])
            while rest and belongs(rest[0]):
                taken.append(rest.pop(0))
            for item in taken:
                if isinstance(listed[name], Quantity):
                    _one_reading(name, item)
            values = [value for item in taken for value in item.split(",")]
            kind = listed[name]
            if isinstance(kind, Quantity) and kind.unit == "m":
                _one_unit(name, kind, values)
            for value in values:
                out += [name, value]
            if not taken:
                out.append(name)
        return super().parse_args(ctx, out)


def _is_there(word: str) -> bool:
    return no_name(word) is None and Path(word).exists()


def _one_reading(name: str, text: str) -> None:
    """Refuse ``1,5um``, which may be 1.5 µm, or 1 m and 5 µm."""
    found = _DECIMAL_COMMA.fullmatch(text.strip())
    if found is not None:
        first, second, unit = found.groups()
        one = first + ("" if len(second) == 3 and first != "0" else ".") + second + unit
        each = f"{first}{unit},{second}{unit}"
        raise InputError(f"{name}: {text!r}, a number with a comma or two with one unit, expected {one} or {each}")


def _one_unit(name: str, kind: Quantity, values: list[str]) -> None:
    """Refuse ``1 2 5um``, which may be 1, 2 and 5 µm, or 1 m, 2 m and 5 µm."""
    found = [match for match in map(_NUMBER.fullmatch, map(str.strip, values)) if match is not None]
    bare = [match[1] for match in found if not match[2] and float(match[1]) and "e" not in match[1].lower()]
    units = [match[2] for match in found if match[2]]
    if not bare or not units or all(quantity(f"1 {unit}", kind.unit, name) == 1 for unit in units):
        return
    raise InputError(
        f"{name}: {' '.join(values)}, numbers with a unit and without, expected a unit at each, such as "
        f"{bare[0]}{units[-1]}, or {bare[0]}{kind.unit} if that is meant"
    )


def _belongs(kind: click.ParamType[Any]) -> Callable[[str], bool]:
    """Whether a further word is one more value of the option before it."""
    if isinstance(kind, Quantity):
        return lambda word: bool(_VALUE.match(word)) and not _is_there(word)
    if isinstance(kind, click.Choice):
        return lambda word: word in kind.choices
    if isinstance(kind, click.IntRange):
        return lambda word: word.isascii() and word.isdigit()
    if isinstance(kind, Words):
        return lambda word: not word.startswith("-") and Path(word).suffix != ".toml" and not _is_there(word)
    from jointlib.registry import names

    return lambda word: word in names("jointlib.laws")


tool_option = click.option(
    "--tool",
    "changes",
    callback=lambda _ctx, _param, name: {} if name is None else {"tool.use": name},
    metavar="NAME",
    help="Which of several named tools is in the machine; default: the one its file says.",
)
"""Hands a verb the changes that make it so, for `machines.read_machine`."""


def refuse_tool(file: Path, changes: dict[str, str]) -> None:
    """Refuse a tool by name of what is no machine."""
    if changes:
        raise InputError(f"--tool: {file} is no machine, expected a machine with several tools")


json_option = click.option("--json", "as_json", is_flag=True, help="Print JSON and nothing else.")


class Given(click.ParamType[Path]):
    """A file to read; the door that reads it says what is wrong with it, but for a name that no file can have."""

    name = "path"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        wrong = no_name(str(value))
        if wrong is not None:
            where = (param.opts[0] if param.opts[0].startswith("-") else param.opts[0].upper()) if param else "file"
            raise InputError(f"{where}: is {wrong}, expected the name of a file")
        return Path(value)


def input_file(name: str, **keywords: Any) -> Callable[[Any], Any]:
    """A positional file name."""
    return click.argument(name, type=Given(), **keywords)
