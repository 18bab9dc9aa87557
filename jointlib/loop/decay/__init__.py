"""The trace of free decays: effects compete for what a joint leaves of frequency and damping over amplitude."""
