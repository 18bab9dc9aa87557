"""Compare what the README says a run prints with what it printed: ``python docs/printed.py README.md printed.txt``."""

from __future__ import annotations

import sys
from pathlib import Path


def promised(readme: str) -> list[str]:
    """Lines of the first block that shows output."""
    block = readme.split("```text\n", 1)[1].split("```", 1)[0]
    return block.splitlines()


def main(readme: Path, printed: Path) -> int:
    """0 if every promised line was printed, in order; a line that ends in … promises its beginning only."""
    lines = iter(printed.read_text().splitlines())
    for wanted in promised(readme.read_text()):
        start, cut, _ = wanted.partition("…")
        if not any(line.startswith(start) if cut else line == wanted for line in lines):
            print(f"{readme}: promises {wanted!r}, which was not printed", file=sys.stderr)
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), Path(sys.argv[2])))
