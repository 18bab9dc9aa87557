"""Closing the loop on test cuts: what the chart cannot explain, which effect would, and what to cut next.

Imports the files and below.
"""
