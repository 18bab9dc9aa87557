"""Forces of laws along a path, each evaluated no more often than it has to be."""
