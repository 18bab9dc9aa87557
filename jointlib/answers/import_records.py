"""Write the measurement file of records that a laboratory has, and read it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jointlib.answers.given import File, files_of
from jointlib.io.atomic import to_write
from jointlib.io.measurement_file import read_measurement
from jointlib.lab.importing.bring import Brought
from jointlib.lab.importing.write import import_records
from jointlib.measurement import Measurement
from jointlib.shown.result import Columns, Shown


@dataclass(frozen=True, eq=False, repr=False)
class Imported(Shown):
    """A measurement whose file an import has written."""

    file: Path
    measurement: Measurement
    """As it is read back."""
    guesses: tuple[str, ...]
    """What the records do not say, a sentence each."""

    def finding(self) -> str:
        """What was read, and how much of it is a guess."""
        count = len(self.guesses)
        return f"{self.measurement.finding()}; {count or 'no'} guess{'' if count == 1 else 'es'}"

    def columns(self) -> Columns:
        """A row per channel; of frequency responses a row per record."""
        channels = self.measurement.channels
        if not channels:
            return self.measurement.columns()
        return {
            "channel": ([c.name for c in channels], ""),
            "column": ([c.column or c.name for c in channels], ""),
            "quantity": ([c.quantity for c in channels], ""),
            "unit": ([c.unit for c in channels], ""),
        }

    def plot(self, ax: Any = None) -> Any:
        """One record that is not sealed."""
        return self.measurement.plot(ax)


def import_(
    files: File | Iterable[File],
    output: File,
    *,
    kind: str | None = None,
    set: Sequence[str] | Mapping[str, Any] = (),
) -> Imported:
    """Write the measurement file of records as a laboratory has them, and read it: ``jointlib import``.

    Parameters
    ----------
    files
        Text of any dialect, universal, TDMS, MATLAB, HDF5, WAV, LabVIEW, npz; or a folder with a record in each file.
    output
        The measurement file to write.
    kind
        Kind of the measurement: rig, path, static, frf …; default: as the signals tell.
    set
        What is known better than the files say it, as ``{"channel.acc_x.unit": "g"}`` or ``["channel.acc_x.unit=g"]``.

    Raises
    ------
    InputError
        Where the files can be read in two ways; the sentence has both.
    """
    brought = brought_to(files, to_write(output, "output", ".toml"), kind, set)
    return Imported(Path(output), read_measurement(Path(output)), tuple(brought.draft.guesses))


def brought_to(
    files: File | Iterable[File], output: Path, kind: str | None, settings: Sequence[str] | Mapping[str, Any]
) -> Brought:
    """The same as the import made it, nothing read back."""
    pairs = [f"{key}={value}" for key, value in settings.items()] if isinstance(settings, Mapping) else settings
    return import_records(files_of(files), output, kind, [pairs] if isinstance(pairs, str) else pairs)
