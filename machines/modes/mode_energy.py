"""Where the energy of a mode is: which part moves, which joint bends, which one dissipates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array

from .natural_modes import NaturalModes


@dataclass(frozen=True, eq=False)
class ModeEnergies:
    """Shares of the energy of every mode; over joints and components together each kind sums to one.

    The energies are means over a cycle of the mode as it vibrates: strain K|z|²/4 of a joint and qᴴKq/4 of a component,
    kinetic |s|² qᴴMq/4, dissipated C|z|² and qᴴCq times |s|²/2 as power. Without damping, or where damping is spread as
    stiffness and mass are, the strain share of a joint is twice the relative sensitivity of the frequency to it; with
    other damping the two part by the square of the damping ratio, and ``sensitivity`` is the exact one.
    """

    kinetic: Array | None
    """Of every component, (components, modes); None where one has state equations only, which tell no energy."""
    strain: Array
    """Of every joint, (joints, modes); below zero for a joint that pushes what moves away."""
    strain_inside: Array
    """Of every component's own elasticity, (components, modes); nan where it is not known by itself."""
    loss: Array
    """Of every joint, (joints, modes); 0 in modes that lose nothing."""
    loss_inside: Array
    """Of every component's own damping, (components, modes); nan where it is not known."""
    sensitivity: Array
    """d ln f/d ln K of every joint, its damping unchanged, (joints, modes)."""


def mode_energies(modes: NaturalModes) -> ModeEnergies:
    """Energies of modes, from their shapes; a machine in state equations tells them of its joints by sensitivity."""
    K, C, z = modes.stiffness.T, modes.damping.T, np.abs(modes.stretch) ** 2
    sensitivity = K * (modes.slope / modes.pole).real
    if modes.equations is None or modes.coordinates is None:
        unknown = np.full((len(modes.machine.components), len(modes.pole)), np.nan)
        loss = C * z
        return ModeEnergies(None, 2 * sensitivity, unknown, _shares(loss, loss), unknown, sensitivity)
    q = modes.equations.motions @ modes.coordinates
    kinetic, strain, loss = np.zeros((3, len(modes.machine.components), len(modes.pole)))
    start = 0
    for i, component in enumerate(modes.machine.components):
        model = component.second_order()
        assert model is not None
        own = q[start : start + len(model.mass)]
        start += len(own)
        for out, matrix in ((kinetic, model.mass), (strain, model.stiffness), (loss, model.damping)):
            out[i] = np.sum((own.conj() * (matrix @ own)).real, axis=0)
    bent, lost = np.concatenate([K * z, strain]), np.concatenate([C * z, loss])
    return ModeEnergies(
        _shares(kinetic, kinetic),
        _shares(K * z, bent),
        _shares(strain, bent),
        _shares(C * z, lost),
        _shares(loss, lost),
        sensitivity,
    )


def _shares(part: Array, whole: Array) -> Array:
    total = np.sum(whole, axis=0)
    return np.asarray(np.where(total != 0, part / np.where(total != 0, total, 1.0), 0.0))
