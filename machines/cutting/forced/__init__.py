"""The vibration that the teeth force, joints that it shakes, and advice on where to cut.

Imports the cut in time and below.
"""
