"""Machine files with something wrong in them, made at random from those that ship."""

from __future__ import annotations

import copy
import math
import random
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

WRONG: tuple[Any, ...] = (
    math.nan,
    math.inf,
    -math.inf,
    0,
    -1,
    -1.0,
    1e300,
    -1e300,
    1e-300,
    10**30,
    10**400,
    1e70,
    -1e-70,
    2.5,
    1e-9,
    True,
    False,
    "",
    "x",
    "ground",
    "slide.x",
    "nan",
    "1e400 N",
    "-3 kg",
    "3 furlongs",
    "nowhere.toml",
    "m.toml",
    ".",
    "\x00",
    [],
    [[]],
    [1, 2],
    ["a", 1],
    [[1, 2], [3]],
    {},
    {"kind": "lumped"},
    [{}],
)


def places(value: Any, path: tuple[Any, ...] = (), numbers: bool = False) -> Iterator[tuple[Any, ...]]:
    """Paths to everything in a document, or to its numbers alone."""
    if path and (not numbers or type(value) in (int, float)):
        yield path
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        yield from places(inner, (*path, key), numbers)


def mutated(text: str, seed: int) -> tuple[dict[str, Any], str]:
    """A document with one or two changes, and what they are."""
    rng = random.Random(seed)
    document, said = tomllib.loads(text), []
    # Numbers are picked more often than they stand there: most of the rest is refused by its name.
    for _ in range(rng.choice([1, 1, 1, 2])):
        *above, key = rng.choice([*places(document), *places(document, numbers=True)])
        holder: Any = document
        for step in above:
            holder = holder[step]
        change = rng.choice(["delete", "wrong", "wrong", "unknown", "double", "swap", "scale", "scale", "scale"])
        said.append(f"{change} {'.'.join(map(str, (*above, key)))}")
        if change == "delete":
            del holder[key]
        elif change == "unknown" and isinstance(holder, dict):
            holder[f"{key}s"] = holder.pop(key)
        elif change == "double" and isinstance(holder, list):
            holder.append(copy.deepcopy(holder[key]))
        elif change == "scale" and type(holder[key]) in (int, float):
            holder[key] *= rng.choice([-1, 1e3, 1e-3, 1e6, 1e-6, 1e30, 0])
        elif change == "swap":
            *other, last = rng.choice(list(places(document)))
            source: Any = document
            for step in other:
                source = source[step]
            holder[key] = copy.deepcopy(source[last])
        else:
            holder[key] = copy.deepcopy(rng.choice(WRONG))
            said[-1] += f" = {holder[key]!r}"
    return document, "; ".join(said)


def library(folder: Path) -> list[Path]:
    """The machine files that ship."""
    return sorted(p for p in folder.glob("*.toml") if 'schema = "jointlib/machine/1"' in p.read_text("utf-8"))
