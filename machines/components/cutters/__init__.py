"""Rotating tools by the sizes that catalogues give, as beams."""
