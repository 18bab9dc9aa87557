"""Receptance coupling and the equations of motion of a whole machine, of first and of second order.

Imports the model.
"""
