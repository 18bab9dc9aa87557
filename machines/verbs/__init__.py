"""Verbs of the command line about machines.

They import every room; numerics are imported when a verb is called.
"""
