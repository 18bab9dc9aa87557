"""Random machines in random cuts, what the verb says of them, and whether a simulation of its own denies it.

The sentences are read as a user reads them: what becomes of a vibration of some size at that speed and depth.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from cut_in_time import Body, Case, Course, cut_in_time

from jointlib.errors import CheckFailed, InputError
from jointlib.joint import Joint
from jointlib.law import JointLaw
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.cubic import Cubic
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import Connection, Lumped, Machine, lobes_at_amplitude
from machines.cutting.amplitude.frozen_modes import multipliers
from machines.cutting.forced.beside_cut import told_cuts
from machines.lobes import AmplitudeLimits, Cutting, amplitude_limits, unstable_depths

NEAR, ABOUT = 0.1, 0.25
"""Shares by which an amplitude, and one told as "about", may be missed; so near a threshold nothing is asked."""
SLOW = 3e-3
"""Change of an amplitude from window to window, as a logarithm, below which it stands."""
EARLY = 2
KICKS = 7
GONE = 1e-5
"""Of the largest kick: chatter that small is taken to have died."""
FORCED = 0.05
"""Share by which the vibration of the teeth may be missed."""
TOGETHER = 40


@dataclass(frozen=True)
class Cut:
    """A machine, a speed in rpm (that of the limits) and a depth in m, with what the verb says of it."""

    machine: Machine
    limits: AmplitudeLimits
    depth: float
    said: tuple[str, ...]

    @property
    def name(self) -> str:
        """For a reader of the count."""
        laws = "+".join(law.kind for joint in self.machine.joints() for law in joint.laws[2:])
        cutting = Cutting(**dict(self.machine.cutting or {}))
        cut = f"{cutting.process} {''.join(self.machine.tool_axes)}{' fed' if cutting.feed else ''}"
        return f"{cut} {laws} {self.limits.speed[0]:.0f} rpm {self.depth * 1e3:.3g} mm"


def bent(rng: np.random.Generator, stiffness: float, mass: float, size: float) -> JointLaw:
    """A law that changes a spring by some percent at a size in m: cubic of both signs, elastic slip, friction."""
    omega = np.sqrt(stiffness / mass)
    kind = rng.integers(4)
    if kind < 2:
        return Cubic((1 - 2 * float(kind)) * rng.uniform(0.02, 0.15) * stiffness / (0.75 * size**2))
    if kind == 2:
        stick = rng.uniform(0.05, 0.2) * stiffness
        return Jenkins(stick, stick * size * rng.uniform(0.1, 0.5))
    speed = omega * size
    return Coulomb(rng.uniform(0.005, 0.02) * stiffness * size, smoothing_velocity=rng.uniform(0.1, 0.5) * speed)


def machine(rng: np.random.Generator, milled: bool) -> Machine:
    """One or two moving masses along x, in half of the mills one along y, and a joint that is not linear."""
    size = 10 ** rng.uniform(-5.3, -4.2)
    mass, natural, ratio = 10 ** rng.uniform(-1, 1.5), rng.uniform(80, 900), rng.uniform(0.015, 0.05)
    k = mass * (2 * np.pi * natural) ** 2
    c = 2 * ratio * np.sqrt(k * mass)
    joint = Joint((Linear(k), Viscous(c), bent(rng, k, mass, size)))
    one = np.ones((1, 1))
    parts: list[Lumped] = [Lumped("slide", ("x",), mass * one)]
    tool = {"x": "slide.x"}
    if not milled and rng.random() < 0.4:
        small, stiff = 0.2 * mass, 2.0 * k
        spring = np.array([[1.0, -1.0], [-1.0, 1.0]])
        parts = [
            Lumped(
                "slide",
                ("x", "tip"),
                np.diag([mass, small]),
                2 * ratio * np.sqrt(stiff * small) * spring,
                stiff * spring,
            )
        ]
        tool = {"x": "slide.tip"}
    if milled and rng.random() < 0.5:
        other = k * rng.uniform(1.2, 2.5)
        parts.append(Lumped("cross", ("y",), mass * one, 2 * ratio * np.sqrt(other * mass) * one, other * one))
        tool["y"] = "cross.y"
    feed = {"feed": size * rng.uniform(0.5, 4.0)} if rng.random() < 0.6 else {}
    if milled:
        mode = str(rng.choice(["up", "down", "slot"]))
        arc = {} if mode == "slot" else {"immersion": float(rng.choice([0.1, 0.3, 0.5]))}
        cutting = {"process": "milling", "teeth": int(rng.integers(2, 5)), "tangential": 1.5e9, "normal": 0.5e9}
        cutting |= {"mode": mode, **arc, **feed}
    else:
        cutting = {"process": "turning", "specific": 1.5e9, **feed}
        if feed and rng.random() < 0.3:
            cutting["exponent"] = float(rng.uniform(0.7, 0.9))
    return Machine(
        tuple(parts),
        (Connection("guide", ("slide.x", "ground"), joint),),
        tool=tool,
        frequency=(0.4 * natural, 4.0 * natural),
        cutting=cutting,
    )


def random_cut(rng: np.random.Generator, milled: bool) -> Cut | None:
    """In the first few lobes: just below the safe depth, in the bistable zone, just or far above the onset."""
    made = machine(rng, milled)
    cutting = Cutting(**dict(made.cutting or {}))
    assert made.frequency is not None
    natural = made.frequency[0] / 0.4
    speed = 60 * natural / cutting.cuts_per_revolution / rng.uniform(0.8, 4.0)
    size = 2 * (cutting.feed or 5e-5)
    limits = amplitude_limits(made, [speed], np.geomspace(0.02, 1.0, 7 if milled else 10) * size)
    safe, onset = float(limits.safe_up_to(float(limits.known[0]))), float(limits.onset[0])
    if not np.isfinite(onset) or limits.known[0] <= 0:
        return None
    which = rng.integers(4)
    depth = (
        0.96 * safe,
        (safe + onset) / 2 if onset > 1.02 * safe else 0.9 * safe,
        1.03 * onset,
        onset * rng.uniform(1.1, 2.5),
    )[which]
    try:
        deep = max(6 * onset, 1.1 * depth)
        zones = list(unstable_depths(made, lobes_at_amplitude(made, [speed]), deep))
    except (CheckFailed, InputError):
        zones = []
    said, _ = told_cuts(made, limits, [depth], zones or None, multipliers(made, [speed], [depth]))
    return Cut(made, limits, depth, tuple(said))


def kicks(cut: Cut) -> np.ndarray:
    """Amplitudes in m that the simulation sets out from, the largest just below the end of what is told."""
    return np.geomspace(0.02, 0.99 / (1 + NEAR), KICKS) * float(cut.limits.known[0])


def courses(
    cuts: Sequence[Cut], windows: int = 10, periods: int = 20, fewest: int = 48
) -> list[tuple[np.ndarray, ...]]:
    """Chatter and forced motion, (window, kick), and which kicks escaped, of every cut; like ones stepped together."""
    waves = [
        float(c.limits.onset_frequency[0])
        * 60
        / c.limits.speed[0]
        / Cutting(**dict(c.machine.cutting or {})).cuts_per_revolution
        for c in cuts
    ]
    found: dict[int, tuple[np.ndarray, ...]] = {}
    order = np.argsort(waves, kind="stable").tolist()
    for chosen in (order[first : first + TOGETHER] for first in range(0, len(order), TOGETHER)):
        steps = max(fewest, int(30 * max(waves[i] for i in chosen)))
        cases = []
        for i in chosen:
            c = cuts[i]
            cutting = Cutting(**dict(c.machine.cutting or {}))
            cases.append(
                Case(
                    Body.of(c.machine),
                    cutting,
                    float(c.limits.speed[0]),
                    c.depth,
                    kicks(c).tolist(),
                    float(c.limits.onset_frequency[0]),
                )
            )
        course: Course = cut_in_time(cases, windows, periods, steps, reach=5e-3)
        for n, i in enumerate(chosen):
            found[i] = course.chatter[:, n], course.forced[:, n], course.escaped[n]
    return [found[i] for i in range(len(cuts))]


@dataclass(frozen=True)
class Fate:
    """Vibrations of ``low`` to ``high`` (m) die out, last, grow, or settle at an amplitude (m), exactly or about so."""

    low: float
    high: float
    end: str | float | tuple[float, float]
    """A range (m) holds what dies out from 0, what leaves up to inf."""
    near: float = NEAR
    knock: bool = False
    """Of knocks of these sizes, not of vibrations."""


_SIZE = r"(?:about )?([\d.e+-]+) µm"
_SAYS = {
    "settles from rest": rf"chatter starts by itself and settles at {_SIZE}",
    "grows from rest": r"chatter starts by itself and grows beyond",
    "dies": rf"vibrations of up to {_SIZE} at the tool die out",
    "grows": rf"vibrations of up to {_SIZE} at the tool grow",
    "dies below": rf"vibrations below {_SIZE} at the tool die out",
    "settle": rf"larger ones settle at {_SIZE}",
    "larger grow": r"larger ones grow beyond",
    "knock": rf"a knock beyond {_SIZE} makes it grow",
}


def _in_time(said: str, reach: float) -> list[Fate]:
    """What the verb's own simulation is told to have shown."""
    found = []
    last = rf"(?:last, at up to {_SIZE}|grow beyond)"
    stay = rf"stay at {_SIZE} or|grow beyond|settle at {_SIZE}|stay between {_SIZE} and {_SIZE}"
    ends = rf"(?:die out or {last}|die out|{stay})"
    for match in re.finditer(
        rf"of (up to )?([\d.e+-]+) µm(?: to ([\d.e+-]+) µm)?( and more)?(?: at the tool)? ({ends})", said
    ):
        first, low, high, more, end, most, least, settled, low_end, high_end = match.groups()
        sizes = [1e-6 * float(low), reach if more else 1e-6 * float(high or low)]
        if first:
            sizes = [0.0, sizes[0]]
        kind: str | float | tuple[float, float]
        if settled:
            kind = 1e-6 * float(settled)
        elif end.startswith("die out or"):
            kind = (0.0, 1e-6 * float(most) if most else np.inf)
        elif least:
            kind = (1e-6 * float(least), np.inf)
        elif low_end:
            kind = (1e-6 * float(low_end), 1e-6 * float(high_end))
        else:
            kind = "dies" if end == "die out" else "grows"
        found.append(Fate(sizes[0], sizes[1], kind, ABOUT, knock=True))
    return found


