"""What to measure: which test of a joint tells the effects in question apart, tried on simulated records."""
