"""The whole road for a machine: steps from identification to export, and the report.

Imports every other room; its steps are found by entry point.
"""
