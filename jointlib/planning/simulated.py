"""What the sensors would show of a campaign, as records in a folder with their measurement file."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from jointlib.arrays import Array
from jointlib.effect import Scale
from jointlib.errors import InputError
from jointlib.io.atomic import write_npz
from jointlib.io.measurement_file import read_measurement
from jointlib.joint import Joint
from jointlib.measurement import Measurement
from jointlib.planning.campaign import Campaign
from jointlib.planning.measurement_text import QUIET, record_names, simulated_text
from jointlib.planning.motion import OVERSAMPLING, Moved, sampled, steady_motion
from jointlib.planning.multisine import phases, unit_force
from jointlib.planning.setup import Setup
from jointlib.planning.spoiled import Spoiled

_NEAR = 0.02
_CLEAR = 3.0


@dataclass(frozen=True)
class Hidden:
    """A truth to simulate: the joint as it then is, and what is wrong with sensors or masses."""

    name: str
    """The effect in question; empty where nothing is hidden."""
    joint: Joint
    size: float
    """Rms of what is hidden beside stiffness and damping, over that of the joint force (or channel), top level."""
    spoiled: Spoiled | None = None


@dataclass(frozen=True)
class Bench:
    """A campaign on a rig whose joint is the one that is believed in."""

    setup: Setup
    joint: Joint
    campaign: Campaign
    seed: int

    @property
    def step(self) -> float:
        """s between the points of a motion."""
        return 1 / (OVERSAMPLING * self.campaign.sample_rate)

    @cached_property
    def unit(self) -> Array:
        """Drives of rms 1 at level 1, one column a record, on the fine points of a period."""
        c = self.campaign
        signals = [unit_force(phases(c, i, self.seed), c.period, OVERSAMPLING) for i in range(len(c.drives))]
        return np.stack([x * level for x, level in zip(signals, c.drives, strict=True)], axis=1)

    @cached_property
    def drive(self) -> float:
        """Rms of P in N at level 1: what moves the joint as far as it may be moved."""
        linear = float(np.std(self.unit)) * self.setup.stiffness
        rms, low = linear * self.campaign.reach * 0.1, 0.0
        high = np.inf
        for _ in range(40):
            moved = steady_motion(self.setup, self.joint, rms * self.unit, self.step)
            z = np.inf if moved is None else float(np.abs(moved.z).max())
            if abs(z / self.campaign.reach - 1) < _NEAR:
                return rms
            if z < self.campaign.reach:
                low = rms
                rms = min(rms * min(self.campaign.reach / max(z, 1e-300), 30.0), 0.5 * (rms + high))
            else:
                high = rms
                rms = max(rms * max(self.campaign.reach / z, 0.03), 0.5 * (rms + low))
        raise InputError(
            f"joint {self.joint.name!r}: no drive was found that moves it by {1e6 * self.campaign.reach:.3g} µm in a "
            "steady motion, expected a smaller --amplitude"
        )

    @cached_property
    def believed(self) -> Moved:
        """The motion with nothing hidden."""
        moved = steady_motion(self.setup, self.joint, self.drive * self.unit, self.step)
        if moved is None:
            raise InputError(f"joint {self.joint.name!r}: no steady motion, expected a smaller --amplitude")
        return moved

    @property
    def top(self) -> Moved:
        """The first record of the highest level."""
        at = self.campaign.levels.index(max(self.campaign.levels))
        m = self.believed
        z, v, force, drive = (x[:, at : at + 1] for x in (m.z, m.v, m.force, m.drive))
        return Moved(z, v, force, drive, m.step)

    @property
    def scale(self) -> Scale:
        """Size of the motion, as the loop takes it."""
        m = self.believed
        return Scale(float(np.abs(m.z).max()), float(np.std(m.v)), self.setup.stiffness)

    @cached_property
    def sigma(self) -> dict[str, float]:
        """Standard deviation of the noise of each channel, as given or as a share of the highest level."""
        shown = self.shown(self.top)
        return {n: self.setup.noise.get(n, self.setup.quieter * float(np.std(x))) for n, x in shown.items()}

    @property
    def clear(self) -> bool:
        """Whether every channel stands out of its noise at the lowest level too; else the loop refuses the record."""
        at = self.campaign.levels.index(min(self.campaign.levels))
        shown = self.shown(self.believed)
        return all(float(np.std(x[:, at])) >= _CLEAR * self.sigma[n] for n, x in shown.items())

    def moved(self, hidden: Hidden) -> Moved | None:
        """The motion with something hidden under the same drive."""
        return steady_motion(self.true_rig(hidden), hidden.joint, self.drive * self.unit, self.step, self.believed.z)

    def true_rig(self, hidden: Hidden) -> Setup:
        """The rig as it is, not as it was declared."""
        return self.setup if hidden.spoiled is None else hidden.spoiled.rig(self.setup)

    def shown(self, moved: Moved, rig: Setup | None = None) -> dict[str, Array]:
        """Channels without noise at the sample rate, (period, records)."""
        s, n = rig or self.setup, self.campaign.period
        f, P = sampled(moved.force, n), sampled(moved.drive, n)
        known = {"a1": (P - f) / s.m1, "a2": f / s.behind, "a3": f / s.behind, "P": P}
        return {name: known[name] for name in s.channels}

    def records(self, hidden: Hidden, moved: Moved, folder: Path, seed: tuple[int, ...]) -> Measurement:
        """The records with noise, run-in left out, in a folder; the quiet one last."""
        rng, c = np.random.default_rng([self.seed, *seed]), self.campaign
        channels = self.shown(moved, self.true_rig(hidden))
        names = record_names(c)
        for i, name in enumerate((*names, QUIET)):
            n = c.periods * c.period
            clean = {x: np.tile(y[:, i], c.periods) if name != QUIET else np.zeros(n) for x, y in channels.items()}
            seen = clean if hidden.spoiled is None else hidden.spoiled.shown(clean, self.setup, c.sample_rate)
            arrays = {x: y + self.sigma[x] * rng.standard_normal(n) for x, y in seen.items()}
            write_npz(folder / f"{name}.npz", arrays)
        path = folder / "rig.measurement.toml"
        path.write_text(simulated_text(self.setup, c), encoding="utf-8")
        return read_measurement(path)
