"""The cut in time: the delay equation, stepped, and what is told held against it.

Imports amplitude and below.
"""
