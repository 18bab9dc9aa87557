"""Make sibling test modules importable, keep plots off the screen and linear algebra to one thread."""

from __future__ import annotations

import os
import sys
from pathlib import Path

os.environ.setdefault("MPLBACKEND", "Agg")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
for folder in ("", "jointlib", "machines", "fmu"):
    sys.path.insert(0, str(Path(__file__).parent / folder))
