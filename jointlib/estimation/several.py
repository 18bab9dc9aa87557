"""Several shakers at once: what each of the forces causes, from the matrix of their spectra."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.estimation.blocks import motions_of
from jointlib.estimation.estimators import spread
from jointlib.estimation.noise import noise_of
from jointlib.estimation.shaker import Lines, Welch
from jointlib.measurement import Channel, Measurement, Record

_TOGETHER = 0.95
"""Coherence of a force with the others, in the median, above which they are one."""
_EXCITED = 1e-4
_TINY = 1e-300


@dataclass(frozen=True, eq=False)
class OfOneForce:
    """What one of several forces causes in one motion; the coherence is the partial one."""

    force: Channel
    motion: Channel
    lines: Lines
    share: float
    """Of the power of the motion, what this force causes."""


def several_lines(m: Measurement, records: Sequence[Record], notes: list[str]) -> list[OfOneForce]:
    """Responses to every force of random records: H = S_xf·S_ff⁻¹ (Bendat, Piersol, Random Data, 4th ed., ch. 7.4).

    With q forces and n averages the residual power is r = (S_xx − H·S_fx)·n/(n − q), the variance of H_j is
    r·(S_ff⁻¹)_jj/n, and the partial coherence, of motion and force j when what the others cause in both is taken away,
    is |H_j|²/(|H_j|² + (S_xx − H·S_fx)·(S_ff⁻¹)_jj).
    """
    forces, sensors, blocks = m.of("force"), motions_of(m), Welch.of(m, records, notes)
    q, n = len(forces), blocks.count
    if n <= q + 1:
        raise InputError(
            f"{m.source}: {n:.3g} independent averages for {q} forces, expected more than {q + 1}: a longer record, or "
            "shorter blocks"
        )
    S = np.moveaxis(np.array([[blocks.mean(b.name, a.name) for b in forces] for a in forces]), 2, 0)
    power = np.einsum("ljj->lj", S).real
    root = np.sqrt(np.maximum(power, _TINY))
    _tell(m, forces, S / root[:, :, None] / root[:, None, :], power, notes)
    inverse = np.linalg.pinv(S / root[:, :, None] / root[:, None, :], hermitian=True)
    inverse = inverse / root[:, :, None] / root[:, None, :]
    own = np.einsum("ljj->lj", inverse).real
    out = []
    for motion in sensors:
        cross = np.array([blocks.mean(f.name, motion.name) for f in forces]).T
        H = np.einsum("lj,ljk->lk", cross, inverse)
        whole = blocks.mean(motion.name, motion.name).real
        left = np.maximum(whole - np.einsum("lj,lj->l", H, cross.conj()).real, 0.0)
        gain = np.sum(np.abs(H) ** 2 * power, axis=1) / np.maximum(np.sum(power, axis=1), _TINY)
        noise = noise_of(left * n / (n - q), gain, n - q, blocks.alike, blocks.alike)
        for j, force in enumerate(forces):
            partial = np.abs(H[:, j]) ** 2 / np.maximum(np.abs(H[:, j]) ** 2 + left * own[:, j], _TINY)
            known = spread(noise.power * own[:, j] / n, noise.freedom)
            share = float(np.sum(np.abs(H[:, j]) ** 2 * power[:, j]) / max(float(np.sum(whole)), _TINY))
            out.append(OfOneForce(force, motion, Lines(blocks.lines, H[:, j], known, partial, n), min(share, 1.0)))
    return out


def _tell(m: Measurement, forces: Sequence[Channel], C: Array, power: Array, notes: list[str]) -> None:
    """How well the forces are told apart; refused where one of them follows the others. C is their correlation."""
    driven = np.all(power > _EXCITED * np.max(power, axis=0), axis=1)
    C = C[driven]
    if not len(C):
        names = " and ".join(c.name for c in forces)
        raise InputError(f"{m.source}: {names} have power on no common line, expected forces that act at once")
    follows = 1 - 1 / np.maximum(np.einsum("ljj->lj", np.linalg.pinv(C, hermitian=True)).real, 1.0)
    tied = np.median(follows, axis=0)
    values = np.linalg.eigvalsh(C)
    condition = float(np.median(values[:, -1] / np.maximum(values[:, 0], _TINY)))
    worst = int(np.argmax(tied))
    if tied[worst] > _TOGETHER or not condition < 1 / np.finfo(float).eps:
        others = " and ".join(c.name for k, c in enumerate(forces) if k != worst)
        raise InputError(
            f"{m.source}: force {forces[worst].name} follows {others} (coherence {tied[worst]:.2g} in the median), so "
            "what each causes cannot be told; expected forces of signals of their own, or one shaker at a time"
        )
    notes.append(
        f"{len(forces)} forces at once: coherence of {forces[worst].name} with the others {tied[worst]:.2g} in the "
        f"median, condition of their spectra {condition:.3g}; the coherences of the responses are partial ones."
    )
