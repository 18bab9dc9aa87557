"""Carriages, screws, bearings, bolted faces and tapers as bundles of scalar connections, made from their geometry."""

from .bundle import Bundle, Row, expand

__all__ = ["Bundle", "Row", "expand"]
