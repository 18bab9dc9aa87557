"""Make sibling test modules importable and keep plots off the screen."""

from __future__ import annotations

import os
import sys
from pathlib import Path

os.environ.setdefault("MPLBACKEND", "Agg")
for folder in ("", "jointlib", "machines", "fmu"):
    sys.path.insert(0, str(Path(__file__).parent / folder))
