"""Prints what became of damaged inputs, by kind: ``python tests/fuzz/table.py --count 1000 --seed 7 [KIND…]``."""

from __future__ import annotations

import argparse
import collections
import re
import sys
import time

from runs import GOOD, OUTCOMES, ended
from seeds import KINDS


def main() -> int:
    """Run them and print the table; the exit status is 1 where something is not as it should be."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kinds", nargs="*")
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, action="append")
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--shown", type=int, default=12)
    asked = parser.parse_args()
    total: collections.Counter[str] = collections.Counter()
    columns = [word for word in OUTCOMES if word not in ("check failed", "computing")]
    print(" | ".join(["kind", "inputs", *columns, "longest [s]", "all [s]"]), flush=True)
    for kind in asked.kinds or KINDS:
        count, longest, begun = collections.Counter[str](), 0.0, time.perf_counter()
        found = collections.Counter[str]()
        example: dict[str, str] = {}
        for seed in asked.seed or [1]:
            for one in ended(kind, seed, asked.count, asked.first):
                outcome = "done" if one.outcome in ("check failed", "computing") else one.outcome
                count[outcome] += 1
                longest = max(longest, one.seconds)
                if one.outcome not in GOOD:
                    alike = re.sub(r".* at ", "", one.said) if one.outcome == "traceback" else one.said[:60]
                    said = f"{one.outcome}: {re.sub(r'[0-9.]+(?=[^0-9.:])', '#', alike)}"
                    found[said] += 1
                    example.setdefault(said, f"{seed}/{one.number} {one.said}")
        total += count
        cells = [kind, str(sum(count.values())), *(str(count[word]) for word in columns)]
        print(" | ".join([*cells, f"{longest:.1f}", f"{time.perf_counter() - begun:.0f}"]), flush=True)
        for said, times in found.most_common(asked.shown):
            print(f"    {times} x {said[:20]} {example[said]}", file=sys.stderr, flush=True)
    print(" | ".join(["all", str(total.total()), *(str(total[word]) for word in columns), "", ""]))
    return int(any(total[word] for word in columns if word not in GOOD))


if __name__ == "__main__":
    sys.exit(main())
