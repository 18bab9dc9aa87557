"""Nonlinear machine joints: laws, identification, describing functions, closing the loop."""
