"""Exported FMUs as a program without Python sees them: the library on the disk, its token and its reference run."""

from __future__ import annotations

import functools
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from fmpy import platform, platform_tuple, read_model_description
from host import GUIDE
from samples import KAPPA
from tools import require

from fmu.export import export_fmu
from fmu.members.archive import read_archive, unpack
from fmu.playback.reference import CSV, FOLDER, ReferenceRun, read_csv
from jointlib.joint import Joint
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.laws.lugre import LuGre

__all__ = ["GUIDE", "RUBBING", "Exported", "exported", "unpacked"]

RUBBING = Joint((HertzGuide(630.0, KAPPA), LuGre(4e7, 300.0, 36.0, 50.0, 0.02)), "rubbing guide")
"""A preloaded guide with friction that remembers."""
_FOLDER = tempfile.TemporaryDirectory(prefix="jointlib-test-")


@dataclass(frozen=True)
class Exported:
    """An FMU in a folder."""

    file: Path
    folder: Path
    fmi: int
    identifier: str
    token: str
    references: dict[str, int]

    @property
    def library(self) -> Path:
        """The library for this computer."""
        return next((self.folder / "binaries" / (platform if self.fmi == 2 else platform_tuple)).iterdir())

    @property
    def run(self) -> ReferenceRun:
        """The reference run inside."""
        return read_csv((self.folder / FOLDER / CSV).read_text(encoding="utf-8"), CSV)

    def table(self) -> str:
        """The reference run as a C host reads it."""
        rows = np.column_stack([self.run.rows[:, self.run.names.index(name)] for name in _COLUMNS])
        return "\n".join([str(len(rows)), *(" ".join(repr(float(x)) for x in row) for row in rows)]) + "\n"


_COLUMNS = ("time", "displacement", "velocity", "force")


def unpacked(file: Path, folder: Path, fmi: int) -> Exported:
    """An FMU that exists, in a folder of its own."""
    unpack(file, read_archive(file), folder)
    read = read_model_description(str(folder))
    references = {str(v.name): int(v.valueReference) for v in read.modelVariables}
    return Exported(file, folder, fmi, str(read.coSimulation.modelIdentifier), str(read.guid), references)


@functools.cache
def _exported(name: str, fmi: int) -> Exported:
    joint = {joint.name: joint for joint in (GUIDE, RUBBING)}[name]
    stem = Path(_FOLDER.name) / f"{name.split()[0]}{fmi}"
    return unpacked(export_fmu(joint, stem.with_suffix(".fmu"), fmi=fmi, runtime="c").file, stem, fmi)


def exported(joint: Joint, fmi: int) -> Exported:
    """The native FMU of the guide or of the rubbing guide, made once for all tests."""
    require("cc")
    return _exported(joint.name, fmi)
