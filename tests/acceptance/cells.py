"""Which data sets the suite consists of."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from itertools import product

import effects
import faults
import followed
import foreign
from effects import Maker

CATALOGUE: dict[str, Maker] = {
    "cubic": effects.cubic,
    "quadratic": effects.quadratic,
    "preload": effects.preload,
    "gap": effects.gap,
    "contact-loss": effects.contact_loss,
    "coulomb": effects.coulomb,
    "stribeck": effects.stribeck,
    "hysteresis": effects.hysteresis,
    "hysteresis-with-play": effects.hysteresis_with_play,
    "quadratic-damping": effects.quadratic_damping,
    "viscous-by-direction": effects.viscous_by_direction,
    "structural-damping": effects.structural_damping,
    "relaxation": effects.relaxation,
    "stiffness-drift": effects.stiffness_drift,
    "position-stiffness": effects.position_stiffness,
    "rocking-mode": faults.rocking_mode,
    "missing-mass": faults.missing_mass,
    "gain-driven": faults.gain("a1"),
    "gain-carried": faults.gain("a2", "a3"),
    "gain-force": faults.gain("P"),
    "delay-driven": faults.delay("a1"),
    "delay-carried": faults.delay("a2", "a3"),
    "delay-force": faults.delay("P"),
    "hum": faults.hum,
    "drift": faults.drift,
    "offset": faults.offset,
    "sensor-nonlinearity": faults.sensor_nonlinearity,
    "clipping": faults.clipping,
}
"""Effects of the catalogue; those after the rocking mode do not live in the joint equation."""
IN_JOINT = tuple(CATALOGUE)[:15]
HELD: dict[str, Maker] = {
    "suspended-driven": faults.suspension("runner_block"),
    "suspended-carried": faults.suspension("rail"),
}
OUTSIDE: dict[str, Maker] = {
    "ripple": foreign.ripple,
    "stiffness-by-speed": foreign.stiffness_by_speed,
    "damping-by-displacement": foreign.damping_by_displacement,
    "damping-in-time": foreign.damping_in_time,
    "slack-in-speed": foreign.slack_in_speed,
    "inner-resonance": foreign.inner_resonance,
    "dead-time": foreign.dead_time,
    "cross-talk": foreign.cross_talk,
}
LINEAR_THERE = ("relaxation",)
"""Through one narrow band it is a spring and a damper, which the joint has already."""
BY_AMPLITUDE = tuple(OUTSIDE)[:5]
"""Those that a narrow band shows; the others are linear, and there no more than a spring, a damper and gains."""
EMPTY: dict[str, Maker] = {"nothing": foreign.nothing, "distorted-exciter": foreign.distorted_exciter}
LOUD: dict[str, Maker] = {
    "noise-with-drive": foreign.noise_with_drive,
    "noise-by-channel": foreign.noise_by_channel,
    "coloured-noise": foreign.coloured_noise,
}
"""Nothing but noise that grows with the drive."""
EXACT: dict[str, Maker] = {
    "exact-cubic": effects.exact_cubic,
    "exact-coulomb": effects.exact_coulomb,
    "exact-quadratic": effects.exact_quadratic,
}
"""Laws of the catalogue themselves: their parameters have a true value for the intervals to cover."""
PAIRS = (
    "cubic+gain-carried",
    "coulomb+cubic",
    "missing-mass+structural-damping",
    "gap+delay-force",
    "quadratic+hum",
    "hysteresis+gain-force",
    "quadratic-damping+contact-loss",
    "rocking-mode+coulomb",
    "cubic+stiffness-drift",
)
TRIPLES = (
    "coulomb+cubic+gain-carried",
    "quadratic+quadratic-damping+delay-force",
    "cubic+missing-mass+stiffness-drift",
)
FOLLOWED: dict[str, Maker] = {
    "stiffness-by-temperature": followed.stiffness_by_temperature,
    "saturating-stiffness": followed.saturating_stiffness,
    "damping-by-temperature": followed.damping_by_temperature,
    "warming-stiffness": followed.warming_stiffness,
    "idle-temperature": followed.idle_temperature,
}
MAKERS = CATALOGUE | FOLLOWED | HELD | OUTSIDE | EMPTY | LOUD | EXACT
SIGNALS, DECIBELS, SEEDS = ("MS", "AM"), (60.0, 40.0, 30.0), range(5)


@dataclass(frozen=True)
class Cell:
    """One data set and what is done with it."""

    group: str
    """main | null | outside | removed | coverage | two | three | peaks | small | held | loud."""
    effect: str
    signal: str
    decibel: float
    seed: int
    size: float = 1.0

    @property
    def name(self) -> str:
        """Unique word."""
        return f"{self.group}/{self.effect}/{self.signal}/{self.decibel:g}/{self.seed}"

    @property
    def makers(self) -> tuple[Maker, ...]:
        """What is hidden in it."""
        return tuple(MAKERS[part] for part in self.effect.split("+"))

    def row(self) -> dict[str, object]:
        """For the result file."""
        return asdict(self)


def grid(
    group: str,
    names: Iterable[str],
    signals: Iterable[str],
    decibels: Iterable[float],
    seeds: Iterable[int],
    size: float = 1.0,
) -> list[Cell]:
    """Every combination; noise runs fastest, so that neighbours share their simulation."""
    return [Cell(group, e, s, d, n, size) for e, s, n, d in product(names, signals, seeds, decibels)]


GROUPS: dict[str, list[Cell]] = {
    "main": grid("main", CATALOGUE, ["MS"], DECIBELS, SEEDS)
    + grid("main", [e for e in CATALOGUE if e not in LINEAR_THERE], ["AM"], DECIBELS, SEEDS),
    "null": grid("null", ["nothing"], SIGNALS, DECIBELS, range(50))
    + grid("null", ["distorted-exciter"], SIGNALS, DECIBELS, SEEDS),
    "outside": grid("outside", OUTSIDE, ["MS"], DECIBELS, SEEDS)
    + grid("outside", BY_AMPLITUDE, ["AM"], [60.0, 40.0], SEEDS),
    "removed": grid("removed", CATALOGUE, ["MS"], [40.0], SEEDS),
    "coverage": grid("coverage", EXACT, ["MS"], DECIBELS, range(10)),
    "two": grid("two", PAIRS, ["MS"], DECIBELS[:2], SEEDS),
    "three": grid("three", TRIPLES, ["MS"], DECIBELS[:2], SEEDS),
    "peaks": grid("peaks", PAIRS, ["MS"], [40.0], SEEDS),
    "small": grid("small", CATALOGUE, ["MS"], [40.0], SEEDS, 0.2),
    "held": grid("held", HELD, SIGNALS, [60.0, 40.0], range(20)),
    "loud": grid("loud", LOUD, SIGNALS, [60.0, 40.0], range(9)),
    "quick": grid("main", CATALOGUE, ["MS"], [40.0], [0]),
}
"""``quick`` is a part of ``main``. Pairs are of even weight in the records in ``two``, of equal peaks in ``peaks``."""


def cells_of(words: Iterable[str]) -> list[Cell]:
    """Groups by name, or every cell whose name begins with the word."""
    everything = {c.name: c for name, group in GROUPS.items() if name != "quick" for c in group}
    out: dict[str, Cell] = {}
    for word in words:
        found = GROUPS.get(word) or [c for n, c in everything.items() if n.startswith(word)]
        if not found:
            raise SystemExit(f"no cells begin with {word!r}; groups are {', '.join(GROUPS)}")
        out |= {c.name: c for c in found}
    return list(out.values())
