"""Where a machine stands under its static load, and what vibration does to that.

Imports the coupling.
"""
