"""Verbs of the command line about FMUs, and about what this computer can do."""
