"""Kernels of laws in C and in Python, as text."""
