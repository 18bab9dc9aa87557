"""Describing function of a joint."""

from __future__ import annotations

from pathlib import Path

import click

from jointlib.cli.arguments import Quantity, Verb, input_file, json_option
from jointlib.cli.output import emit
from jointlib.shown.text import table


@click.command("df", cls=Verb)
@input_file("joint")
@click.option(
    "--amplitude", type=Quantity("m", lower=0), multiple=True, required=True, help="Peak relative displacement."
)
@click.option("--frequency", type=Quantity("Hz", lower=0), multiple=True, required=True, help="Frequency.")
@click.option("--bias", type=Quantity("m"), default="0", help="Mean relative displacement.")
@json_option
def command(
    joint: Path, amplitude: tuple[float, ...], frequency: tuple[float, ...], bias: float, as_json: bool
) -> None:
    """Describing function G(A, ω) of JOINT: equivalent stiffness Re G and, times 1/ω, damping Im G.

    \b
    Example:
      jointlib df machines/library/guide.joint.toml --amplitude 1um 3um 5um --frequency 500
    """
    from jointlib.answers.df import df

    found = df(joint, amplitude=amplitude, frequency=frequency, bias=bias)
    data = {
        "amplitude": found.amplitude,
        "frequency": found.frequency,
        "gain_real": found.gain.real,
        "gain_imag": found.gain.imag,
        "warnings": found.warnings,
    }
    rows = [
        (f"{a * 1e6:g}", f"{hz:g}", f"{k / 1e6:.6g}", f"{c:.6g}")
        for a, hz, k, c in zip(*(values for values, _ in found.columns().values()), strict=True)
    ]
    lines = table(("amplitude [um]", "frequency [Hz]", "stiffness [N/um]", "damping [N s/m]"), rows)
    emit(as_json, data, [*lines, *found.warnings])
