"""What is known of every point of a branch: its error, and whether more harmonics are needed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import Outcome

from ..harmonic_balance.assembly import Assembly
from ..harmonic_balance.harmonics import with_mean
from ..harmonic_balance.held_forces import can_hold, held_changes
from ..harmonic_balance.truncation import more_harmonics, truncation_error
from ..operating.branches import Branch, End

Branches = list[tuple[Branch, ...]]
"""Per force."""

TOLERANCE = 1e-3
"""Estimated error above which one harmonic is not enough."""
MUCH = 1e-2
"""Change by a force that sliders hold above which it is told."""
_SOME = 16
"""Points of a branch at which held forces are looked at."""


def with_errors(assembly: Assembly, forces: Array, branches: Sequence[Sequence[Branch]]) -> Branches:
    """Branches with the estimated error of every point, all those of the same harmonics side by side."""
    branches = _with_means(assembly, branches)
    flat = [(f, k) for f, of_force in enumerate(branches) for k in range(len(of_force))]
    out = [list(of_force) for of_force in branches]
    for own in {branches[f][k].harmonics for f, k in flat}:
        solved = with_mean(own, assembly.biased is not None)
        wider = more_harmonics(assembly, solved)
        some = [(f, k) for f, k in flat if branches[f][k].harmonics == own]
        chosen = [branches[f][k] for f, k in some]
        omega = 2 * np.pi * np.concatenate([b.frequency for b in chosen])
        force = np.concatenate([np.full(len(branches[f][k].frequency), forces[f]) for f, k in some])
        z = np.concatenate([_from_rest(assembly, b) for b in chosen])
        error = truncation_error(assembly, omega, force, z, solved, wider)
        ends = np.cumsum([len(b.frequency) for b in chosen])[:-1]
        for (f, k), part in zip(some, np.split(error, ends), strict=True):
            out[f][k] = replace(out[f][k], error=part)
    return [tuple(of_force) for of_force in out]


def with_held_forces(assembly: Assembly, forces: Array, branches: Sequence[Sequence[Branch]]) -> Branches:
    """Branches with what a force that sliders hold can change, from some of their points, the largest among them."""
    if not can_hold(assembly):
        return [tuple(of_force) for of_force in branches]
    return [tuple(_held(assembly, force, b) for b in own) for force, own in zip(forces, branches, strict=True)]


def _held(assembly: Assembly, force: float, b: Branch) -> Branch:
    n = len(b.frequency)
    largest = np.argmax(np.abs(b.joint), axis=0)
    some = np.unique(np.concatenate([np.linspace(0, n - 1, min(n, _SOME)).astype(int), largest]))
    z = _from_rest(assembly, b)[some]
    own = with_mean(b.harmonics, assembly.biased is not None)
    changes = held_changes(assembly, 2 * np.pi * b.frequency[some], np.full(len(some), force), z, own)
    return replace(b, held=np.interp(np.arange(n), some, np.sum(changes, axis=0)))


def _from_rest(assembly: Assembly, b: Branch) -> ComplexArray:
    """Motions of the nonlinear joints as they were solved for, a mean from where they stand, (n, nh, joints)."""
    z: ComplexArray = motions(b)[:, :, list(assembly.nonlinear)]
    if assembly.biased is not None:
        z[:, -1] -= assembly.biased.rest
    return z


def _with_means(assembly: Assembly, branches: Sequence[Sequence[Branch]]) -> Branches:
    """Branches that say where the joints stand under a static load, all points side by side."""
    biased = assembly.biased
    bare = [] if biased is None else [b for of_force in branches for b in of_force if not b.mean.size]
    if biased is None or not bare:
        return [tuple(of_force) for of_force in branches]
    A = np.concatenate([np.abs(b.joint[:, list(assembly.nonlinear)]) for b in bare])
    omega = 2 * np.pi * np.concatenate([b.frequency for b in bare])
    means = np.split(biased.stands + biased.everywhere(A, omega), np.cumsum([len(b.frequency) for b in bare])[:-1])
    found = {id(b): replace(b, mean=mean) for b, mean in zip(bare, means, strict=True)}
    return [tuple(found.get(id(b), b) for b in of_force) for of_force in branches]


def held_means(drive: str, forces: Array, branches: Branches) -> tuple[str, ...]:
    """Where a force that sliders hold changes a motion most, a sentence; none where it hardly does."""
    worst = [(f, b, int(np.nanargmax(b.held))) for f, own in enumerate(branches) for b in own if np.any(b.held > 0)]
    if not worst:
        return ()
    f, b, k = max(worst, key=lambda found: found[1].held[found[2]])
    if b.held[k] <= MUCH:
        return ()
    return (
        "a slider that slipped before may hold a force, which moves the mean and with it the gains of the other laws: "
        f"at {forces[f]:g} N on {drive} and {b.frequency[k]:.5g} Hz the motion can differ by up to "
        f"{percent(b.held[k])} for it",
    )


def percent(share: float) -> str:
    """Two digits of a share: "0.18 %", "560 %"."""
    return f"{float(f'{100 * share:.2g}'):g} %"


def motions(branch: Branch) -> np.ndarray:
    """All harmonics of all connections in m, (n, nh, connections), and the mean behind them where it moves."""
    first = branch.joint[:, None]
    higher = [branch.overtones] if len(branch.harmonics) > 1 else []
    return np.concatenate([first, *higher, *([branch.mean[:, None]] if branch.mean.size else [])], axis=1)


def worst(branches: Sequence[Branch]) -> float:
    """Largest estimated error; infinite where one is not known."""
    errors = np.concatenate([np.zeros(1), *(b.error for b in branches)])
    return float(np.max(np.where(np.isnan(errors), np.inf, errors)))


def with_outcomes(branches: Sequence[Branch], wanted: bool, unknown: Outcome) -> tuple[Branch, ...]:
    """Branches with an outcome per point; ``wanted`` says that more harmonics were to be solved for where they matter.

    ``unknown`` is what an error that is not known means then.
    """
    out = []
    for b in branches:
        outcomes = [Outcome.CONVERGED] * len(b.frequency)
        if wanted:
            # On a fold itself the error at fixed frequency has no bound, however small it is along the curve.
            folds = [i for i, end in ((0, b.ends[0]), (len(outcomes) - 1, b.ends[1])) if end is End.FOLD]
            for i in np.setdiff1d(np.flatnonzero(~(b.error <= TOLERANCE)), folds):
                outcomes[i] = unknown if np.isnan(b.error[i]) else Outcome.HARMONICS_SIGNIFICANT
        out.append(replace(b, outcomes=tuple(outcomes)))
    return tuple(out)
