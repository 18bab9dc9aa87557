"""What a trace says, and the catalogue of effects and faults that it may name."""
