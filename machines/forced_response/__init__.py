"""The forced response of a machine, with the peaks of its tool.

Imports continuation, tool and below.
"""
