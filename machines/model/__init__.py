"""A machine: its components, connections, bundles and axes, and what of them belongs together.

Imports components and bundles.
"""
