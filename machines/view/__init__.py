"""A machine in three dimensions: what is drawn of it, and how that moves."""

from .scene import Scene, scene

__all__ = ["Scene", "scene"]
