"""Tables of a measurement file that are more than a few keys."""
