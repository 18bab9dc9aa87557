"""The acceptance suite of the periodic route: every figure that is demanded, on records of an independent generator."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from cells import GROUPS, cells_of
from summary import MISSED, Figure, figures, read
from table import run_all

pytestmark = pytest.mark.slow
DEMANDED = figures([])


@pytest.fixture(scope="module")
def reached(tmp_path_factory: pytest.TempPathFactory) -> list[Figure]:
    """Every cell of the suite, run now: an hour or two."""
    out: Path = tmp_path_factory.mktemp("acceptance") / "results.jsonl"
    run_all(cells_of(g for g in GROUPS if g != "quick"), out, max(1, os.cpu_count() or 1), print)
    return figures(read(out))


def _case(index: int, figure: Figure) -> object:
    known = MISSED.get(figure.demand)
    marks = () if known is None else (pytest.mark.xfail(reason=known, strict=False),)
    return pytest.param(index, id=f"{figure.number}: {figure.demand}", marks=marks)


@pytest.mark.parametrize("index", [_case(i, f) for i, f in enumerate(DEMANDED)])
def test_what_is_demanded_is_reached(reached: list[Figure], index: int) -> None:
    figure = reached[index]
    assert figure.cells > 0, figure.demand
    assert figure.met, f"{figure.demand}: {figure.words()} of {figure.cells} runs"
