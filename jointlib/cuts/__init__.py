"""Test cuts: at this speed and depth it sang, or did not."""
