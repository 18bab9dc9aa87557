"""Measured over predicted, and one machine beside another.

Imports files, the loop and below.
"""

from ..verb_room import called_as_verb

called_as_verb(__name__)
