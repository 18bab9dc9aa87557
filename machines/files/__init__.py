"""Machine files, read and written, with changes.

Imports what they describe; studies and pages import this.
"""
