"""A receptance that is asked again and again: from a table, held against the receptance itself."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import FrequencyMismatch

from ..indices import Mask
from .tool_point import Receptance

_POINTS = 10
_ANGLE = np.pi * (np.arange(_POINTS) + 0.5) / _POINTS
_LOOKED = np.array([-1.0, 0.0, 1.0])
"""Places in a piece, −1 to 1, at which polynomials through Chebyshev's points of an even number err most."""
_SAME = 1e-10
"""Of the receptance at the place looked at."""
_HALVINGS = 8


class Tabulated:
    """G(f) in m/N, piece by piece a polynomial in frequency once so many lines were asked for as the table takes.

    Coupling a machine costs a call as much as tens of lines do, and lobe solvers ask for a few lines at a time. Every
    piece is held against the receptance and halved until they agree to 10⁻¹⁰; where they never do, or beyond the
    pieces, and before the table pays, the receptance itself answers.

    Parameters
    ----------
    receptance
        G(frequency in Hz).
    knots
        Hz, ascending: where the pieces end to begin with, and every frequency at which G is not smooth.
    """

    def __init__(self, receptance: Receptance, knots: Array) -> None:
        self._receptance, self._knots = receptance, knots
        self._left = (len(knots) - 1) * (_POINTS + len(_LOOKED))
        self._edges: Array = np.zeros(0)
        self._terms: ComplexArray = np.zeros((0, _POINTS, 0, 0), dtype=complex)
        self._good: Mask = np.zeros(0, dtype=bool)

    def __call__(self, frequency: Array) -> ComplexArray:
        if not len(self._edges):
            self._left -= len(frequency)
            if self._left > 0 or not self._tabulate():
                return self._receptance(frequency)
        piece = np.searchsorted(self._edges, frequency, side="right") - 1
        piece = np.where(frequency == self._edges[-1], len(self._good) - 1, piece)
        inside = (piece >= 0) & (piece < len(self._good))
        piece = np.where(inside, piece, 0)
        low, high = self._edges[piece], self._edges[piece + 1]
        place = np.clip((2 * frequency - low - high) / (high - low), -1.0, 1.0)
        G = np.einsum("fk,fkab->fab", _terms_at(place), self._terms[piece])
        asked = ~(inside & self._good[piece])
        if asked.any():
            G[asked] = self._receptance(frequency[asked])
        return np.asarray(G)

    def _tabulate(self) -> bool:
        """Make the table; False, for good, where the receptance is not known between the knots."""
        low, high, parts = self._knots[:-1], self._knots[1:], []
        places = np.concatenate([np.cos(_ANGLE), _LOOKED])
        share = np.cos(np.arange(_POINTS)[:, None] * _ANGLE) * 2 / _POINTS
        share[0] /= 2
        try:
            for halved in range(_HALVINGS + 1):
                lines = (low + high)[:, None] / 2 + (high - low)[:, None] / 2 * places
                G = self._receptance(np.clip(lines, low[:, None], high[:, None]).ravel())
                G = G.reshape(*lines.shape, *G.shape[1:])
                terms = np.einsum("kj,pjab->pkab", share, G[:, :_POINTS])
                error = np.einsum("lk,pkab->plab", _terms_at(_LOOKED), terms) - G[:, _POINTS:]
                size = np.linalg.norm(G[:, _POINTS:], axis=(2, 3))
                good = np.all(np.linalg.norm(error, axis=(2, 3)) <= _SAME * size, axis=1)
                kept = good if halved < _HALVINGS else np.ones(len(good), dtype=bool)
                parts.append((low[kept], terms[kept], good[kept]))
                low, middle, high = low[~kept], (low + high)[~kept] / 2, high[~kept]
                low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
                if not len(low):
                    break
        except FrequencyMismatch:
            self._left = np.iinfo(np.int64).max
            return False
        starts, terms, good = (np.concatenate(part) for part in zip(*parts, strict=True))
        order = np.argsort(starts)
        self._edges = np.append(starts[order], self._knots[-1])
        self._terms, self._good = terms[order], good[order]
        return True


def _terms_at(place: Array) -> Array:
    """Chebyshev's polynomials at places from −1 to 1, (places, terms)."""
    return np.asarray(np.cos(np.arange(_POINTS) * np.arccos(place)[:, None]))
