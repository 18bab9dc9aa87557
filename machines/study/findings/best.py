"""The best design of a study as a machine file, and what that file is worth."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from jointlib.joint import Joint

from ...cutting.rest.together import preview
from ...files.machine_file import read_machine
from ...files.machine_writer import write_machine
from ..conditions import Case
from ..evaluation import Evaluation
from ..factors import IDENTIFICATION
from ..settings import Setting
from ..study import Study
from .verdict import Design, Ranking, worst_of


@dataclass(frozen=True, eq=False)
class BestMachine:
    """A design as a machine file in its worst case: joints as identified, what else is uncertain at its median."""

    files: tuple[Path, ...]
    """Every file written, the machine file first."""
    case: Case
    results: Mapping[str, float]
    """Of this very machine, in SI (rpm for speeds)."""
    method: str
    """Of the stability lobes."""
    amplitudes: tuple[float, ...]
    speed_count: int
    """Speeds of the study, over the range of the file."""

    @property
    def command(self) -> str:
        """The command line that tells the depth again, from where the study was run."""
        file, here = self.files[0], Path.cwd()
        file = file.relative_to(here) if file.is_relative_to(here) else file
        said = ["--amplitude", *(f"{A:g}" for A in self.amplitudes)] if any(self.amplitudes) else []
        return shlex.join(["jointlib", "lobes", str(file), "--method", self.method, *said])


def write_best(
    study: Study, evaluate: Evaluation, joints: Mapping[str, Joint], ranking: Ranking, design: Design, target: Path
) -> BestMachine:
    """Write a design as a machine file with everything it names; see `write_machine`.

    Speeds are those of the study, and the case is the one in which the first objective is worst.
    """
    setting, case, results = worst_setting(study, evaluate, ranking, design.number)
    changes = setting.changes
    within = dict(setting.joints)
    machine = read_machine(setting.file, {path: value for path, value in changes.items() if path not in within})
    if len(study.speeds) and machine.cutting is not None and "cutting.speed" not in changes:
        changes["cutting.speed"] = [float(study.speeds[0]), float(study.speeds[-1])]
    open_ = {c.name: joints[c.name] for c in machine.connections if c.identify is not None and c.name in joints}
    files = write_machine(setting.file, changes, target, open_)
    process = "" if machine.cutting is None else machine.cutting["process"]
    method = study.lobes or preview(process)
    return BestMachine(files, case, results, method, study.amplitudes, study.speed_count)


def worst_setting(
    study: Study, evaluate: Evaluation, ranking: Ranking, number: int
) -> tuple[Setting, Case, dict[str, float]]:
    """A design in the case in which the first objective is worst, what is uncertain at its median; its results."""
    numbers = ranking.numbers[number].copy()
    for i, f in enumerate(study.factors):
        if f.uncertain:
            numbers[i] = np.nan if f.path == IDENTIFICATION else float(f.numbers(np.array(0.5)))
    found = evaluate.each([(numbers, case) for case in study.cases])
    at = worst_of(study, {name: values[None, :, None] for name, values in found.items()})
    worst = int(at[study.objectives[0].quantity][0, 0])
    case = study.cases[worst]
    return evaluate.setting(numbers, case), case, {name: float(values[worst]) for name, values in found.items()}
