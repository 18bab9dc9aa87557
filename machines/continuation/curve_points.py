"""Points of solution curves with their tangents, in a metric in which a motion and its parameter weigh alike."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ..blocks import blocks
from ..indices import Index, Mask


@dataclass(frozen=True, eq=False)
class Points:
    """Points of curves with their tangents; the plane t·(u − u_i) = δ meets the curve once beyond each.

    u = [Re Z/scale, Im Z/scale, p/pace]; p is the frequency in rad/s or the force in N that varies.
    """

    z: ComplexArray
    """Motions in m, (n, nh, nj)."""
    p: Array
    other: Array
    """The one of frequency and force that does not vary, (n,)."""
    tangent: Array
    """Unit tangents in u, (n, 2m + 1)."""
    scale: Array
    """m, (n,)."""
    pace: Array
    """Of p, (n,)."""

    def at(self, rows: Index | Mask | slice) -> Points:
        return Points(
            self.z[rows], self.p[rows], self.other[rows], self.tangent[rows], self.scale[rows], self.pace[rows]
        )

    def blocks(self) -> Iterator[slice]:
        """Slices of as many points as memory should hold the equations of at once."""
        return blocks(len(self.p), self.tangent.shape[1] ** 2)

    @staticmethod
    def joined(parts: Sequence[Points]) -> Points:
        return Points(*(np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Points)))

    def put(self, rows: Index, by: Points) -> Points:
        """These points with others in some rows."""
        source = np.arange(len(self.p))
        source[rows] = len(self.p) + np.arange(len(rows))
        return Points.joined([self, by]).at(source)

    def moved(self, change: Array) -> tuple[ComplexArray, Array]:
        """Motions and p at u + change."""
        half = (change.shape[1] - 1) // 2
        dz = (change[:, :half] + 1j * change[:, half:-1]) * self.scale[:, None]
        return self.z + dz.reshape(self.z.shape), self.p + change[:, -1] * self.pace

    def change(self, z: ComplexArray, p: Array) -> Array:
        """u at other motions and p, less u here."""
        dz = ((z - self.z) / self.scale[:, None, None]).reshape(len(z), -1)
        return np.concatenate([dz.real, dz.imag, ((p - self.p) / self.pace)[:, None]], axis=1)
