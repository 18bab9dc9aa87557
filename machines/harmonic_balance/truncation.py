"""What the harmonics that were left out would change: an estimate for every solution, without solving again."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ..blocks import blocks
from .assembly import Assembly
from .balance import Balance
from .cycle import Harmonics
from .frequency_reach import reached
from .harmonics import is_odd, jumps, with_mean
from .tangent import Tangent

_SAMPLES = 256
"""Of a cycle; an estimate needs no more."""
_STRAIGHT = 1e-4
"""An estimate below which no tangent turns on the way."""


def more_harmonics(assembly: Assembly, harmonics: Harmonics) -> Harmonics:
    """The next harmonics that the joints raise: up to the fifth, or one more; odd ones alone where all laws are odd."""
    highest = 5 if max(harmonics) < 5 else max(harmonics) + 2
    step = 2 if odd(assembly) else 1
    return with_mean(tuple(sorted({*harmonics, *range(1, highest + 1, step)})), 0 in harmonics)


def odd(assembly: Assembly) -> bool:
    """Whether the joints keep a motion free of even harmonics."""
    return all(is_odd(assembly.standing[i]) for i in assembly.nonlinear)


def unsuited(assembly: Assembly) -> tuple[str, ...]:
    """A sentence for every joint whose higher harmonics cannot be solved for."""
    names = [assembly.machine.flexible[i].name for i in assembly.nonlinear]
    joints = [assembly.machine.joints()[i] for i in assembly.nonlinear]
    return tuple(
        f"{name}: its force jumps as the velocity changes sign, so only the first harmonic is solved for and its error "
        "is not known; give the friction a smoothing_velocity"
        for name, joint in zip(names, joints, strict=True)
        if jumps(joint)
    )


def truncation_error(
    assembly: Assembly, omega: Array, force: Array, z: ComplexArray, own: Harmonics, wider: Harmonics
) -> Array:
    """Estimated error of the first harmonic of solutions z (points, nh, nj) in m, relative to the largest joint.

    ``own`` are the harmonics of z. The estimate is the first harmonic of one Newton step in the ``wider`` ones, begun
    where those of them that are new rest: their residual, carried through the joints' tangents and the receptances
    back to the first. Next to a fold the tangent turns on the way: there a second step with the same tangents tells
    the ratio ρ of its part along the first to that, and the estimate is that of the geometric series, 1/(1 − ρ) times
    as large; infinite from ρ = 1 on, where the fold may have passed. nan where a receptance is not known at one of the
    harmonics, or a force jumps.
    """
    out = np.zeros(len(omega))
    if not z.shape[2] or not len(omega):
        return out
    known = reached(assembly.machine, omega, wider) & (len(unsuited(assembly)) == 0)
    out[~known] = np.nan
    rows = np.flatnonzero(known)
    here = [wider.index(h) for h in own]
    each = len(wider) ** 2 * assembly.entries + z.shape[2] * _SAMPLES
    for some in blocks(len(rows), each):
        now = rows[some]
        balance = Balance.of(assembly, omega[now], force[now], wider)
        start = np.zeros((len(now), len(wider), len(assembly.coordinates.rows)), dtype=complex)
        start[:, here] = assembly.coordinates.of_motions(z[now])
        forces = balance.forces(start, _SAMPLES)
        r = balance.residual(start, forces.force)
        # These were solved for; what sampling the cycle leaves of them is not counted.
        left = np.zeros_like(r)
        left[:, here] = r[:, here]
        tangent = Tangent(balance, forces)
        step = tangent.solve(left - r)
        size = np.maximum(np.max(np.abs(z[now, 0]), axis=1), 1e-300)
        error = np.max(np.abs(assembly.coordinates.motions(step[:, 0])), axis=1) / size
        far = np.flatnonzero((error > _STRAIGHT) & np.isfinite(error))
        if len(far):
            part, ahead = balance.at(far), start[far] + step[far]
            after = part.residual(ahead, part.forces(ahead, _SAMPLES, slopes=False).force)
            second = tangent.at(far).solve(left[far] - after)
            along = np.sum((second * step[far].conj()).real, axis=(1, 2))
            error[far] *= _series(along / np.sum(np.abs(step[far]) ** 2, axis=(1, 2)))
        out[now] = error
    return out


def _series(ratio: Array) -> Array:
    """1 + ρ + ρ² + …; infinite where it has no sum, or the next step cannot be told."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.where(ratio < 1, 1 / (1 - ratio), np.inf))
