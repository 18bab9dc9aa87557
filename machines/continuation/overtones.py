"""Further harmonics where the first alone does not tell enough: when, which ones, and what is said where they fail."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError, Outcome
from jointlib.shown.progress import Progress

from ..harmonic_balance.assembly import Assembly
from ..harmonic_balance.cycle import Harmonics
from ..harmonic_balance.frequency_reach import reached, too_short
from ..harmonic_balance.truncation import more_harmonics, odd, unsuited
from ..stability.labels import TOLERANCE, Branches, with_errors, with_outcomes, worst
from .all_curves import from_branches
from .curve_results import Followed, by_arc_length
from .overtone_windows import pieced

_FAR = 0.2
_HIGHEST = 1000
"""Multiples of the driving frequency that are solved for at most."""
_REMEDY = "measure further, give modal data of the part, or keep the range lower"


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
            if whole and max(values, default=0) > _HIGHEST:
                raise InputError(f"response: harmonics has {max(values)}, expected multiples up to {_HIGHEST}")
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
    during: Progress,
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
        remarks += _solved(assembly, forces, lines, out, need, several, during) if need else []
    unknown = Outcome.HARMONICS_SIGNIFICANT if unsuited(assembly) else Outcome.FRF_TOO_SHORT
    if not any(part.outcome is Outcome.FRF_TOO_SHORT for part in out):
        remarks += _unknown(assembly, [part.branches for part in out])
    done = [_pointwise(part, automatic, len(several), unknown) for part in out]
    return done, tuple(remarks)


def _pointwise(part: Followed, automatic: bool, count: int, unknown: Outcome) -> Followed:
    """Outcomes of the points; where all went well otherwise, theirs is that of the force too."""
    branches = tuple(
        b for one in part.branches for b in with_outcomes([one], automatic or len(one.harmonics) < count, unknown)
    )
    left = [o for b in branches for o in b.outcomes if o is not Outcome.CONVERGED]
    outcome = left[0] if left and part.outcome is Outcome.CONVERGED else part.outcome
    return replace(part, branches=branches, outcome=outcome)


def _unknown(assembly: Assembly, branches: Branches) -> list[str]:
    """Where the error of what was solved for is not known because a receptance does not reach further harmonics."""
    if assembly.biased is not None or unsuited(assembly):
        return []
    said = []
    for own in sorted({b.harmonics for of_force in branches for b in of_force}):
        points = [b for of_force in branches for b in of_force if b.harmonics == own]
        omega = 2 * np.pi * np.concatenate([b.frequency[np.isnan(b.error)] for b in points])
        why = too_short(assembly.machine, omega, more_harmonics(assembly, own)) if len(omega) else ""
        if why:
            solved = "one harmonic alone is" if len(own) == 1 else f"harmonics {', '.join(map(str, own))} are"
            said.append(f"how far {solved} off is not known everywhere: {why}; {_REMEDY}")
    return said


def _first_only(forces: Array, branches: Branches) -> list[str]:
    errors = [float(np.nanmax(np.concatenate([np.zeros(1), *(b.error for b in of_force)]))) for of_force in branches]
    if max(errors, default=0.0) <= TOLERANCE:
        return []
    force = forces[int(np.argmax(errors))]
    # Next to a fold a small change of the equations moves the solution at fixed frequency far.
    size = f"an estimated {100 * max(errors):.2g} %" if max(errors) < _FAR else f"more than {100 * _FAR:g} %"
    return [
        f"at {force:g} N one harmonic alone is off by {size} at worst; `jointlib frf --harmonics auto`, in Python "
        'harmonics="auto", takes the others into account'
    ]


def _solved(
    assembly: Assembly,
    forces: Array,
    lines: Array,
    out: list[Followed],
    need: list[int],
    several: Harmonics,
    during: Progress,
) -> list[str]:
    """Replace what was found at the forces in need by solutions in several harmonics; what is to be said."""
    if len(lines) < 2:
        raise InputError("response: several harmonics are followed over a range, expected more than one line")
    remarks = list(unsuited(assembly))
    short = not np.all(reached(assembly.machine, 2 * np.pi * lines, several))
    if short:
        why = too_short(assembly.machine, 2 * np.pi * lines, several)
        moved = ", ".join(assembly.machine.flexible[i].name for i in assembly.nonlinear)
        remarks.append(f"{moved}: only the first harmonic is solved for: {why}; {_REMEDY}")
    if remarks:
        kind = Outcome.FRF_TOO_SHORT if short else Outcome.HARMONICS_SIGNIFICANT
        for f in need:
            out[f] = replace(out[f], outcome=kind if out[f].outcome is Outcome.CONVERGED else out[f].outcome)
        return remarks
    if assembly.biased is None and not odd(assembly):
        remarks.append("a joint pulls harder one way than the other; its mean displacement is held at 0")
    chosen = forces[need]
    beside = []
    for f in need:
        with during.step(f"solving harmonics {', '.join(map(str, several))} at {forces[f]:g} N"):
            beside.append(pieced(assembly, float(forces[f]), lines, several, out[f].branches))
    rest = [f for f, part in zip(need, beside, strict=True) if part is None]
    starts = from_branches(assembly, [out[f].branches for f in rest], several)
    with during.step(f"following curves in harmonics {', '.join(map(str, several))} at {len(rest)} forces"):
        traced = iter(by_arc_length(assembly, forces[rest], lines, several, starts) if rest else [])
    new = [next(traced) if part is None else part for part in beside]
    with during.step("estimating what further harmonics change there"):
        with_error = with_errors(assembly, chosen, [part.branches for part in new])
    for f, part, branches in zip(need, new, with_error, strict=True):
        if branches:
            out[f] = replace(part, branches=branches)
        else:
            out[f] = replace(out[f], outcome=Outcome.HARMONICS_SIGNIFICANT)
    return remarks
