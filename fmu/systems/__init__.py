"""Systems of FMUs: their description, notes, check.

Imports the playback and below.
"""
