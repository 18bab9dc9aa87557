"""The cut: forces, teeth, chips, and the chart that every method fills.

Imports the tool.
"""
