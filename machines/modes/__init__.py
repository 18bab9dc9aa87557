"""Natural modes of the coupled machine: shapes, energies, what stiffness would give.

Imports cutting and below.
"""

from ..verb_room import called_as_verb

called_as_verb(__name__)
