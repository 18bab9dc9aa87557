"""What a native FMU costs and where it is integrated rightly, as rows for the page inside; counted, so bytes repeat."""

from __future__ import annotations

from ..system.system import System
from .closed_source import closed_tables
from .native import exchangeable, native_parts


def native_figures(system: System) -> list[tuple[str, str]]:
    """Work of a step, and what to expect of model exchange."""
    rows = []
    tables = closed_tables(system) if system.states else None
    if tables is not None:
        poles, of = len(tables.modes.W), tables.of
        products = poles * (8 + len(tables.reads) + len(of.basis) + len(system.inputs))
        asked = f" and the laws of {len(of.bent)} joint{'s' * (len(of.bent) > 1)}" if of.bent else ""
        told = "" if of.stiff else ", where the importer tells a tolerance of 1e-7 or more"
        rows.append(("a step takes at least", f"{products} multiplications{asked}{told}"))
    if not exchangeable(system):
        return rows
    kinked = dict.fromkeys(p.kernel.word.replace("_", "-") for p in native_parts(system) if p.modes[0] < p.modes[1])
    if kinked or system.states:
        what = "machines" if system.states else f"laws with kinks ({', '.join(kinked)})"
        rows.append(
            (
                "model exchange",
                "right where one solver knows input and state at every stage, as in a diagram of equations. FMPy's "
                f"simulate_fmu and fmusim hold a given signal while their solver goes past an output point: {what} "
                "come out wrong there by up to some per cent; take co-simulation",
            )
        )
    return rows
