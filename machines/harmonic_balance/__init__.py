"""Joints as describing functions in the coupled machine: equations of one and of many harmonics, Newton on them.

Imports statics and below.
"""
