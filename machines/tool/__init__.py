"""The tool point: its receptance, its modes, and the band in which it chatters.

Imports the harmonic balance and below.
"""
