"""The members of an FMU archive: description, structure, sources, binaries, documentation.

Imports the system.
"""
