"""A machine to play with: what can be changed, what follows at once, and what of it is kept."""

from .controls import AMPLITUDE, Control
from .scene import Curves, Explorer, Reading, Scatter, Summary

__all__ = ["AMPLITUDE", "Control", "Curves", "Explorer", "Reading", "Scatter", "Summary"]
