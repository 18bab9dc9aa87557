"""Free decays: frequency and damping over amplitude, and the joint that makes them."""
