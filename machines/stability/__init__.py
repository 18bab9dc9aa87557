"""Whether a periodic motion lasts: Hill, Floquet, disturbances, and what is known of every point of a branch.

Imports operating and below.
"""
