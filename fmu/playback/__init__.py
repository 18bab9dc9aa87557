"""FMUs run again: the reference in Python, and the scripts that play an FMU back.

Imports the members.
"""
