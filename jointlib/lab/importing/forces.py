"""Dynamometer records: which channel is which force, and what has to be said of the cut."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from jointlib.errors import InputError
from jointlib.lab.importing.draft import Draft, Noted

_FORCES = {"milling": ("Fx", "Fy", "Fz"), "turning": ("Fc", "Ff", "Fp")}
_SPLIT = "_ -.[("


def force_roles(draft: Draft, process: str) -> None:
    """Give channels the force that their name begins or ends with, whatever its capitals: ``fx``, ``force_Fy``."""
    for table in draft.channels:
        if "role" in table:
            continue
        words = [str(table[key].value).casefold() for key in ("name", "column") if key in table]
        for force in _FORCES.get(process, ()):
            word = force.casefold()
            if any(w == word or w.startswith(tuple(word + c for c in _SPLIT)) or w.endswith("_" + word) for w in words):
                table["role"] = Noted(force)


def refuse_unsaid_cut(output: Path, cutting: Mapping[str, Any], records: Collection[Mapping[str, Noted]]) -> None:
    """Refuse dynamometer records of a cut of which something is not said, with what says it."""
    milling = cutting.get("process", "milling") == "milling"
    needed = ("speed", "depth", "feed", *(("teeth", "mode") if milling else ()))
    cuts = [record for record in records if "role" not in record or record["role"].value != "quiet"]
    missing = [key for key in needed if key not in cutting and not all(key in record for record in cuts)]
    if missing:
        name = Path(str(next(iter(cuts or records))["file"].value)).stem
        one = f"--set cutting.{missing[0]}=VALUE for all records or --set record.{name}.{missing[0]}=VALUE for one"
        raise InputError(f"{output}: the records do not say {', '.join(missing)} of the cut, expected {one}")
