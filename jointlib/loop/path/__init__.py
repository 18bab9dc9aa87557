"""The path route: a force along a measured displacement, judged in the time domain."""

from jointlib.loop.path.route import trace_path

__all__ = ["trace_path"]