def fates(cut: Cut) -> list[Fate]:
    """What the sentences say of vibrations at the speed and depth of a cut."""
    reach, found = float(cut.limits.known[0]), list[Fate]()
    of_speed, of_cut = cut.said[:-1], cut.said[-1]
    for line in of_speed:
        if match := re.search(rf"every vibration of up to {_SIZE} at the tool dies out below ([\d.e+-]+) mm", line):
            size, below = (float(part) for part in match.groups())
            found += [Fate(0.0, size * 1e-6, "dies")] if cut.depth < 1e-3 * below else []
        if match := re.search(r"^(Above|Just above) ([\d.e+-]+) mm it chatters by itself", line):
            above, far = float(match.group(2)), 1.5 if match.group(1) == "Above" else 1.05
            grows = 1.01 * above < 1e3 * cut.depth < far * above
            found += [Fate(0.0, 0.03 * reach, "lasts")] if grows and not re.search("lens", of_cut) else []
    if match := re.search(r"the smallest vibrations (grow|die out)", of_cut):
        return [*found, Fate(0.0, 0.03 * reach, "dies" if match.group(1) == "die out" else "lasts")]
    if of_cut.startswith("In time"):
        return [*found, *_in_time(of_cut, reach)]
    edge = 0.0
    for match in re.finditer("|".join(f"(?:{says})" for says in _SAYS.values()), of_cut):
        kind = next(kind for kind, says in _SAYS.items() if re.fullmatch(says, match.group()))
        size = next((1e-6 * float(part) for part in match.groups() if part), 0.0)
        near = ABOUT if "about" in match.group() else NEAR
        if kind in ("settles from rest", "settle"):
            found.append(Fate(edge, np.inf, size, near))
        elif kind == "dies":
            found.append(Fate(0.0, size, "dies"))
        elif kind == "dies below":
            found.append(Fate(0.0, size, "dies", near))
            edge = size
        elif kind == "knock":
            found[-1] = replace(found[-1], high=size)
            edge = size
            if "again" not in of_cut[match.end() : match.end() + 7]:
                found.append(Fate(edge, np.inf, "grows"))
        else:
            found.append(Fate(edge, size or np.inf, "grows"))
    return found


