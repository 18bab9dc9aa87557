"""The section that lays measured frequency responses over the prediction."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..compare.comparison import Comparison, Pair, share
from .drawing import AFTER, MEASURED
from .figures.receptance_figure import Curve, receptance_figure
from .page import Figure, Section, Table

HEADER = ("record", "measured [Hz]", "predicted [Hz]", "damping measured [%]", "frequency off", "damping off",
          "compliance off")  # fmt: skip
_SHOWN = 2


def comparison_rows(comparisons: Sequence[Comparison]) -> list[tuple[str, ...]]:
    """A row for each resonance of each record; "none" where a difference is below the uncertainty."""
    return [_row(c, pair) for c in comparisons for pair in c.pairs]


def _row(comparison: Comparison, pair: Pair) -> tuple[str, ...]:
    a, b, name = pair.measured, pair.predicted, comparison.record.name
    damping = f"{100 * a.damping_ratio:.3g}" if a is not None and np.isfinite(a.damping_ratio) else "–"
    at = [f"{r.frequency:.5g}" if r is not None else "not there" for r in (a, b)]
    if a is None or b is None:
        return (name, *at, damping, "–", "–", "–")
    off = pair.differences()
    told = [
        share(off[key]) if key in off else "–" if not np.isfinite(getattr(a, key)) else "none"
        for key in ("frequency", "damping_ratio", "compliance")
    ]
    return (name, *at, damping, *told)


def comparison_figure(comparisons: Sequence[Comparison], plot: str = "mag-phase", *, png: bool = False) -> Figure:
    """Measured over predicted, a panel a record, those of the smallest and the largest forces where there are many."""
    ordered = sorted(comparisons, key=lambda c: c.record.force)
    shown = ordered if len(ordered) <= _SHOWN else [*ordered[: _SHOWN // 2], *ordered[-(_SHOWN // 2) :]]
    panels = [
        (
            f"{c.record.response} for {c.record.force:g} N on {c.record.drive}",
            [
                Curve(c.record.frequency, c.record.receptance, "measured", MEASURED),
                Curve(c.frequency, c.predicted, "predicted", AFTER, "--"),
            ],
        )
        for c in shown
    ]
    rest = f" {len(ordered) - len(shown)} more records are in the table." if len(shown) < len(ordered) else ""
    return receptance_figure(panels, plot, f"Measured frequency responses over the prediction.{rest}", png=png)


def comparison_section(comparisons: Sequence[Comparison], depth: str | None) -> Section:
    """What differs in words, over each other, and resonance by resonance."""
    said = [c.sentence() for c in comparisons]
    said = [depth, *said] if depth else said
    said += dict.fromkeys(warning for c in comparisons for warning in c.warnings)
    caption = (
        "How far the prediction is off, as a share of what was measured; none: less than two standard errors. Damping "
        "is that of the half-power width; FRAC is 1 where two curves are alike but for a factor, 0 where they have "
        "nothing in common."
    )
    table = Table(HEADER, comparison_rows(comparisons), caption)
    return Section("Measured over predicted", said, [comparison_figure(comparisons)], [table])
