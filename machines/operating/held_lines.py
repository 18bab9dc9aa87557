"""What is told of a machine held at an amplitude line by line: its table, and how the lines ended."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import Outcome
from jointlib.frf import FRF
from jointlib.shown.result import Columns


def columns_of(
    frf: FRF,
    force: Array,
    amplitude: Array,
    outcomes: Sequence[Outcome],
    connections: Sequence[str],
    gain: ComplexArray | None = None,
) -> Columns:
    """A row per line: force, amplitude and gain of every joint, (lines, joints), and how it ended."""
    names = connections or [f"joint {j}" for j in range(1, amplitude.shape[1] + 1)]
    table: dict[str, tuple[Array | ComplexArray | list[str], str]] = {
        "frequency": (frf.frequency, "Hz"),
        "force": (force, "N"),
        "outcome": ([outcome.name.lower() for outcome in outcomes], ""),
    }
    for j, name in enumerate(names):
        table[f"{name} amplitude"] = amplitude[:, j], "m"
        if gain is not None:
            table[f"{name} gain"] = gain[:, j], "N/m"
    return table


def said_of(outcomes: Sequence[Outcome]) -> str:
    """``all 40 lines converged``, or on how many what ended them."""
    counts = Counter(outcomes)
    lost = [f"{count} {outcome.name.lower()}" for outcome, count in counts.items() if outcome is not Outcome.CONVERGED]
    lines = f"{len(outcomes)} line{'s' * (len(outcomes) > 1)}"
    return f"of {lines} {', '.join(lost)}" if lost else f"all of {lines} converged"
