"""Band of the forced response: the computation repeated for samples of what was identified and measured."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointlib.arrays import Array

from ..forced_response.response import response
from ..model.machine import Machine
from .drawn_machines import sampled_machines
from .lobe_bands import Band


def response_band(
    machine: Machine,
    force: float | Sequence[float] | None,
    frequency: Array,
    drive: str | None = None,
    count: int = 400,
    seed: int = 0,
    harmonics: int | str | Sequence[int] = 1,
) -> Band:
    """Band of |G| in m/N from ``drive`` to the outputs of `response`, (3, forces, lines, outputs).

    Joints are drawn from their covariance and measured FRFs from their variance, the same samples as behind
    `lobe_band`; nan on lines where some sample has no admissible solution. It costs ``count`` responses.

    Parameters
    ----------
    force, drive, harmonics
        As in `response`.
    frequency
        Lines in Hz, three or more.
    count, seed
        Samples, and the seed of their random numbers.
    """
    machines, clipped = sampled_machines(machine, count, seed)
    samples = []
    for one in machines:
        found = response(one, force, frequency, drive, harmonics=harmonics)
        samples.append([np.abs(frf.receptance[:, :, 0]) for frf in found.frfs])
    return Band(np.array(samples), clipped)
