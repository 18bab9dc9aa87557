"""The only doors for data: files in, files out; units are converted here."""
