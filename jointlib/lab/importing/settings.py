"""What is said on the command line by ``--set KEY=VALUE``: keys of the measurement file, dotted."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from jointlib.errors import InputError, nearest

TOP = ("kind", "sample_rate", "period", "settle", "band", "driven", "carriage", "modal_mass", "simulated")
TABLES = ("text", "bodies", "channel", "record", "estimate", "cutting", "verdict")
_WORDS = {
    *("kind", "driven", "name", "column", "role", "quantity", "unit", "sensitivity", "direction", "body", "dof"),
    *(
        "separator",
        "decimal",
        "thousands",
        "encoding",
        "condition",
        "drive",
        "response",
        "response_at",
        "drive_at",
        "file",
        "mode",
        "process",
        "tool",
        "acts_on",
    ),
}
"""Keys whose value is a word even where it looks like a number."""


@dataclass(frozen=True)
class Settings:
    """Values by key: at the top, in ``[text]`` and other tables, and of channels and records by their name."""

    top: Mapping[str, Any] = field(default_factory=dict)
    text: Mapping[str, Any] = field(default_factory=dict)
    bodies: Mapping[str, Any] = field(default_factory=dict)
    estimate: Mapping[str, Any] = field(default_factory=dict)
    cutting: Mapping[str, Any] = field(default_factory=dict)
    verdict: Mapping[str, Any] = field(default_factory=dict)
    """What the words of a table of cuts mean."""
    channel: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    record: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)


def settings_of(pairs: Sequence[str]) -> Settings:
    """The settings in words like ``channel.acc_x.unit=g``."""
    found: dict[str, Any] = {"top": {}, **{name: {} for name in TABLES}}
    for pair in pairs:
        path, equals, value = pair.partition("=")
        keys = [key.strip() for key in path.split(".")]
        if not equals or not all(keys):
            raise InputError(f"--set: {pair!r}, expected KEY=VALUE as channel.acc_x.unit=g")
        if len(keys) == 1:
            if keys[0] not in TOP:
                raise InputError(f"--set: {keys[0]!r}, {nearest(keys[0], (*TOP, *TABLES))}")
            found["top"][keys[0]] = _value(keys[0], value)
            continue
        table, *inside = keys
        if table not in TABLES:
            raise InputError(f"--set: {pair!r}, {nearest(table, TABLES)}")
        if table in ("channel", "record"):
            if len(inside) < 2:
                raise InputError(f"--set: {pair!r}, expected {table}.NAME.KEY=VALUE")
            name, key = ".".join(inside[:-1]), inside[-1]
            found[table].setdefault(name, {})[key] = _value(key, value)
        else:
            key = ".".join(inside)
            found[table][key] = _value(key, value)
    return Settings(**found)


def _value(key: str, text: str) -> Any:
    """A number, flag, list or table where the text is one of TOML, else the word."""
    if key in _WORDS:
        return text if not text.startswith('"') else text.strip('"')
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except (ValueError, RecursionError):
        return text.strip()
