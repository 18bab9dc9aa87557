"""The test rigs a record can come from, simulated."""
