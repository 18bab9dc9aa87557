"""What several verbs take with a unit, within what machine tools do."""

from __future__ import annotations

from jointlib.cli.arguments import Quantity

from ..ranges import DEEPEST, LARGEST_AMPLITUDE

AMPLITUDE = Quantity("m", lower=0, upper=LARGEST_AMPLITUDE)
"""Peak vibration of the tool."""
DEPTH = Quantity("m", lower=0, upper=DEEPEST)
"""Depth of cut."""
