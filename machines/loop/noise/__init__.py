"""How far measured frequency responses are off: line by line, and from record to record."""
