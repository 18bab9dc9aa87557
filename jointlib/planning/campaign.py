"""A campaign: the records of one test, how they are driven and how long they take."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from jointlib.planning.setup import Setup

LINES_IN_BAND = 40
"""The fewest that tell a curve over frequency from noise."""
_LEVELS = (0.3, 0.6, 1.0, 1.0), (0.1, 0.3, 0.6, 1.0, 1.0)
"""Three at least, the top one twice: what only the highest shows must help a record that was left out."""
_SEALED = 0.8
"""Of the top level."""


@dataclass(frozen=True)
class Campaign:
    """Levels of a multisine on a rig; every record has phases of its own, the top level stands there twice."""

    band: tuple[float, float]
    """Hz, excited evenly."""
    period: int
    """Samples."""
    sample_rate: float
    """Hz."""
    periods: int
    """Whole periods that are used of each record."""
    settle: int
    """Periods before these, while the motion settles."""
    levels: tuple[float, ...]
    """Of the largest drive, lowest first, of the records to fit."""
    reach: float
    """m; peak abs(z) of the rig at level 1."""

    @property
    def drives(self) -> tuple[float, ...]:
        """Level of every driven record, the sealed one last."""
        return (*self.levels, _SEALED * max(self.levels))

    @property
    def seconds_a_record(self) -> float:
        """s of one record."""
        return (self.settle + self.periods) * self.period / self.sample_rate

    @property
    def cost(self) -> float:
        """s of all records, the quiet one and the sealed one among them."""
        return self.seconds_a_record * (len(self.levels) + 2)

    @property
    def spacing(self) -> float:
        """Hz between lines."""
        return self.sample_rate / self.period

    @property
    def words(self) -> str:
        """One line."""
        levels = ", ".join(f"{x:g}" for x in dict.fromkeys(self.levels))
        return (
            f"{self.band[0]:.4g} to {self.band[1]:.4g} Hz every {self.spacing:.3g} Hz, levels {levels} of the top one, "
            f"{len(self.levels)} records of {self.periods} periods, {self.cost:.3g} s in all"
        )


def candidates(setup: Setup) -> Iterator[Campaign]:
    """Campaigns in the order of what they cost: levels, band, then length."""
    f0, rate = setup.resonance, setup.sample_rate
    top = 0.8 * rate / 2 / 3
    spacing = max(setup.half_width, f0 / 400)
    bands = ((0.4 * f0, min(1.7 * f0, top)), (0.15 * f0, min(1.9 * f0, top)))
    found = []
    for per_width in (1, 2):
        for low, high in bands:
            grid = min(spacing / per_width, (high - low) / LINES_IN_BAND)
            period = _even_length(rate / grid)
            settle = settling(setup, period)
            for levels in _LEVELS:
                for periods in (4, 8, 16, 32):
                    edges = round(low / (rate / period)) * rate / period, round(high / (rate / period)) * rate / period
                    found.append(Campaign(edges, period, rate, periods, settle, levels, setup.reach))
    yield from sorted(found, key=lambda c: (c.cost, -c.periods))


def settling(setup: Setup, period: int) -> int:
    """Periods until the start has decayed to a thousandth, two at least."""
    decay = np.log(1e3) / (2 * np.pi * setup.half_width)
    return max(2, int(np.ceil(decay * setup.sample_rate / period)))


def longer(campaign: Campaign, times: int) -> Campaign:
    """The same with more periods of each record."""
    return replace(campaign, periods=times * campaign.periods)


def _even_length(samples: float) -> int:
    """The next length of which transforms are quick, 256 at least."""
    sizes = [a << n for n in range(5, 22) for a in (4, 5, 6)]
    return min(s for s in sizes if s >= max(samples, 256.0))


def on_heavier(campaign: Campaign, setup: Setup, heavier: Setup) -> Campaign:
    """The band moved along with the resonance, on the same lines."""
    share = heavier.resonance / setup.resonance
    low, high = (round(f * share / campaign.spacing) * campaign.spacing for f in campaign.band)
    return replace(campaign, band=(low, high))
