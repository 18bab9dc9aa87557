"""Which effects a campaign could tell apart: distances of what they do to the joint force, in deviations of its noise.

No record is simulated for this: the motion is that of the joint as it is believed, every effect a column of its force
along it. It ranks campaigns; what the loop really answers is asked afterwards.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.effect import JointEffect, Path
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.planning.motion import OVERSAMPLING, joint_force
from jointlib.planning.simulated import Bench, Hidden

_SHAPES = 6
"""Of a rival, over its grid."""
CLEAR = 120.0
"""Squared distance: the loop keeps a rival within 3 √(2 d²), so up to 18, which noise moves; this has room to spare."""
_FORM = 0.03
"""Of the squared size of an effect: three times what the loop keeps a rival within."""
_STEP = 1e-4


@dataclass(frozen=True)
class Apart:
    """Squared distances for one period; a rival "" is nothing at all."""

    near: Mapping[tuple[str, str], float]

    def margin(self, hidden: str, rival: str, periods: int) -> float:
        """Over what the loop asks for, for as many periods: above 1 the two stay apart."""
        d, size = self.near.get((hidden, rival), np.inf), self.near.get((hidden, ""), 0.0)
        return periods * d / max(CLEAR, _FORM * periods * size if rival else 0.0)


def apart(bench: Bench, truths: Sequence[Hidden], rivals: Mapping[str, Sequence[JointEffect]]) -> Apart:
    """How far every effect in question lies from every rival fitted in its place, and from nothing."""
    known = _basis(_tangents(bench))
    signals = [(t.name, _beside(known, _force(bench, t.joint) - _force(bench, bench.joint))) for t in truths]
    near: dict[tuple[str, str], float] = {}

    def keep(pair: tuple[str, str], found: float) -> None:
        near[pair] = min(near.get(pair, np.inf), found)

    for name, s in signals:
        keep((name, ""), float(np.sum(s * s)))
    for family, effects in rivals.items():
        for columns in (c for e in effects for c in _columns(bench, e)):
            block = _basis(_beside(known, columns))
            for name, s in signals:
                if name != family:
                    keep((name, family), float(np.sum(_beside(block, s) ** 2)))
    return Apart(near)


def _force(bench: Bench, joint: Joint) -> Array:
    m = bench.believed
    return _whitened(bench, joint_force(joint, m.z, m.v, m.step))


def _columns(bench: Bench, effect: JointEffect) -> list[Array]:
    """Whitened columns of an effect at some of its shapes."""
    shapes = effect.shapes(bench.scale, bench.joint)
    picked = [shapes[i] for i in np.unique(np.linspace(0, len(shapes) - 1, _SHAPES).astype(int))] if shapes else []
    m, out = bench.believed, []
    for shape in picked:
        count = len(effect.columns(Path(m.z[:4, 0], m.v[:4, 0], m.step), shape, bench.joint))
        rows = []
        for unit in np.eye(count):
            try:
                made = effect.apply(unit, shape, bench.joint)
            except InputError:
                made = None
            if made is not None and made.laws[: len(bench.joint.laws)] == bench.joint.laws:
                law = Joint(made.laws[len(bench.joint.laws) :])
                rows.append(_whitened(bench, joint_force(law, m.z, m.v, m.step)))
            else:
                F = [
                    effect.columns(Path(m.z[:, r], m.v[:, r], m.step), shape, bench.joint) for r in range(m.z.shape[1])
                ]
                rows.append(_whitened(bench, np.stack([f[int(np.argmax(unit))] for f in F], axis=1)))
        out.append(np.concatenate(rows))
    return out


def _tangents(bench: Bench) -> Array:
    """What the joint's own free parameters can move, and spring and damper, whitened."""
    m, joint = bench.believed, bench.joint
    rows = [_whitened(bench, m.z), _whitened(bench, m.v)]
    here = _force(bench, joint)
    for name, value in joint.parameters.items():
        if name in joint.fixed or value == 0:
            continue
        try:
            other = joint.with_parameters({name: value * (1 + _STEP)})
        except InputError:
            continue
        rows.append((_force(bench, other) - here) / _STEP)
    return np.concatenate([r for r in rows if np.any(r)])


def _whitened(bench: Bench, force: Array) -> Array:
    """Spectra of the records to fit over the deviation of their noise, for one period, as one row of reals."""
    s, c = bench.setup, bench.campaign
    fit = len(c.levels)
    F: ComplexArray = np.fft.rfft(force[:, :fit], axis=0) / OVERSAMPLING
    f = np.arange(len(F)) * c.spacing
    use = (f >= 0.8 * c.band[0]) & (f <= min(3 * c.band[1], 0.8 * c.sample_rate / 2))
    w = 2 * np.pi * f[use]
    D = s.stiffness + 1j * w * s.damping
    sigma = {n: bench.sigma[n] ** 2 for n in s.channels}
    both = s.carried[0] ** 2 * sigma["a2"] + s.carried[1] ** 2 * sigma.get("a3", 0.0)
    behind = both / s.behind**2
    power = np.abs(s.behind + D / w**2) ** 2 * behind + np.abs(D / w**2) ** 2 * sigma["a1"]
    row = F[use] / np.sqrt(c.period * power)[:, None]
    return np.ascontiguousarray(row.T).view(float).reshape(1, -1)


def _basis(rows: Array) -> Array:
    """Orthonormal rows that span rows."""
    size = np.linalg.norm(rows, axis=1, keepdims=True)
    rows = rows[size[:, 0] > 0] / size[size[:, 0] > 0]
    if not len(rows):
        return rows
    _, s, V = np.linalg.svd(rows, full_matrices=False)
    return np.asarray(V[s > 1e-7 * s[0]])


def _beside(basis: Array, rows: Array) -> Array:
    """Rows less what a basis takes up of them."""
    return np.asarray(rows - (rows @ basis.T) @ basis)
