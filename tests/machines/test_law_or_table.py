"""A law with a cause is not given up for a table without one because contacts differ from its form."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from jointlib.loop.answer.report import Verdict
from machines.loop.fit import Fold
from machines.loop.judge import Judged, judge
from machines.loop.trace import _or_the_table

POINTS = 400


def explaining(share: float, family: str, size: int) -> Judged:
    """An explanation that removes a share of what was missing, on what was fitted and on what was left out alike."""
    rng = np.random.default_rng(1)
    before = 100 * (rng.standard_normal(POINTS) + 1j * rng.standard_normal(POINTS))
    rest = np.sqrt(1 - share) * before
    fitted = SimpleNamespace(
        residual=rest,
        loss=float(np.sum(np.abs(rest) ** 2)),
        u=np.zeros(size),
        hypothesis=SimpleNamespace(place=SimpleNamespace(name="flange"), family=family),
        penalty=0.0,
    )
    fold = Fold("all", np.arange(POINTS), None)  # type: ignore[arg-type]
    return Judged(fitted, before, (), (("all", rest),), (fold,))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("law", "table", "kept"),
    [
        (0.99, 0.997, True),  # Eight sliders fitted by a loop of another form.
        (0.99, 0.9995, False),  # By far: two effects, of which a law tells one.
        (0.90, 0.97, False),
        (0.90, 0.93, True),
    ],
)
def test_a_table_is_taken_where_no_law_explains_what_is_missing(law: float, table: float, kept: bool) -> None:
    named = explaining(law, "hysteresis", 4)
    judged = _or_the_table(judge([named], 2), explaining(table, "tabulated", 18))
    assert judged.chosen is not None
    assert (judged.chosen is named) == kept
    assert (judged.verdict is Verdict.PARTIAL) == (not kept or law < 0.95)
