"""Export a joint as an FMU and verify it, or verify one."""

from __future__ import annotations

from pathlib import Path

import click

from jointlib.cli.arguments import Given, Target, Verb, input_file, json_option, tool_option
from jointlib.cli.output import Working, emit, working, wrote
from jointlib.errors import InputError

_APART = 1e-2
"""Share of the largest value from which on model exchange in FMPy is not to be taken."""


@click.command("fmu", cls=Verb)
@input_file("model", required=False)
@click.option("-o", "output", type=Target(".fmu"), help="The .fmu file to write.")
@click.option("--fmi", type=click.Choice(["2", "3"]), default="2", help="Version of the standard.")
@click.option(
    "--runtime", type=click.Choice(["c", "python"]), help="What computes inside; c where a compiler is found."
)
@click.option(
    "--platform", "platforms", multiple=True, help="Compile for this platform, win64 for example; repeatable."
)
@click.option(
    "--names",
    type=click.Choice(["structured", "flat"]),
    default="structured",
    help="Names of variables: guide.viscous.damping, or guide_viscous_damping.",
)
@click.option("--verify", type=Given(), help="Verify this FMU instead.")
@tool_option
@json_option
def command(
    model: Path | None,
    output: Path | None,
    fmi: str,
    runtime: str | None,
    platforms: tuple[str, ...],
    names: str,
    verify: Path | None,
    changes: dict[str, str],
    as_json: bool,
) -> None:
    """Write MODEL, a joint or a machine, as an FMU; it is validated and replays its reference run before it appears.

    \b
    Example:
      jointlib fmu machines/library/guide.joint.toml -o guide.fmu
      jointlib fmu machines/library/guide.joint.toml -o guide.fmu --fmi 3
      jointlib fmu machines/library/two_mass.toml -o two_mass.fmu
      jointlib fmu --verify guide.fmu
    """
    if verify is not None:
        if model is not None or output is not None or changes:
            raise InputError("--verify: takes the FMU alone, leave out the joint or machine, its tool and -o")
        _verify(verify, as_json)
        return
    if model is None or output is None:
        raise InputError("fmu: expected a joint file and -o X.fmu, a machine file and -o X.fmu, or --verify X.fmu")
    from ..export import export_fmu

    done = export_fmu(
        model,
        output,
        fmi=int(fmi),
        runtime=runtime,
        platforms=platforms,
        names=names,
        tool=changes.get("tool.use"),
        progress=Working(),
    )
    data = {
        "file": str(done.file),
        "platforms": list(done.platforms),
        "max_step": done.max_step,
        "verified_with": list(done.verified_with),
        "runtime": done.runtime,
        "messages": [*done.messages, *done.cost],
    }
    lines = [wrote(done.file), f"platforms: {', '.join(done.platforms) or 'none'}, {done.runtime} runtime"]
    lines += [f"verified with {', '.join(done.verified_with) or 'nothing'}", *done.messages, *done.cost]
    emit(as_json, data, lines)


def _verify(path: Path, as_json: bool) -> None:
    from ..verify import verify_fmu

    with working("verifying"):
        done = verify_fmu(path, exchange=True)
    data = {
        "file": str(done.file),
        "platforms": list(done.platforms),
        "max_step": done.max_step,
        "verified_with": list(done.verified_with),
        "samples": done.samples,
        "difference": done.difference,
        "exchange": done.exchange,
        "exchange_said": done.exchange_said,
    }
    if done.exchange is None:
        exchanged = f"model exchange was not run: {done.exchange_said}"
    else:
        exchanged = (
            f"model exchange by FMPy's CVode is up to {done.exchange:.2g} of the largest value from co-simulation"
        )
        exchanged += "; take co-simulation in that client" if done.exchange > _APART else ""
    lines = [
        f"{path}: verified with {', '.join(done.verified_with)}",
        f"replayed {done.samples} samples, largest difference {done.difference:.2g} of the largest value",
        exchanged,
    ]
    emit(as_json, data, lines)
