"""Effects and faults as rivals for a residual: trials, fits, rounds.

Imports the balance and the answer.
"""
