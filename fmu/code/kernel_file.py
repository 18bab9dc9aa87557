"""Where the kernels of a law lie: ours in a folder of their own, a third party's beside the module of its law."""

from __future__ import annotations

import sys
from pathlib import Path

from jointlib.law import JointLaw


def word_of(law: JointLaw) -> str:
    """The kind of a law as kernels write it: ``hertz_guide``."""
    return law.kind.replace("-", "_")


def kernel_file(law: JointLaw, ours: Path, name: str) -> Path | None:
    """The file ``ours``, or the file ``name`` beside the module of the law; None where neither is."""
    module = getattr(sys.modules.get(type(law).__module__), "__file__", None)
    places = [ours, Path(module).with_name(name)] if module else [ours]
    return next((place for place in places if place.is_file()), None)
