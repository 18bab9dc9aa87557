"""The steps of a run, one file per stretch of the road."""
