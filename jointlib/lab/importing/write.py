"""The measurement file of an import, read back before it is written."""

from __future__ import annotations

import hashlib
import re
import tempfile
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

from jointlib.errors import InputError
from jointlib.io.atomic import sha256, write_text
from jointlib.io.measurement_file import read_measurement
from jointlib.lab.importing.bring import Brought, bring
from jointlib.lab.importing.page import FIRST, page, toml
from jointlib.lab.importing.settings import settings_of

_SHOWN = 3
_MARK = "\n[provenance]\n"


def import_records(
    paths: Sequence[Path], output: Path, kind: str | None = None, settings: Sequence[str] = ()
) -> Brought:
    """Write the measurement file of records that a laboratory has.

    Parameters
    ----------
    paths
        Files, or folders with a record in each file.
    output
        The file to write; one that exists is replaced if an import wrote it and nobody changed it since.
    kind
        Kind of the measurement; default: as the signals tell.
    settings
        What is known better than the files say it, as ``channel.acc_x.unit=g``.

    Returns
    -------
    Brought
        ``draft.guesses`` are sentences on what the files do not say.
    """
    brought = bring([Path(p) for p in paths], output, kind, settings_of(settings))
    text = _text(brought, output)
    _check(text, output, [said for said in brought.draft.guesses if said.endswith("is left out")])
    _refuse_changed(output)
    write_text(output, text)
    return brought


def _text(brought: Brought, output: Path) -> str:
    paths = dict.fromkeys([*brought.tables, *(file.path for file in brought.files)])
    names = list(dict.fromkeys(path.name for path in paths))
    shown = ", ".join(names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")
    above = page(brought.draft, shown)
    hashes = [{"file": path.name, "sha256": sha256(path)} for path in paths]
    lines = [f"program = {toml('jointlib import ' + version('jointlib'))}", f"above = {toml(_hash(above))}"]
    lines += ["files = [", *(f"    {toml(one)}," for one in hashes), "]"]
    return above + _MARK + "\n".join(lines) + "\n"


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8")).hexdigest()


def _check(text: str, output: Path, left_out: Sequence[str]) -> None:
    """Read the declaration as a user's; faults are those of what was set on the command line, or of columns that could
    not be used."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / output.name
        path.write_text(text, encoding="utf-8")
        try:
            read_measurement(path)
        except InputError as error:
            said = [sentence.replace(str(path), str(output)) for sentence in error.sentences]
            raise InputError(*(_with_cause(sentence, left_out) for sentence in said)) from None


def _with_cause(sentence: str, left_out: Sequence[str]) -> str:
    """A channel that is missing with the columns that were left out; the line is one of a file that is not written."""
    missing = re.fullmatch(r"(.*: no \w+ channel, .*?)( \(line .*\))?", sentence)
    if missing is None or not left_out:
        return sentence
    return f"{missing[1]}: {'; '.join(left_out[:_SHOWN])}"


def _refuse_changed(output: Path) -> None:
    """Refuse to replace a file that somebody wrote or changed."""
    if not output.exists():
        return
    text = output.read_text("utf-8", errors="replace")
    above, mark, noted = text.partition(_MARK)
    if not text.startswith(FIRST) or not mark or _hash(above) not in noted:
        what = "was changed since it was imported" if text.startswith(FIRST) else "exists already"
        raise InputError(f"{output}: {what}, expected the name of a new file")
