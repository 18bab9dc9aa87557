"""Further harmonics where the first alone does not tell enough: when, which ones, and what is said where they fail."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError, Outcome

from .assembly import Assembly
from .followed import Followed, by_arc_length
from .following import from_branches
from .harmonics import Harmonics
from .labels import TOLERANCE, Branches, with_errors, with_outcomes, worst
from .truncation import more_harmonics, odd, reached, unsuited

_FAR = 0.2


@dataclass(frozen=True)
class Overtones:
    """What was asked for: certain harmonics, or (none given) those that matter."""

    harmonics: Harmonics | None

    @classmethod
    def of(cls, given: int | str | Sequence[int], moves: bool = False) -> Overtones:
        """From 1, "auto" or ascending multiples that begin with 1; where means move they may begin with 0, the mean."""
        if given == "auto":
            return cls(None)
        if given == 1:
            return cls((1,))
        if not isinstance(given, (int, str)):
            values = tuple(given)
            if moves and values[:1] == (0,):
                values = values[1:]
            whole = all(isinstance(h, (int, np.integer)) for h in values)
            if whole and values[:1] == (1,) and all(a < b for a, b in pairwise(values)):
                return cls(tuple(int(h) for h in values))
        raise InputError(
            f"response: harmonics is {given!r}, expected 1 (the first harmonic only), 'auto', or ascending multiples "
            "that begin with 1, such as (1, 3, 5)"
        )


def refined(
    assembly: Assembly,
    forces: Array,
    lines: Array,
    found: Sequence[Followed],
    estimated: Branches,
    wanted: Overtones,
) -> tuple[list[Followed], tuple[str, ...]]:
    """Solutions with the harmonics that are wanted, and what is to be said about them.

    ``found`` and ``estimated`` hold the first harmonic and its branches with their errors, per force.
    """
    out = [replace(part, branches=branches) for part, branches in zip(found, estimated, strict=True)]
    remarks: list[str] = []
    automatic = wanted.harmonics is None
    several = wanted.harmonics or more_harmonics(assembly, (1,))
    if len(several) == 1 or not assembly.nonlinear:
        remarks += _first_only(forces, estimated)
    else:
        need = [f for f, branches in enumerate(estimated) if not automatic or worst(branches) > TOLERANCE]
        remarks += _solved(assembly, forces, lines, out, need, several) if need else []
    unknown = Outcome.HARMONICS_SIGNIFICANT if unsuited(assembly) else Outcome.FRF_TOO_SHORT
    done = [_pointwise(part, automatic, unknown) for part in out]
    return done, tuple(remarks)


def _pointwise(part: Followed, automatic: bool, unknown: Outcome) -> Followed:
    """Outcomes of the points; where all went well otherwise, theirs is that of the force too."""
    branches = with_outcomes(part.branches, automatic, unknown)
    left = [o for b in branches for o in b.outcomes if o is not Outcome.CONVERGED]
    outcome = left[0] if left and part.outcome is Outcome.CONVERGED else part.outcome
    return replace(part, branches=branches, outcome=outcome)


def _first_only(forces: Array, branches: Branches) -> list[str]:
    errors = [worst(of_force) for of_force in branches]
    finite = [e for e in errors if np.isfinite(e)]
    if not finite or max(finite) <= TOLERANCE:
        return []
    force = forces[int(np.argmax([e if np.isfinite(e) else -1 for e in errors]))]
    # Next to a fold a small change of the equations moves the solution at fixed frequency far.
    size = f"an estimated {100 * max(finite):.2g} %" if max(finite) < _FAR else f"more than {100 * _FAR:g} %"
    return [
        f"at {force:g} N one harmonic alone is off by {size} at worst; harmonics = auto takes the others into account"
    ]


def _solved(
    assembly: Assembly, forces: Array, lines: Array, out: list[Followed], need: list[int], several: Harmonics
) -> list[str]:
    """Replace what was found at the forces in need by solutions in several harmonics; what is to be said."""
    if len(lines) < 2:
        raise InputError("response: several harmonics are followed over a range, expected more than one line")
    remarks = list(unsuited(assembly))
    short = not bool(reached(assembly, np.array([2 * np.pi * lines[-1]]), several[-1])[0])
    if short:
        remarks.append(
            f"a receptance ends below {several[-1] * lines[-1]:g} Hz, so only the first harmonic is solved for"
        )
    if remarks:
        why = Outcome.FRF_TOO_SHORT if short else Outcome.HARMONICS_SIGNIFICANT
        for f in need:
            out[f] = replace(out[f], outcome=why if out[f].outcome is Outcome.CONVERGED else out[f].outcome)
        return remarks
    if assembly.biased is None and not odd(assembly):
        remarks.append("a joint pulls harder one way than the other; its mean displacement is held at 0")
    chosen = forces[need]
    starts = from_branches(assembly, [out[f].branches for f in need], several)
    new = by_arc_length(assembly, chosen, lines, several, starts)
    with_error = with_errors(assembly, chosen, [part.branches for part in new])
    for f, part, branches in zip(need, new, with_error, strict=True):
        if branches:
            out[f] = replace(part, branches=branches)
        else:
            out[f] = replace(out[f], outcome=Outcome.HARMONICS_SIGNIFICANT)
    return remarks
