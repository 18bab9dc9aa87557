"""What an FMU computes: variables, units, equations, the largest step.

Imports the code of kernels.
"""
