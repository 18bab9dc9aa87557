"""What may be wrong at one place of a machine, as numbers to fit."""
