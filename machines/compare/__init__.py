"""Measured over predicted, and one machine beside another.

Imports files, the loop and below.
"""
