"""Design studies: many configurations of a machine, computed in blocks and resumed wherever they were stopped."""
