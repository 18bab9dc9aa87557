"""Frequency responses from hammer hits and shaker records, written as a measurement."""

from __future__ import annotations

from pathlib import Path

from jointlib.answers.given import File, measurement_of
from jointlib.errors import InputError
from jointlib.estimation.estimate import estimate as estimated
from jointlib.estimation.frf_measurement import write_frfs
from jointlib.estimation.result import Estimate
from jointlib.io.atomic import given_target
from jointlib.measurement import Measurement
from jointlib.shown.pictures import write_picture


def estimate(measurement: Measurement | File, *, output: File | None = None, plot: File | None = None) -> Estimate:
    """Frequency responses, with the variance of every line, from hits or shaker records: ``jointlib estimate``.

    Sealed and quiet records are left closed.

    Parameters
    ----------
    measurement
        Of kind "impact" or "shaker", or its file.
    output
        The measurement file of kind "frf" to write; its responses stand beside it.
    plot
        The picture of receptances and coherence to write, .svg or .png.

    Raises
    ------
    InputError
        Where the kind is another, no clean hit or record is left, a channel is silent, nothing follows the force, or a
        driving point yields energy.
    """
    return estimate_to(measurement, output, plot)[0]


def estimate_to(
    measurement: Measurement | File, output: File | None, plot: File | None
) -> tuple[Estimate, tuple[Path, ...]]:
    """The same, with the files that were written."""
    target = given_target(output, ".toml")
    picture = given_target(plot, ".svg", ".png", where="plot")
    test = measurement_of(measurement)
    if target is not None and target.exists() and target.samefile(test.source):
        raise InputError(f"-o {output}: is the measurement itself, expected another name")
    found = estimated(test)
    files = () if target is None else write_frfs(target, found, test)
    if picture is not None:
        write_picture(picture, found.plot())
        files = (*files, picture)
    return found, files
