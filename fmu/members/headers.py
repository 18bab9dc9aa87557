"""The FMI headers, taken from the installed FMPy, and the licence under which they travel inside an FMU."""

from __future__ import annotations

import re
from pathlib import Path

from jointlib.errors import InputError

NAMES = (
    "fmi2FunctionTypes.h",
    "fmi2Functions.h",
    "fmi2TypesPlatform.h",
    "fmi3FunctionTypes.h",
    "fmi3Functions.h",
    "fmi3PlatformTypes.h",
)


def headers() -> dict[str, str]:
    """The six headers by name, with their notices."""
    import fmpy

    folder = Path(fmpy.__file__).with_name("c-code")
    missing = [name for name in NAMES if not (folder / name).is_file()]
    if missing:
        raise InputError(f"{folder}: no {', '.join(missing)}, expected the FMI headers that come with FMPy")
    return {name: (folder / name).read_text(encoding="utf-8") for name in NAMES}


def licence() -> str:
    """Copyright and 2-clause BSD licence as the headers state them."""
    text = headers()["fmi3Functions.h"]
    notice = re.search(r"Copyright \(C\).*?DAMAGE\.", text, flags=re.DOTALL)
    if notice is None:
        raise InputError("fmi3Functions.h of FMPy: no copyright notice in it, expected the 2-clause BSD licence")
    return f"The files {', '.join(NAMES)}:\n\n{notice[0]}\n"
