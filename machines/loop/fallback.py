"""Where no name fits: a joint's stiffness and damping over amplitude, by monotone tables."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
import scipy

from jointlib.arrays import Array
from jointlib.laws.tabulated import Tabulated

from .explanations.hypothesis import Coordinate, Hypothesis
from .explanations.places import Place
from .fit import Fitted
from .search import Search

FAMILY = "tabulated"
_EDGES = np.geomspace(0.03, 0.8, 8)
"""Where segments begin, over the largest amplitude."""
_LEAST = 0.98
"""Share of the joint's own damping that the table may take away."""


def fitted(search: Search, place: Place, largest: float) -> Fitted | None:
    """The best table at a place whose joint moves by ``largest`` m; None where one response cannot tell it alone.

    Stiffness and damping each rise or fall with amplitude throughout, and the joint's own parameters stay as they are.
    The coordinates are a constant and increments of one sign, for which k(A) and c(A) are linear in them.
    """
    implied = search.implied(place)
    if implied is None:
        return None
    best: Fitted | None = None
    row, omega = place.rows[0], float(np.median(implied.omega))
    joint = search.machine.joints()[row]
    own = joint.first_harmonic(np.abs(implied.z), implied.omega).gain
    clear = implied.weight > 0
    damping = float(np.min(own.imag[clear] / implied.omega[clear])) if np.any(clear) else 0.0
    for signs in product((1.0, -1.0), repeat=2):
        hypothesis = _table(search, place, largest, signs, damping, omega)
        columns = []
        for e in np.eye(len(hypothesis.added)):
            values = np.array([c.reference for c in hypothesis.added]) * e
            assert hypothesis.laws is not None
            gain = hypothesis.laws(values)[0].first_harmonic(np.abs(implied.z), implied.omega).gain
            columns.append(gain * implied.z * implied.weight)
        A, b = np.array(columns).T, (implied.force - own * implied.z) * implied.weight
        low, high = (np.array([getattr(c, side) for c in hypothesis.added]) for side in ("low", "high"))
        u = scipy.optimize.lsq_linear(np.concatenate([A.real, A.imag]), np.concatenate([b.real, b.imag]), (low, high)).x
        found = search.fitting.fit(hypothesis, [hypothesis.bounded(u)], blunt=False)
        if best is None or found.loss < best.loss:
            best = found
    return best


def _table(
    search: Search, place: Place, largest: float, signs: Sequence[float], damping: float, omega: float
) -> Hypothesis:
    edges = largest * _EDGES
    width = (edges[0], *np.diff(edges), largest - edges[-1])
    n = len(edges)
    stiffer, thicker = signs

    def laws(values: Array) -> tuple[Tabulated]:
        k = values[0] + np.concatenate([[0.0], np.cumsum(values[1 : n + 1])])
        steps = values[n + 2 :]
        # Damping that falls is counted from its last value, so that no bound depends on another coordinate.
        rising = (
            np.concatenate([[0.0], np.cumsum(steps)]) if thicker > 0 else np.append(np.cumsum(steps[::-1])[::-1], 0)
        )
        c = values[n + 1] + rising
        return (Tabulated(tuple(width), tuple(k.tolist()), tuple(c.tolist())),)

    stiffness, loss = place.stiffness, place.stiffness / omega
    constant = Coordinate("tabulated.stiffness", stiffness, False, np.inf, low=-10.0, high=10.0)
    least = Coordinate("tabulated.damping", loss, False, np.inf, low=-_LEAST * max(damping, 0.0) / loss, high=10.0)
    added = (
        constant,
        *(
            Coordinate(f"tabulated.stiffness[{i + 1}]", stiffer * stiffness, False, np.inf, low=0.0, high=10.0)
            for i in range(n)
        ),
        least,
        *(Coordinate(f"tabulated.damping[{i + 1}]", loss, False, np.inf, low=0.0, high=10.0) for i in range(n)),
    )
    return Hypothesis(place, FAMILY, FAMILY, (), added, laws, ((0.0,) * len(added),), machine=search.machine)
