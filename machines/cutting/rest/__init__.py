"""Stability lobes for small vibrations, by every method.

Imports the loops.
"""
