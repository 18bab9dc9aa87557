"""Closing the loop on a whole machine: measured frequency responses against what its model predicts."""
