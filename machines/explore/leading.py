"""Which joint the page shows first."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from jointlib.errors import InputError

from ..model.machine import Machine
from ..modes.mode_energy import mode_energies
from ..modes.natural_modes import natural_modes
from .curves import Curves


def leading(machine: Machine, places: Mapping[str, str], curves: Curves) -> str | None:
    """Of the joints in `Curves.gains` that with most energy in the mode that the tool feels most; None without one.

    Of a bundle and of joints that are alike, ``places`` by connection, the whole counts.
    """
    try:
        modes = natural_modes(machine)
    except InputError:  # a part is known by its receptance only
        return next(iter(curves.gains), None)
    share: dict[str, float] = dict.fromkeys(places.values(), 0.0)
    if len(modes.pole):
        strain = mode_energies(modes).strain[:, int(np.argmax(modes.tool_peak))]
        for connection, held in zip(machine.flexible, strain.tolist(), strict=True):
            share[places[connection.name]] += held
    return max(curves.gains, key=lambda name: share[places[name]], default=None)
