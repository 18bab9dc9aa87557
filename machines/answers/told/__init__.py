"""What the verbs print, in sentences and tables."""
