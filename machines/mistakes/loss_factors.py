"""Parts whose loss factor counts for less in the machine than it says, because the machine bends them slowly."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..components.beam import Beam
from ..modes.natural_modes import NaturalModes

_SHORT = 0.5
"""Share of the damping that a mode would have more, from which it is told."""


def short_losses(modes: NaturalModes) -> Iterator[str]:
    """Modes that the tool feels and whose damping would be another with the loss factors at their own frequency.

    A beam takes its loss factors as the damping ratios of its own modes. Strained at ω, a mode at ω_r dissipates ω/ω_r
    of what its loss factor says, so the strain energy of the machine's mode tells what is short:
    Δζ = Σ c_r (ω_r − ω) |q_r|²/(2 ω² qᴴ M q), c_r the damping of the beam's mode at unit modal mass.
    """
    if not modes.machine.tool or modes.equations is None or modes.coordinates is None or not len(modes.pole):
        return
    q = modes.equations.motions @ modes.coordinates
    omega, moving, start = np.abs(modes.pole), np.zeros(len(modes.pole)), 0
    short = {}
    for part in modes.machine.components:
        model = part.second_order()
        assert model is not None
        own = q[start : start + len(model.mass)]
        start += len(own)
        moving += np.sum((own.conj() * (model.mass @ own)).real, axis=0)
        if isinstance(part, Beam) and not part.held and any(s.material.loss_factor for s in part.segments):
            rate, natural = np.diag(model.damping), np.sqrt(np.maximum(np.diag(model.stiffness), 0.0))
            lacking = np.maximum(natural[:, None] - omega, 0.0) * rate[:, None]
            short[part.name] = np.sum(lacking * np.abs(own) ** 2, axis=0)
    if not short:
        return
    lacking = np.array(list(short.values())) / (2 * omega**2 * moving)
    found = np.flatnonzero(modes.felt & (np.sum(lacking, axis=0) > _SHORT * np.abs(modes.damping_ratio)))
    if not len(found):
        return
    first = int(found[np.argmax(modes.tool_peak[found])])
    most = list(short)[int(np.argmax(lacking[:, first]))]
    others = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
    ratio = 100 * modes.damping_ratio[first]
    whole = ratio + 100 * np.sum(lacking[:, first])
    yield (
        f"the mode at {modes.frequency[first]:.5g} Hz that the tool feels{others} has {ratio:.2g} % damping, with the "
        f"loss factors of its parts at that frequency {whole:.2g} %: the machine bends "
        f'{most} more slowly than it bends when free; say where it is held, as held = ["STATION"]'
    )
