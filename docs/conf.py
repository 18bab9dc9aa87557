"""Documentation build: Markdown through MyST, no network, warnings are errors (``sphinx-build -W``)."""

from __future__ import annotations

import tomllib
from pathlib import Path

_PROJECT = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text("utf-8"))["project"]

project = _PROJECT["name"]
author = copyright = _PROJECT["authors"][0]["name"]
version = release = _PROJECT["version"]
extensions = ["myst_parser", "sphinx_gallery.gen_gallery"]
root_doc = "index"
exclude_patterns = ["_build", "examples"]
myst_enable_extensions = ["deflist"]
myst_heading_anchors = 3
html_theme = "alabaster"
html_theme_options = {"page_width": "1080px", "sidebar_width": "230px", "description": _PROJECT["description"]}
html_show_sourcelink = False
# Formulas are written in Unicode: no page loads a script or a font from elsewhere.
html_math_renderer = None
nitpicky = True
# Examples are run while the pages are built; the pages that this makes are not kept.
sphinx_gallery_conf = {
    "examples_dirs": "examples",
    "gallery_dirs": "gallery",
    "download_all_examples": False,
    "show_signature": False,
    "within_subsection_order": "FileNameSortKey",
    "abort_on_example_error": True,
}
