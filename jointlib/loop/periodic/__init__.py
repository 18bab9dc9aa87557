"""The trace of periodic records, from readings to a verdict.

Imports the contest and below.
"""
