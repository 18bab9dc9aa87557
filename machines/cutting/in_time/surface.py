"""What the edges leave behind them, and what the next ones meet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array

from ...indices import Mask
from ..process.stretch import Stretch


@dataclass(frozen=True, eq=False)
class Surface:
    """What the edges left in one stretch during the last period, along the chip thickness, in m.

    With a feed that is the deepest of all earlier passes, so an edge that leaves the cut meets older surface
    (multiple regeneration). Shapes (nodes or middles, edges, batch).
    """

    height: Array
    between: Array

    @classmethod
    def ploughed(cls, stretch: Stretch, x: Array, v: Array) -> Surface:
        """Surface of edges that cut all the time, by the motion and velocity of the tool at the nodes, (nodes, axes,
        batch).
        """
        height, rate = stretch.radial @ x, stretch.radial @ v + stretch.radial_rate @ x
        return cls(height, (height[:-1] + height[1:]) / 2 + stretch.step / 8 * (rate[:-1] - rate[1:]))

    def fed(self, stretch: Stretch, feed: float) -> Surface:
        """As the next edges meet it, which stand one feed (m) further on."""
        out = stretch.beyond[:, None]
        return Surface(
            self.height - feed * stretch.feed[:, :, None] - out,
            self.between - feed * stretch.feed_between[:, :, None] - out,
        )

    def __add__(self, other: Surface) -> Surface:
        return Surface(self.height + other.height, self.between + other.between)


class Ground:
    """The surfaces of a period, stretch by stretch; it changes as the edges pass.

    All heights lie in one array, and all middles in another, so that an edge may meet what another one left in another
    stretch: the parabola through two nodes and the middle between them.
    """

    def __init__(self, stretches: tuple[Stretch, ...], surfaces: list[Surface]) -> None:
        self._stretches = stretches
        batch = surfaces[0].height.shape[2]
        self._height = np.concatenate([s.height.reshape(-1, batch) for s in surfaces])
        self._between = np.concatenate([s.between.reshape(-1, batch) for s in surfaces])
        self.surfaces = list[Surface]()
        node = middle = 0
        for s in surfaces:
            nodes, middles = s.height.shape[0] * s.height.shape[1], s.between.shape[0] * s.between.shape[1]
            self.surfaces.append(
                Surface(
                    self._height[node : node + nodes].reshape(s.height.shape),
                    self._between[middle : middle + middles].reshape(s.between.shape),
                )
            )
            node, middle = node + nodes, middle + middles

    def met(self, index: int, feed: float) -> Surface:
        """What the edges of a stretch meet that stand one feed (m) further on than those that left it."""
        stretch = self._stretches[index]
        if stretch.origin is None:
            return self.surfaces[index].fed(stretch, feed)
        o = stretch.origin
        s = o.share[..., None]
        left, right, middle = self._height[o.left], self._height[o.right], self._between[o.middle]
        every = (1 - s) * (1 - 2 * s) * left + 4 * s * (1 - s) * middle + s * (2 * s - 1) * right
        return Surface(every[::2], every[1::2]).fed(stretch, feed)

    def leave(self, index: int, surface: Surface) -> None:
        """What the edges of a stretch have left."""
        self.surfaces[index].height[...] = surface.height
        self.surfaces[index].between[...] = surface.between

    def flatten(self, which: Mask) -> None:
        """No waves in some motions, (batch,)."""
        self._height[:, which] = 0.0
        self._between[:, which] = 0.0
