"""A machine to play with: what can be changed, what follows at once, and what of it is kept."""

from ..verb_room import called_as_verb
from .controls import AMPLITUDE, Control
from .scene import Curves, Explorer, Reading, Scatter, Summary

__all__ = ["AMPLITUDE", "Control", "Curves", "Explorer", "Reading", "Scatter", "Summary"]

called_as_verb(__name__)
