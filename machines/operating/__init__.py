"""Solutions at given frequencies and amplitudes or forces, by one harmonic; branches, folds and peaks among them.

Imports the harmonic balance and below.
"""
