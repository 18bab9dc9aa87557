"""Modes of measured frequency responses, as a component for machines."""
