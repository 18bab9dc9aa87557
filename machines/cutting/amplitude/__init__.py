"""Depth and amplitude together: joints held as a vibration has them, limits, lenses, pockets and what is said of them.

Imports lobes at rest and below.
"""
