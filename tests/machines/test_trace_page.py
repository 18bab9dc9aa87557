"""What the page of a trace says of several effects that explain together what none does alone."""

from __future__ import annotations

from pathlib import Path

import pytest
from late_damper import LATE, SPRUNG, damper

from jointlib.loop.trace import trace
from machines.report.effect_tables import percent
from machines.report.trace_section import trace_section


@pytest.mark.slow
def test_a_page_tells_every_effect_of_a_composition_with_its_sizes_and_its_sentence_once(tmp_path: Path) -> None:
    report = trace(damper(tmp_path, LATE, 0.0), SPRUNG)
    section = trace_section(report)
    assert len(report.composition) == 3
    (text,) = section.text
    assert "several effects explain the excess together" in text
    assert report.sentence not in text
    together = next(t for part in section.parts for t in part.tables if "Together" in t.caption)
    assert [row[0].split(" ")[0] for row in together.rows] == ["dry", "the", "what"]
    assert "lag behind voltage 9." in together.rows[2][0] or "lag behind voltage 10." in together.rows[2][0]


@pytest.mark.parametrize(("share", "said"), [(0.99984, "100"), (0.5664, "57"), (0.0317, "3.2"), (-0.098, "-9.8")])
def test_a_share_is_told_without_an_exponent(share: float, said: str) -> None:
    assert percent(share, 2) == f"{said}\u00a0%"
