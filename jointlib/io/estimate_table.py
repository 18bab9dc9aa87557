"""The ``[estimate]`` table of hammer and shaker measurements."""

from __future__ import annotations

from jointlib.estimation.settings import ESTIMATORS, SIGNALS, Settings
from jointlib.io.toml import Section


def settings_of(section: Section, kind: str) -> Settings:
    """What the table says; without it the defaults."""
    hit = kind == "impact"
    found = Settings(
        estimator=section.text("estimator", "H1", choices=ESTIMATORS),
        signal="impact" if hit else section.text("signal", "random", choices=SIGNALS),
        length=section.number("length", "s", None),
        before=section.number("before", "s", None) if hit else None,
        force_window=section.flag("force_window", True) if hit else False,
        exponential=section.number("exponential", "s", None) if hit else None,
    )
    for key in ("length", "before", "exponential"):
        value = getattr(found, key)
        if value is not None and not value > 0:
            section.fault(f"{key} is {value:g} s, expected more than 0")
    if found.length is not None and found.before is not None and not found.before < found.length:
        section.fault(f"before is {found.before:g} s, expected less than the length of {found.length:g} s")
    section.done()
    return found
