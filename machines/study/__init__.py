"""Design studies: many configurations of a machine, computed in blocks and resumed wherever they were stopped."""

from ..verb_room import called_as_verb

called_as_verb(__name__)
