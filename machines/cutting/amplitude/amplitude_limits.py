"""Depth and amplitude together: where a vibration dies out, where it is a threshold, and where chatter settles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np
import scipy

from jointlib.arrays import Array, ArrayLike
from jointlib.errors import CheckFailed, InputError
from jointlib.shown.progress import each

from ...deadline import OutOfTime, Turns
from ...harmonic_balance.assembly import is_linear
from ...indices import Mask
from ...model.machine import Machine
from ..process.chart import Integers, StabilityLobes
from ..process.cutting import Cutting
from .fed_chip import contact_amplitude, with_chip
from .frozen_lobes import frozen_lobes
from .sampled_amplitudes import amplitude_range, between_lobes, far_apart_first, near_lowest

_SETTLED = 1e-6
_ROUNDS, _HALVINGS = 3, 6
_CHOSEN = 8
_FLAT = 1e-9
FEWEST = 3
"""Amplitudes from which on something is told where time is up."""
_BELOW = 1e-3


@dataclass(frozen=True)
class Cycle:
    """A vibration that neither grows nor dies, at one speed and depth."""

    amplitude: float
    """Of the tool point in m, the larger of x and y."""
    frequency: float
    """Hz."""
    stable: bool
    """Whether chatter settles on it; otherwise it is a threshold: smaller vibrations die out, larger ones grow."""


@dataclass(frozen=True)
class Turn:
    """An amplitude (m) at which b_lim(A) turns, and the depth (m) there: a lowest one, or a highest."""

    amplitude: float
    depth: float
    lowest: bool


@dataclass(frozen=True, eq=False)
class AmplitudeLimits:
    """b_lim(A) at given spindle speeds: the depth at which a vibration of amplitude A at the tool just persists.

    Below b_lim(A) a vibration of that size dies out, above it grows. So where b_lim rises with A a finite chatter is
    stable, and where it falls the vibration is a threshold. First axis of ``depth``, ``chatter_frequency`` and
    ``lobe``: amplitude; second: speed.

    Parameters
    ----------
    speed
        rpm, (n,).
    amplitude
        m, ascending and above 0, (m,).
    onset
        b_lim(0) in m from the joints' tangent at rest, (n,); inf where nothing starts by itself, as with a joint that
        sticks.
    depth
        m; inf where a vibration of that size dies out at any depth, nan where a joint is past its identified range.
    at
        b_lim and the chatter frequency at any amplitude in m, shapes (n,).
    touching
        Finds `contact`.
    whole
        False where time was up before every amplitude was computed and the lowest depths were looked at closer.
    """

    speed: Array
    amplitude: Array
    onset: Array
    onset_frequency: Array
    depth: Array
    chatter_frequency: Array
    lobe: Integers
    method: str
    notes: tuple[str, ...]
    warnings: tuple[str, ...]
    at: Callable[[float], tuple[Array, Array]]
    touching: Callable[[], Array]
    whole: bool = True

    @cached_property
    def contact(self) -> Array:
        """Amplitude in m, (n,), up to which edges hardly leave a milling cut; inf without a feed, and in turning."""
        return self.touching()

    @property
    def known(self) -> Array:
        """Amplitude in m, (n,), up to which the limits hold: joints in their range, edges in the cut."""
        return np.asarray(np.minimum(self.largest, self.contact))

    def safe_up_to(self, amplitude: float, index: int = 0) -> float:
        """The depth in m at one speed below which every vibration of up to an amplitude in m dies out."""
        inside = self.depth[self.amplitude <= amplitude, index]
        return float(np.fmin(self.onset[index], np.fmin.reduce(inside, initial=np.inf)))

    @property
    def safe(self) -> Array:
        """The depth in m to cut under, (n,): the lowest of b_lim(A) over the amplitudes in range."""
        return np.asarray(np.fmin(self.onset, np.fmin.reduce(self.depth, axis=0)))

    @property
    def safe_amplitude(self) -> Array:
        """Amplitude in m at which the safe depth is met, (n,); 0 where it is the onset."""
        lowest = np.argmin(np.where(np.isnan(self.depth), np.inf, self.depth), axis=0)
        return np.where(self.safe < self.onset, self.amplitude[lowest], 0.0)

    @property
    def bistable(self) -> Array:
        """[lower, upper] depth in m, (n, 2), between which a cut that is stable at rest can be knocked into chatter.

        Both are the onset where there is no such zone. The upper one is inf where nothing starts by itself.
        """
        return np.stack([self.safe, self.onset], axis=1)

    @property
    def largest(self) -> Array:
        """Largest amplitude in m, (n,), up to which the joints are in their identified range."""
        past = np.isnan(self.depth)
        count = np.where(past.any(axis=0), np.argmax(past, axis=0), len(self.amplitude))
        return np.where(count > 0, self.amplitude[np.maximum(count - 1, 0)], 0.0)

    def turns(self, index: int = 0) -> tuple[Turn, ...]:
        """Where b_lim(A) turns inside the range at one speed, refined between the amplitudes."""
        A, b = self._curve(index)
        found = []
        for i in range(1, len(A) - 1):
            rise, fall = b[i] - b[i - 1], b[i + 1] - b[i]
            if rise * fall < 0 and min(abs(rise), abs(fall)) > _FLAT * b[i]:
                sign = 1.0 if rise < 0 else -1.0
                best = scipy.optimize.minimize_scalar(
                    lambda x, sign=sign: float(np.nan_to_num(sign * self.at(np.exp(x))[0][index], nan=np.inf)),
                    bounds=(np.log(A[i - 1]), np.log(A[i + 1])),
                    method="bounded",
                    options={"xatol": 1e-3},
                )
                found.append(Turn(float(np.exp(best.x)), sign * float(best.fun), bool(sign > 0)))
        return tuple(found)

    def cycles(self, depth: float, index: int = 0) -> tuple[Cycle, ...]:
        """Vibrations that persist at a depth in m at one speed, by ascending amplitude: the inverse map A(b).

        Growth at amplitude A is decided by the side of b_lim(A) that the depth lies on, so a cycle is stable where
        b_lim(A) passes the depth upwards.
        """
        A, b = self._curve(index)
        found = []
        over = b < depth
        if len(A) and over[0] != self.starts_by_itself(depth, index):
            A, over = np.insert(A, 0, _BELOW * A[0]), np.insert(over, 0, not over[0])
        for i in np.flatnonzero(over[1:] != over[:-1]):
            low, high = np.log(A[i]), np.log(A[i + 1])
            if i or (self._excess(low, depth, index) > 0) == over[0]:
                low = self._crossing(low, high, depth, index)
            root = float(np.exp(low))
            found.append(Cycle(root, float(self.at(root)[1][index]), bool(over[i])))
        return tuple(found)

    def _crossing(self, low: float, high: float, depth: float, index: int) -> float:
        """Where b_lim passes the depth between two log A on either side; as near as it is known."""
        try:
            return float(scipy.optimize.brentq(self._excess, low, high, args=(depth, index), xtol=_SETTLED))
        except ValueError:
            # Somewhere between them no chart settles.
            rises = self._excess(high, depth, index) > 0
            while high - low > _SETTLED:
                inside = [low + share * (high - low) for share in (0.5, 0.25, 0.75)]
                found = next((x for x in inside if np.isfinite(self._excess(x, depth, index))), None)
                if found is None:
                    break
                low, high = (low, found) if (self._excess(found, depth, index) > 0) == rises else (found, high)
            return (low + high) / 2

    def starts_by_itself(self, depth: float, index: int = 0) -> bool:
        """Whether the smallest vibration grows at a depth in m."""
        return bool(depth > self.onset[index])

    def _excess(self, logarithm: float, depth: float, index: int) -> float:
        """1/b_lim − 1/b, finite where b_lim is not."""
        return 1 / float(self.at(float(np.exp(logarithm)))[0][index]) - 1 / depth

    def _curve(self, index: int) -> tuple[Array, Array]:
        inside = self.amplitude <= self.largest[index]
        return self.amplitude[inside], self.depth[inside, index]


def amplitude_limits(
    machine: Machine,
    speed: ArrayLike,
    amplitude: ArrayLike | None = None,
    method: str | None = None,
    rounds: int = _ROUNDS,
    rest: StabilityLobes | None = None,
) -> AmplitudeLimits:
    """b_lim(speed, A) over a grid of tool-point amplitudes.

    All amplitudes are computed by one method, that of the onset unless ``method`` says otherwise, with the joints
    frozen at the gains they have at each amplitude (see `lobes_at_amplitude`). In turning with a ``feed`` the cut is
    nonlinear, too: 1 + b·K_s·(N(r)/q)·(1 − e^(−jωτ))·G(ω; A) = 0, with r the amplitude of the chip in units of the feed
    and q its exponent; past r = 1 the tool leaves the cut and meets the surface of earlier turns (`lost_contact`).

    Parameters
    ----------
    speed
        rpm, one axis.
    amplitude
        m, ascending and above 0; default: 31 of them (16 in milling) over three decades up to the feed, or to 200 µm
        where no feed is given. For up to 8 speeds more are added around the lowest depth, in ``rounds``, and
        where chatter passes to another lobe. Those far apart come first, so that time may end (`deadline.within`).
    rest
        The chart at rest at these speeds by that method, where it is known.
    """
    speeds = np.atleast_1d(np.asarray(speed, dtype=float))
    onset = rest or frozen_lobes(machine, speeds, 0.0, method)[0]
    cutting = Cutting(**dict(machine.cutting or {}))
    A = amplitude_range(cutting) if amplitude is None else np.asarray(amplitude, dtype=float)
    if A.ndim != 1 or len(A) < 2 or not np.all(np.isfinite(A)) or A[0] <= 0 or np.any(np.diff(A) <= 0):
        raise InputError("amplitude limits: expected two or more amplitudes in m, above 0 and ascending")

    unsettled = dict[float, str]()

    def layer(size: float) -> tuple[StabilityLobes, Mask]:
        try:
            chart, held = frozen_lobes(machine, speeds, size, onset.method)
        except OutOfTime:
            raise
        except CheckFailed as failed:
            unsettled[size] = f"Limits are known below an amplitude of {size * 1e6:.3g} µm only: {failed}."
            return replace(onset, depth=np.full(speeds.shape, np.nan)), np.ones(speeds.shape, dtype=bool)
        return with_chip(machine, chart, cutting, size), held

    layers = dict[float, tuple[StabilityLobes, Mask]]()
    whole = False

    @cache
    def at(size: float) -> tuple[Array, Array]:
        chart, _ = layer(size)
        return chart.depth, chart.chatter_frequency

    turns = Turns("amplitudes", FEWEST)

    def begin(size: float) -> None:
        with turns.another():
            layers[size] = layers.get(size) or layer(size)

    try:
        for size in each("amplitudes", far_apart_first(A), len(A)):
            begin(size)
        for turn in range(_HALVINGS if len(speeds) <= _CHOSEN else 0):
            charts = [layers[size][0] for size in sorted(layers)]
            closer = between_lobes(sorted(layers), np.array([chart.lobe for chart in charts]))
            closer += near_lowest({size: chart.depth for size, (chart, _) in layers.items()}) if turn < rounds else []
            for size in each("amplitudes between them", closer, len(closer)):
                begin(size)
        whole = True
    except OutOfTime:
        if len(layers) < FEWEST:
            raise
    A = np.array(sorted(layers))
    charts = [layers[size][0] for size in A.tolist()]
    past = np.maximum.accumulate([layers[size][1] for size in A.tolist()], axis=0)
    said = dict.fromkeys(w for chart in (onset, *charts) for w in chart.warnings)
    chatter = np.where(np.isfinite(onset.depth), onset.chatter_frequency, charts[0].chatter_frequency)
    return AmplitudeLimits(
        speed=speeds,
        amplitude=A,
        onset=onset.depth,
        onset_frequency=onset.chatter_frequency,
        depth=np.where(past, np.nan, [chart.depth for chart in charts]),
        chatter_frequency=np.array([chart.chatter_frequency for chart in charts]),
        lobe=np.array([chart.lobe for chart in charts]),
        method=onset.method,
        notes=onset.notes,
        warnings=(*said, *([unsettled[min(unsettled)]] if unsettled else [])),
        at=at,
        touching=lambda: contact_amplitude(machine, cutting, speeds, chatter),
        whole=whole,
    )


def depends_on_amplitude(machine: Machine) -> bool:
    """Whether a joint, or the cut itself, behaves differently at different amplitudes."""
    cutting = Cutting(**dict(machine.cutting or {}))
    bent_cut = cutting.process != "milling" and cutting.feed is not None
    return bent_cut or not all(is_linear(joint) for joint in machine.joints())
