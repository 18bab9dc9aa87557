"""Coefficients of cutting forces from what a dynamometer recorded at several feeds."""
