"""Eigenvalue loops of the cut: harmonics, collocation, and the crossings at which they chatter.

Imports the process.
"""