def denied(cut: Cut, chatter: np.ndarray, forced: np.ndarray, escaped: np.ndarray) -> list[str]:
    """What of the fate that is told of each kick the simulation does not bear out; what is not told denies nothing."""
    told, reach = fates(cut), float(cut.limits.known[0])
    edges = {(edge, fate.near, fate.knock) for fate in told for edge in (fate.low, fate.high) if 0 < edge < np.inf}
    gone, said, kicked = GONE * reach, [], kicks(cut)
    for k in range(chatter.shape[1]):
        start, end = chatter[EARLY, k], chatter[-1, k]
        died = end < gone and not escaped[k]
        if escaped[k] or start > reach / (1 + NEAR):
            # It outgrew all bounds early: what it set out from counts.
            start = kicked[k] if escaped[k] else chatter[0, k]
        start = max(start, 1e-3 * gone)
        # Teeth that begin to shake the machine are a kick of their own.
        sized = {True: chatter[0, k] if forced[-1, 0] > 0 else kicked[k], False: start}
        if start > reach / (1 + NEAR) or any(abs(np.log(sized[knock] / t)) < near for t, near, knock in edges):
            continue
        before = max(float(chatter[-3, k]), 1e-300)  # a cut that escaped may not have been looked at then
        trend = -1.0 if died else float(np.log(end / before)) / 2 if end > 0 else -1.0
        for fate in told:
            if not fate.low < sized[fate.knock] < fate.high:
                continue
            if isinstance(fate.end, tuple):
                low, high = fate.end
                kept = end > low / (1 + fate.near) or escaped[k] or (low == 0 and died)
                fine = bool(kept) and (high == np.inf or (not escaped[k] and end < high * (1 + fate.near)))
            elif isinstance(fate.end, float):
                fine = not died and not escaped[k] and abs(np.log(end / fate.end)) < fate.near
                fine = fine or (abs(trend) > SLOW and (trend > 0) == (end < fate.end) and not escaped[k] and not died)
            elif fate.end == "dies":
                fine = died or (not escaped[k] and (end < 0.8 * start or trend < -SLOW / 3))
            elif fate.end == "lasts":
                fine = bool(escaped[k]) or (not died and end > 0.8 * start)
            else:
                fine = bool(escaped[k]) or (not died and (end > 0.9 * reach or trend > SLOW / 3))
            if not fine:
                end_told = f"settles at {fate.end * 1e6:.3g}" if isinstance(fate.end, float) else str(fate.end)
                left = " escaped" if escaped[k] else ""
                said.append(f"{end_told}: {start * 1e6:.3g} to {end * 1e6:.3g} µm, {trend:+.4f}{left}")
    if match := re.search(rf"beside the {_SIZE} that the teeth force", cut.said[-1]):
        size = 1e-6 * float(match.group(1))
        if chatter[-1, 0] < FORCED * size and not escaped[0] and abs(forced[-1, 0] / size - 1) > FORCED:
            said.append(f"teeth {size * 1e6:.3g}, not {forced[-1, 0] * 1e6:.3g} µm")
    return said


def judged(count: int, seed: int = 0, milled: tuple[bool, ...] = (False, True)) -> tuple[int, list[str]]:
    """Of so many random cuts, turned and milled in turn, how many are told anything, and a line for each denied."""
    rng, cuts = np.random.default_rng(seed), list[Cut]()
    while len(cuts) < count:
        cut = random_cut(rng, milled[len(cuts) % len(milled)])
        cuts += [] if cut is None else [cut]
    found = [denied(cut, *course) for cut, course in zip(cuts, courses(cuts), strict=True)]
    lines = [
        f"{cut.name}: {'; '.join(one)}; told: {' '.join(cut.said)}" for cut, one in zip(cuts, found, strict=True) if one
    ]
    return sum(bool(fates(cut)) for cut in cuts), lines
