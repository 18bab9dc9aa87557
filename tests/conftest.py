"""Make sibling test modules importable, keep plots off the screen, use one thread, and parse names once."""

from __future__ import annotations

import functools
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest import mock

import pytest

os.environ.setdefault("MPLBACKEND", "Agg")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
for folder in ("", "jointlib", "machines", "fmu"):
    sys.path.insert(0, str(Path(__file__).parent / folder))


@pytest.fixture(scope="session", autouse=True)
def _names_are_parsed_once() -> Iterator[None]:
    """FMPy asks a general grammar about each name of a variable, as long as compiling an FMU takes; the same names
    stand in hundreds of FMUs."""
    import lark

    original = lark.Lark

    @functools.cache
    def parser(grammar: str, **options: Any) -> SimpleNamespace:
        return SimpleNamespace(parse=functools.cache(original(grammar, **options).parse))

    with mock.patch.object(lark, "Lark", parser):
        yield
