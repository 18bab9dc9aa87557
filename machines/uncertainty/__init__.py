"""Bands of lobes and responses over samples of what was identified.

Imports cutting and below.
"""
