"""The report of a run: one self-contained HTML file of sentences, pictures and tables."""

from .page import Figure, Page, Section, Table

__all__ = ["Figure", "Page", "Section", "Table"]
