"""How a result shows itself: its finding in a sentence, a table with units, a picture."""
