"""Peaks of a response with one solution at every frequency, from polynomials through solutions that lie close.

Hundreds of contacts with a peak each at every resonance share the same solutions; a search for every peak alone would
ask for many more.
"""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import Outcome

from ..harmonic_balance.assembly import Assembly
from ..indices import Index
from .peaks import Peak
from .solutions import Solutions, along, balance_at
from .tops import tops

_ROUNDS, _STILL = 8, 1e-12
_SURE = 1e-9
"""Of the amplitude, by how much the polynomials may differ."""


def on_one_curve(assembly: Assembly, force: float, found: Solutions, f: int) -> dict[int, list[Peak]] | None:
    """Peaks of every connection, by its place, at force number f; None where not every line has one solution before
    any fold, or one between the lines is not found.

    Solutions are added round every top until polynomials through seven and through five of them agree to 1e-9; a top
    that stays in doubt is known to the spacing that is left, which four times less every round.
    """
    rows = _one_curve(found, f)
    if rows is None:
        return None
    joints = len(assembly.joints)
    omega, size = 2 * np.pi * found.frequency, np.abs(found.motion[rows, :joints])
    for _ in range(_ROUNDS):
        top = tops(omega, size, _SURE, _STILL)
        further = top.wanted(omega)
        if not len(further):
            break
        start = along(assembly, found, rows, further)
        moved, _, fine, rising, _ = balance_at(assembly, further / (2 * np.pi), np.full(len(further), force), start)
        if not np.all(fine & rising):
            return None
        place = np.searchsorted(omega, further)
        omega, size = np.insert(omega, place, further), np.insert(size, place, np.abs(moved[:, :joints]), axis=0)
    top = tops(omega, size, _SURE, _STILL)
    peaks: dict[int, list[Peak]] = {}
    for k, w, A, width in zip(top.motion.tolist(), top.omega, top.amplitude, top.width, strict=True):
        name, at = assembly.machine.flexible[k].name, float(w) / (2 * np.pi)
        own = Peak(force, name, float(A), at, Outcome.CONVERGED, width=float(width) / (2 * np.pi))
        peaks.setdefault(k, []).append(own)
    return peaks


def round_tops_of_outputs(assembly: Assembly, found: Solutions, last: bool) -> Array:
    """Frequencies in Hz of further lines round the tops of the outputs, where one solution is all there is; at the
    ``last`` those of the tops themselves."""
    omega, further = 2 * np.pi * found.frequency, [np.empty(0)]
    for f in range(len(found.cut)):
        rows = _one_curve(found, f)
        if rows is not None:
            top = tops(omega, np.abs(found.motion[rows, len(assembly.joints) :]))
            further.append(top.omega if last else top.wanted(omega))
    return np.setdiff1d(np.concatenate(further) / (2 * np.pi), found.frequency)


def _one_curve(found: Solutions, f: int) -> Index | None:
    """The solutions at force number f where each line has one, before any fold."""
    rows = np.flatnonzero(found.force == f)
    alone = len(rows) == len(found.frequency) and not np.any(found.cut[f]) and bool(np.all(found.rising[rows]))
    return rows if alone else None
