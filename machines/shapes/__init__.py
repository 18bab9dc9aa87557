"""Geometry without a machine: solids, sections and beams as meshes, what is drawn of them.

Imports `machines.indices` alone.
"""
