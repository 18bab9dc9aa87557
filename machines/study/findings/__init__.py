"""What a finished study says: its best designs, what separates them, what the answer depends on."""
