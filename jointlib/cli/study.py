"""``jointlib study``: thousands of configurations of a machine, computed, resumed and judged."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from jointlib.cli.arguments import Target, Verb, input_file, json_option
from jointlib.cli.output import emit, table, working, wrote
from jointlib.errors import InputError

if TYPE_CHECKING:
    from jointlib.joint import Joint
    from machines.study.store import Store
    from machines.study.study import Study


@click.group("study")
def command() -> None:
    """Compare many configurations of a machine: compute them, go on after a stop, say which is best.

    \b
    Example:
      jointlib study run machines/library/guide_mill.study.toml -o study
    """


def _options(function: Any) -> Any:
    for option in (
        json_option,
        click.option("-o", "output", type=Target(folder=True), required=True, help="Folder of the results."),
        click.option("--scheduler", help="Address of a Dask scheduler, whose workers compute instead."),
        click.option("--shard", help="k/n: only the k-th of n parts, for batch queues that share the folder."),
        click.option("--workers", type=click.IntRange(min=1), help="Processes; default: one per processor."),
        input_file("study"),
    ):
        function = option(function)
    return function


@command.command("run", cls=Verb)
@_options
def run(
    study: Path, workers: int | None, shard: str | None, scheduler: str | None, output: Path, as_json: bool
) -> None:
    """Compute every configuration of STUDY; what is in the folder already is not computed again.

    \b
    Example:
      jointlib study run machines/library/guide_mill.study.toml -o study
    """
    _compute(study, workers, shard, scheduler, output, as_json, new=True)


@command.command("resume", cls=Verb)
@_options
def resume(
    study: Path, workers: int | None, shard: str | None, scheduler: str | None, output: Path, as_json: bool
) -> None:
    """Go on with STUDY in a folder where it was begun.

    \b
    Example:
      jointlib study resume machines/library/guide_mill.study.toml -o study
    """
    _compute(study, workers, shard, scheduler, output, as_json, new=False)


@command.command("report", cls=Verb)
@input_file("study")
@click.option("-o", "output", type=Target(folder=True), required=True, help="Folder of the results.")
@click.option("--table", "target", type=Target(".parquet", ".csv"), help="Write every configuration to this file.")
@json_option
def report(study: Path, output: Path, target: Path | None, as_json: bool) -> None:
    """Say what the results of STUDY in the folder amount to.

    \b
    Example:
      jointlib study report machines/library/guide_mill.study.toml -o study
    """
    from machines.study.run import begin, planned
    from machines.study.study import read_study
    from machines.study.tables import write_table

    opened = read_study(study)
    if not (output / "study.json").is_file():
        raise InputError(f"-o {output}: holds no study, expected the folder of 'jointlib study run'")
    store = begin(opened, output)
    if target is not None:
        write_table(planned(opened, output), store, target)
    _tell(planned(opened, output), store, output, as_json)
    if target is not None and not as_json:
        click.echo(wrote(target))


def _compute(
    study: Path, workers: int | None, shard: str | None, scheduler: str | None, output: Path, as_json: bool, new: bool
) -> None:
    from machines.study.run import begin, evaluate_all, planned
    from machines.study.study import read_study

    part = _part(shard)
    opened = read_study(study)
    if not new and not (output / "study.json").is_file():
        raise InputError(f"-o {output}: holds no study to resume, expected the folder of 'jointlib study run'")
    store = begin(opened, output)
    joints = _identified(opened)
    with working(f"computing {len(store.missing())} of {store.blocks} blocks"):
        evaluate_all(opened, store, joints, workers, part, scheduler)
    _tell(planned(opened, output), store, output, as_json)


def _part(shard: str | None) -> tuple[int, int]:
    if shard is None:
        return 1, 1
    k, slash, n = shard.partition("/")
    if not (slash and k.isdigit() and n.isdigit() and 1 <= int(k) <= int(n)):
        raise InputError(f"--shard: {shard!r}, expected k/n such as 2/8")
    return int(k), int(n)


def _identified(study: Study) -> dict[str, Joint]:
    """Joints that the base machine leaves to be identified, once for all configurations."""
    from jointlib.cli.joints import with_joints
    from machines import read_machine

    machine = read_machine(study.base)
    names = [c.name for c in machine.connections if c.identify is not None]
    if not names:
        return {}
    found, _ = with_joints(machine)
    return {c.name: c.joint for c in found.connections if c.name in names and c.joint is not None}


def _tell(study: Study, store: Store, output: Path, as_json: bool) -> None:
    from jointlib.io.atomic import write_npz
    from machines.study.study import QUANTITIES
    from machines.study.verdict import judge

    done = store.total - sum(store.rows(i, i).stop - store.rows(i, i).start for i in store.missing())
    data: dict[str, Any] = {"done": done, "total": store.total, "best": None}
    lines = [f"{done} of {store.total} configurations are computed"]
    if done < store.total:
        emit(as_json, data, [*lines, "the others are still to do: resume the study"])
        return
    results = store.results()
    write_npz(output / "results.npz", {"factors": study.numbers(), **results})
    verdict = judge(study, results)
    lines.append(f"{verdict.feasible} of {verdict.designs} designs meet the constraints")
    if verdict.best is not None:
        best = verdict.best
        data["best"] = {"configuration": best.number, "factors": dict(best.factors), "results": dict(best.results)}
        names = [*best.factors, *best.results]
        units = [f" [{QUANTITIES[name][0]}]" if name in QUANTITIES else "" for name in names]
        rows = [(*d.factors.values(), *(f"{d.results[name]:.4g}" for name in d.results)) for d in verdict.leading]
        lines += table([name + unit for name, unit in zip(names, units, strict=True)], rows)
    if verdict.surer is not None:
        data["probability"] = verdict.surer
        lines.append(f"the first is better than the second in {100 * verdict.surer:.0f} % of what is uncertain")
    if verdict.front:
        data["front"] = [{"factors": dict(d.factors), "results": dict(d.results)} for d in verdict.front]
        lines.append(f"{len(verdict.front)} designs are beaten by no other in every objective")
    for quantity, factors in verdict.sensitivity.items():
        data.setdefault("sensitivity", {})[quantity] = {k: list(v) for k, v in factors.items()}
        rows = [(name, f"{first:.3f}", f"{total:.3f}") for name, (first, total) in factors.items()]
        lines += table((f"share of the variance of {quantity}", "alone", "with interactions"), rows)
    emit(as_json, data, [*lines, wrote(output / "results.npz")])
