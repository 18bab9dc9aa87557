"""Fit a joint to measurements."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from jointlib.cli.arguments import Given, Target, Verb, input_file, json_option
from jointlib.cli.output import emit, working, wrote
from jointlib.errors import InputError
from jointlib.shown.text import table
from jointlib.units import rounded, shown

if TYPE_CHECKING:
    from jointlib.cutting_force.result import CuttingForces
    from jointlib.identification import Identification
    from jointlib.ringdown.identify import Ringdown


@click.command("identify", cls=Verb)
@input_file("measurements", nargs=-1, required=True)
@click.option("--law", "laws", multiple=True, help="Kinds of the laws to fit, for example hertz-guide viscous.")
@click.option("--start", type=Given(), help="Joint file with laws, first values and what is fixed.")
@click.option("--order", help="Orders i,j of a chebyshev surface; default: chosen on held-out data.")
@click.option("-o", "output", type=Target(), required=True, help="The joint file to write.")
@json_option
def command(
    measurements: tuple[Path, ...],
    laws: tuple[str, ...],
    start: Path | None,
    order: str | None,
    output: Path,
    as_json: bool,
) -> None:
    """Fit a joint to MEASUREMENTS, with standard errors; sealed records stay closed.

    One measurement of kind "cutting-force" gives coefficients of cutting forces instead, in a file that the [cutting]
    of a machine can name.

    One measurement of kind "ringdown" gives frequency and damping over amplitude, as a table where neither --law nor
    --start is given.

    \b
    Examples:
      jointlib identify machines/library/guide_mill/static.measurement.toml machines/library/guide_mill/rig.measurement.toml --start machines/library/guide_mill/start.joint.toml -o guide.joint.toml
      jointlib identify machines/library/end_mill_forces/forces.measurement.toml -o end_mill.cutting.toml
    """  # noqa: E501
    from jointlib.answers.given import measurement_of
    from jointlib.answers.identify import cutting_forces, identify, ringdown
    from jointlib.identification.summary import identified
    from jointlib.measurement import FORCES, RINGDOWN

    tests = [measurement_of(path) for path in measurements]
    if any(test.kind == FORCES for test in tests):
        if len(tests) > 1 or laws or start is not None or order is not None:
            raise InputError(f"identify: a measurement of kind {FORCES!r} stands alone, without laws of a joint")
        with working("fitting"):
            of_cut = cutting_forces(tests[0], output=output)
        emit(as_json, {**of_cut.as_json(), "file": str(output)}, [*words_of_cut(of_cut), wrote(output)])
        return
    if any(test.kind == RINGDOWN for test in tests):
        if len(tests) > 1 or order is not None or (laws and start is not None):
            raise InputError(
                f"identify: a measurement of kind {RINGDOWN!r} stands alone, with --law, --start or neither"
            )
        with working("fitting"):
            decays = ringdown(tests[0], laws=laws, start=start, output=output)
        fit = {} if decays.fit is None else identified(decays.fit)
        said = [*fit.get("messages", ()), *decays.messages]
        lines = [] if decays.fit is None else words(replace(decays.fit, messages=()))
        data = {**fit, **decays.as_json(), "messages": said, "file": str(output)}
        emit(as_json, data, [*words_of_decay(decays), *lines, *said, wrote(output)])
        return
    if bool(laws) == (start is not None):
        raise InputError("identify: expected either --law or --start, such as --law linear viscous to begin with")
    with working("fitting"):
        found = identify(tests, laws=laws, start=start, order=order, output=output)
    emit(as_json, {**identified(found), "file": str(output)}, [*words(found), wrote(output)])


def words_of_decay(found: Ringdown) -> list[str]:
    """Frequency and damping over amplitude as lines of text."""
    header = ("record", "mode", "amplitude [µm]", "f [Hz]", "std. error", "damping [%]", "std. error")
    return table(header, found.rows())


def words_of_cut(found: CuttingForces) -> list[str]:
    """Coefficients as lines of text, with what mean forces alone say of them."""
    lines = table(("coefficient", "value", "std. error", "unit", "by mean forces"), found.rows())
    lines += [
        f"{e.measurement}: rms {e.rms:.4g} {e.unit}, {100 * e.relative:.2f} % of the largest mean force"
        for e in found.errors
    ]
    return [f"{found.coefficients.process}, {found.method} forces", *lines, *found.messages]


def words(found: Identification) -> list[str]:
    """The fit as lines of text: parameters with their standard errors, misfit, remarks."""
    rows = []
    for name, p in found.parameters.items():
        factor, unit = shown(p.unit)
        told = rounded(p.value * factor, (p.standard_error or 0.0) * factor, 6)
        rows.append((name, *told, unit, p.status + ", law does not fit" * p.doubted))
    lines = table(("parameter", "value", "std. error", "unit", ""), rows)
    lines += [
        f"{e.measurement}: rms {e.rms:.4g} {e.unit}, {100 * e.relative:.2f} % of the largest force"
        for e in found.errors
    ]
    return [*lines, *found.messages]
