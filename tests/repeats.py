"""Which of many cases of one statement are tested always, which are thorough, and which only repeat and are slow."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable
from typing import Any

import pytest


def _true(_: Any) -> bool:
    return True


def repeats(cases: Iterable[Any], always: Callable[[Any], bool], often: Callable[[Any], bool] = _true) -> list[Any]:
    """Cases for ``parametrize``: the first question chooses what runs by default, the second what is ``thorough``;
    the rest is ``slow``. A tuple is a case of several arguments."""

    def marked(case: Any) -> Any:
        values = case if isinstance(case, tuple) else (case,)
        if always(case):
            return pytest.param(*values)
        return pytest.param(*values, marks=pytest.mark.thorough if often(case) else pytest.mark.slow)

    return [marked(case) for case in cases]


def firsts(cases: Iterable[Any], kind: Callable[[Any], Hashable]) -> list[Any]:
    """The first case of each kind."""
    found: dict[Hashable, Any] = {}
    for case in cases:
        found.setdefault(kind(case), case)
    return list(found.values())
