"""What several verbs take with a unit, within what machine tools do: a bare ``5`` is 5 m, which no tool moves."""

from __future__ import annotations

from jointlib.cli.arguments import Quantity

AMPLITUDE = Quantity("m", lower=0, upper=0.01)
"""Peak vibration of the tool."""
DEPTH = Quantity("m", lower=0, upper=0.5)
"""Depth of cut."""
