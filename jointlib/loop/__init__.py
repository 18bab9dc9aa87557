"""Closing the loop: find what a joint model leaves unexplained, name it, add it, report before and after."""
