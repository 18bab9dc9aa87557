"""Describing function of a joint."""

from __future__ import annotations

from pathlib import Path

import click
import numpy as np

from jointlib.cli.arguments import Quantity, Verb, input_file, json_option
from jointlib.cli.output import emit, table


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
    from jointlib.describing import DescribingFunction
    from jointlib.io.joint_file import read_joint

    model = read_joint(joint)
    A, f = np.array(amplitude), np.array(frequency)
    harmonic = DescribingFunction(model, bias).harmonic(A[:, None], 2 * np.pi * f)
    data = {"amplitude": A, "frequency": f, "gain_real": harmonic.gain.real, "gain_imag": harmonic.gain.imag}
    messages = []
    low, high = model.validity.get("amplitude", (0.0, np.inf))
    outside = (low > A) | (high < A)
    if np.any(outside):
        listed = ", ".join(f"{a * 1e6:g} um" for a in A[outside])
        messages.append(f"outside the amplitudes the joint was identified on (up to {high * 1e6:g} um): {listed}")
    if np.max(harmonic.error) > 1e-6 * np.max(
        np.abs(np.where(np.isfinite(harmonic.gain), harmonic.gain, 0)), initial=1
    ):
        messages.append(f"numerical, with an error of up to {np.max(harmonic.error):.2g} N/m")
    rows = [
        (f"{a * 1e6:g}", f"{hz:g}", f"{g.real / 1e6:.6g}", f"{g.imag / (2 * np.pi * hz) if hz else np.nan:.6g}")
        for a, row in zip(A, harmonic.gain, strict=True)
        for hz, g in zip(f, row, strict=True)
    ]
    lines = table(("amplitude [um]", "frequency [Hz]", "stiffness [N/um]", "damping [N s/m]"), rows)
    emit(as_json, {**data, "warnings": messages}, [*lines, *messages])
