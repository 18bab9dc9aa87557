"""Cutters with unequal pitches, helix and rubbing flanks: several delays, and the depth inside the coefficients.

Imports the loops.
"""
