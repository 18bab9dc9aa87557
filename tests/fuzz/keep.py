"""Keeps an input that was found in the corpus: ``python tests/fuzz/keep.py KIND SEED NUMBER NAME``."""

from __future__ import annotations

import json
import sys
from pathlib import Path

from runs import lay
from seeds import KINDS, Input, damaged

CORPUS = Path(__file__).parent / "corpus"


def keep(given: Input, folder: Path) -> Path:
    """Write the files of an input and its command line into a folder, as the corpus has them."""
    lay(given.files, folder)
    (folder / "line.json").write_text(json.dumps(list(given.line), indent=1) + "\n", encoding="utf-8")
    return folder


if __name__ == "__main__":
    kind, seed, number, name = sys.argv[1:5]
    print(keep(damaged(KINDS[kind], int(seed), int(number)), CORPUS / name))
