"""Matrices of finite-element programs: punch, OUTPUT4, Harwell-Boeing and CalculiX files."""
