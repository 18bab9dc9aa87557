"""The residual of a periodic record: equations of motion of the rig, spectra, noise floor.

Imports the answer.
"""
