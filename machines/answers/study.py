"""Compare many configurations of a machine: compute them, go on after a stop, say which is best."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from jointlib.answers.given import File
from jointlib.errors import InputError
from jointlib.io.atomic import given_target, to_write, write_npz
from jointlib.joint import Joint
from jointlib.shown.progress import Progress, Silent
from jointlib.shown.result import Columns, Shown

from ..files.machine_file import read_machine
from ..mistakes import mistakes
from ..road.open_joints import with_joints
from ..study.evaluation import Evaluation
from ..study.findings.answer import answer
from ..study.findings.verdict import Verdict, judge
from ..study.run import begin, evaluate_all, planned
from ..study.store import Store
from ..study.study import Study
from ..study.study_file import read_study
from ..study.tables import write_table
from ..study.values import check_values
from ..study.variants import Machines
from .told.study_told import BEST, REPORT, as_json, words_of, write_findings

_PER_PROCESSOR = 4
_SHARD = re.compile(r"([0-9]{1,6})/([0-9]{1,6})")
_ADDRESS = re.compile(r"((tcp|tls|ucx|ws|wss)://)?[^\s/]+:[0-9]{1,5}")


@dataclass(frozen=True, eq=False, repr=False)
class StudyResults(Shown):
    """What a study amounts to, once all of it is computed."""

    study: Study
    folder: Path
    done: int
    total: int
    """Configurations that are computed, and all."""
    verdict: Verdict | None
    """The best design, the others, what matters; None while configurations are still to do."""
    remarks: tuple[str, ...]
    files: tuple[Path, ...]
    exact: str = ""
    """What the exact method says of the best, where the study ranks by zero order."""

    def finding(self) -> str:
        """The best design, or how much is still to do."""
        if self.verdict is None:
            return f"{self.done} of {self.total} configurations are computed"
        return answer(self.study, self.verdict)

    def columns(self) -> Columns:
        """A row per design; how much is computed while some are still to do."""
        if self.verdict is None:
            return {"done": ([self.done], ""), "total": ([self.total], "")}
        return self.verdict.columns()

    def plot(self, ax: Any = None) -> Any:
        """Designs over two objectives, or over their rank."""
        if self.verdict is None:
            raise InputError(f"{self.folder}: {self.finding()}, expected all of them for a picture")
        return self.verdict.plot(ax)

    def as_json(self) -> dict[str, Any]:
        """What ``jointlib study --json`` prints."""
        data: dict[str, Any] = {"done": self.done, "total": self.total, "best": None}
        if self.verdict is None:
            return data
        best = None if self.verdict.best is None else str(self.folder / BEST)
        data |= {"exact": self.exact} if self.exact else {}
        return data | as_json(self.verdict) | {"report": str(self.folder / REPORT), "machine": best}

    def words(self) -> list[str]:
        """What ``jointlib study`` prints."""
        lines = [f"{self.done} of {self.total} configurations are computed"]
        if self.verdict is None:
            return [*lines, "the others are still to do, by the other parts or by 'jointlib study resume'"]
        return [*lines, *self.remarks, *words_of(self.study, self.verdict, self.exact)]


def study(
    study: File,
    output: File,
    *,
    part: Literal["run", "resume", "report"] = "run",
    tool: str | Sequence[str] = (),
    workers: int | None = None,
    shard: str | None = None,
    scheduler: str | None = None,
    table: File | None = None,
    progress: Progress | None = None,
) -> StudyResults:
    """Compute every configuration of a study, with a report and the best machine as a file: ``jointlib study``.

    What is in the folder already is not computed again. In a program of its own this needs
    ``if __name__ == "__main__":``, for the processes that compute import it.

    Parameters
    ----------
    study
        The file of a study.
    output
        Folder of the results.
    part
        ``"run"``; ``"resume"``, which refuses a folder that holds none; ``"report"``, which computes nothing.
    tool
        Named tools of the machine; of several the worst counts. Default: those that the study says.
    workers
        Processes; default: one per processor.
    shard
        ``"k/n"``: only the k-th of n parts, for batch queues that share the folder.
    scheduler
        Address of a Dask scheduler, whose workers compute instead.
    table
        The .parquet or .csv file of every configuration to write.
    progress
        Told of every part that takes long.
    """
    folder, during = to_write(output, "output", folder=True), progress or Silent()
    target = given_target(table, ".parquet", ".csv", where="table")
    which, most = _shard(shard), _PER_PROCESSOR * (os.cpu_count() or 1)
    if workers is not None and workers < 1:
        raise InputError(f"--workers: {workers}, expected at least 1")
    if workers is not None and workers > most:
        raise InputError(f"--workers: {workers}, expected at most {most}, {_PER_PROCESSOR} for each processor")
    if scheduler is not None and not _ADDRESS.fullmatch(scheduler):
        raise InputError(f"--scheduler: {scheduler!r}, expected an address such as tcp://10.0.0.5:8786")
    opened = read_study(Path(study), tuple(dict.fromkeys([tool] if isinstance(tool, str) else tool)))
    if part != "run" and not (folder / "study.json").is_file():
        to_resume = " to resume" if part == "resume" else ""
        raise InputError(f"-o {folder}: holds no study{to_resume}, expected the folder of 'jointlib study run'")
    store = begin(opened, folder)
    if target is not None:
        write_table(planned(opened, folder), store, target)
    joints = identified(opened)
    if part != "report":
        missing = len(store.missing())
        if missing:
            check_values(opened, joints)
        with during.step(f"computing {missing} of {store.blocks} blocks"):
            evaluate_all(opened, store, joints, workers, which, scheduler)
    found = _told(planned(opened, folder), store, joints, folder, during)
    return found if target is None else replace(found, files=(*found.files, target))


def _told(study: Study, store: Store, joints: dict[str, Joint], folder: Path, progress: Progress) -> StudyResults:
    """What is done; once all is, judged, with ``results.npz``, ``report.html`` and ``best.toml``."""
    done = store.total - sum(store.rows(i, i).stop - store.rows(i, i).start for i in store.missing())
    if done < store.total:
        return StudyResults(study, folder, done, store.total, None, (), ())
    results = store.results()
    write_npz(folder / "results.npz", {"factors": study.numbers(), **results})
    verdict = judge(study, results)
    evaluate = Evaluation(study.source.resolve(), tuple(sorted(joints.items())), tools=study.asked_tools)
    without = np.flatnonzero(np.all([np.isnan(values) for values in results.values()], axis=0))
    refused = evaluate.refused(study.numbers()[without[0]], study.case(int(without[0]))) if len(without) else ""
    base = Machines(joints).base(study)
    left_out = [f"{len(without)} of them have no results; the first: {refused}"] if refused else []
    remarks = (*left_out, *(f"{study.base.name}: {said}" for said in mistakes(base)))
    with progress.step("writing the report"):
        written, exact = write_findings(study, results, verdict, joints, evaluate, (*remarks, *base.remarks()), folder)
    return StudyResults(study, folder, done, store.total, verdict, remarks, (folder / "results.npz", *written), exact)


def _shard(shard: str | None) -> tuple[int, int]:
    if shard is None:
        return 1, 1
    found = _SHARD.fullmatch(shard)
    if found is None or not 1 <= int(found[1]) <= int(found[2]):
        raise InputError(f"--shard: {shard!r}, expected k/n such as 2/8")
    return int(found[1]), int(found[2])


def identified(study: Study) -> dict[str, Joint]:
    """Joints that the base machine leaves to be identified, once for all configurations."""
    joints: dict[str, Joint] = {}
    for tool in study.with_tools:
        machine = read_machine(study.base, dict(tool))
        for name, joint in joints.items():
            if name in [c.name for c in machine.connections]:
                machine = machine.with_joint(name, joint)
        names = [c.name for c in machine.connections if c.identify is not None and c.name not in joints]
        if names:
            found, _ = with_joints(machine)
            joints |= {c.name: c.joint for c in found.connections if c.name in names and c.joint is not None}
    return joints
