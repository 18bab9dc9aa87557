"""What machine tools do, in SI: a bare ``5`` is 5 m, which no tool moves."""

LARGEST_AMPLITUDE = 0.01
"""Peak vibration of the tool, m."""
DEEPEST = 0.5
"""Depth of cut, m."""
