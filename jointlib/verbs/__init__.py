"""Verbs of the command line about joints and laws."""
