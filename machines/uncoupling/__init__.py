"""Coupling turned round: a known blank taken off a measured assembly leaves the end of the spindle."""
