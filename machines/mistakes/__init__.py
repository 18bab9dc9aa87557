"""Mistakes of a machine file although all of it can be computed: units, signs, places, loose parts."""

from .found import in_file, may_be_solved, mistakes

__all__ = ["in_file", "may_be_solved", "mistakes"]
