"""Natural modes of the coupled machine: shapes, energies, what stiffness would give.

Imports cutting and below.
"""
