"""Formats of loggers and programs beside text, one to a file: each to columns with what they say of themselves."""
