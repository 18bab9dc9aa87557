"""Solutions followed along curves by arc length, and lines of Newton checked against them.

Imports stability and below.
"""
