"""Documentation build: Markdown through MyST, no network, warnings are errors (``sphinx-build -W``)."""

from __future__ import annotations

import tomllib
from pathlib import Path

_PROJECT = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text("utf-8"))["project"]

project = _PROJECT["name"]
author = copyright = _PROJECT["authors"][0]["name"]
version = release = _PROJECT["version"]
extensions = ["myst_parser"]
root_doc = "index"
exclude_patterns = ["_build"]
myst_enable_extensions = ["deflist"]
myst_heading_anchors = 3
html_theme = "alabaster"
html_theme_options = {"page_width": "1080px", "sidebar_width": "230px", "description": _PROJECT["description"]}
html_show_sourcelink = False
# Formulas are written in Unicode: no page loads a script or a font from elsewhere.
html_math_renderer = None
nitpicky = True
