"""How far receptances are known: measured ones end somewhere, and harmonics of a vibration ask for more than that."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import FrequencyMismatch

from ..components.component import Component
from ..indices import Mask
from ..model.machine import Machine
from .cycle import Harmonics


def held(machine: Machine, omega: Array, highest: int) -> Array:
    """Frequencies in rad/s, those whose harmonics pass the ends of a measured receptance held there.

    Steps along a curve may look past the range that was asked for, which is where that receptance may end.
    """
    low, high = machine.known_band
    return np.clip(omega, 2 * np.pi * low, np.divide(2 * np.pi * high, highest))


def reached(machine: Machine, omega: Array, harmonics: Harmonics) -> Mask:
    """Where all receptances are known at these multiples of frequencies in rad/s; the mean asks for none of them."""
    lines, place = np.unique(omega, return_inverse=True)
    known = np.ones(len(lines), dtype=bool)
    for component in _by_receptance_alone(machine):
        for h in filter(None, harmonics):
            known &= _known(component, h * lines)
    return known[place]


def too_short(machine: Machine, omega: Array, harmonics: Harmonics) -> str:
    """What is missing where `reached` is not everywhere true: the part, the frequencies, and what would help."""
    said = []
    for component in _by_receptance_alone(machine):
        for h in filter(None, harmonics):
            lost = omega[~_known(component, h * omega)]
            if len(lost):
                first = np.eye(1, len(component.dofs))
                try:
                    component.between(h * lost, first, first)
                except FrequencyMismatch as error:
                    said.append(f"{error} (harmonic {h} of {_span(lost)})")
                break
    return "; ".join(said)


def _by_receptance_alone(machine: Machine) -> list[Component]:
    alone = machine.without_equations
    return [c for c in machine.components if c.name in alone]


def _known(component: Component, omega: Array) -> Mask:
    """Where a receptance can be asked for, found by halves; one entry tells."""
    first = np.eye(1, len(component.dofs))
    try:
        component.between(omega, first, first)
    except FrequencyMismatch:
        if len(omega) == 1:
            return np.zeros(1, dtype=bool)
        middle = len(omega) // 2
        return np.concatenate([_known(component, omega[:middle]), _known(component, omega[middle:])])
    return np.ones(len(omega), dtype=bool)


def _span(omega: Array) -> str:
    low, high = np.min(omega) / (2 * np.pi), np.max(omega) / (2 * np.pi)
    return f"{low:.6g} Hz" if low == high else f"{low:.6g} to {high:.6g} Hz"
