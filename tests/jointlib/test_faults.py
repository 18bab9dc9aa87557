"""Faults of rig and sensors: what each does to the three equations, and that undoing it gives the truth back.

The rig is simulated: a linear joint between two bodies, solved line by line; faults are put in by formulas in time.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import fftpack, signal

from jointlib.arrays import Array, ComplexArray
from jointlib.effects.clipping import Clipping
from jointlib.effects.delay import ChannelDelay
from jointlib.effects.drift import SensorDrift
from jointlib.effects.gain import SensorGain
from jointlib.effects.hum import MainsHum
from jointlib.effects.missing_mass import MissingMass
from jointlib.effects.offset import SensorOffset
from jointlib.effects.position_stiffness import PositionStiffness
from jointlib.effects.rocking_mode import RockingMode
from jointlib.effects.sensor_nonlinearity import SensorNonlinearity
from jointlib.effects.stiffness_drift import StiffnessDrift
from jointlib.effects.suspension import Suspension
from jointlib.errors import InputError
from jointlib.fault import Fault, Setting
from jointlib.loop.answer.catalogue import catalogue
from jointlib.measurement import Mass

RATE, PERIOD, PERIODS, RUN_IN = 102.4e3, 5120, 4, 2 * 5120
STIFFNESS, DAMPING = 654e6, 500.0
MASSES = {"a1": 0.942, "a2": 1.1, "a3": 1.1}
LINES = np.arange(100, 401)
OMEGA = 2 * np.pi * LINES * RATE / PERIOD
FAMILIES = (
    "gain delay offset drift hum clipping sensor-nonlinearity rocking-mode missing-mass suspension stiffness-drift "
    "position-stiffness"
)
SETTING = Setting(RATE, RUN_IN, periodic=True, masses=MASSES)


@dataclass(frozen=True)
class Rig:
    """A record without noise as a fault sees it; J stands from 1.6 kHz on, as z does."""

    channels: Mapping[str, Array]
    masses: Mapping[str, float] = field(default_factory=lambda: MASSES)
    suspensions: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    position: Array | None = None
    name: str = "simulated"
    rate: float = RATE
    period: int = PERIOD

    @property
    def samples(self) -> int:
        return len(self.channels["a1"])

    @property
    def frequency(self) -> Array:
        return np.asarray(np.fft.rfftfreq(self.samples, 1 / self.rate))

    @property
    def omega(self) -> Array:
        return 2 * np.pi * self.frequency

    @property
    def on_period(self) -> NDArray[np.bool_]:
        return np.asarray(np.arange(len(self.frequency)) % (self.samples // self.period) == 0)

    @property
    def time(self) -> Array:
        return (RUN_IN + np.arange(self.samples)) / self.rate

    @property
    def kept(self) -> NDArray[np.bool_]:
        return np.asarray(self.frequency >= 1600)

    @property
    def Z(self) -> ComplexArray:
        A = self.masked("a1") - self.masked("a2")
        return np.asarray(-np.where(self.kept, A, 0) / np.maximum(self.omega, 1) ** 2)

    @property
    def displacement(self) -> Array:
        return np.asarray(np.fft.irfft(np.where(self.on_period, self.Z, 0), self.samples))

    def suspension(self, channel: str) -> tuple[float, float]:
        return self.suspensions.get(channel, (0.0, 0.0))

    def has(self, channel: str) -> bool:
        return channel in self.channels

    def masked(self, channel: str) -> ComplexArray:
        return self.lines_of(self.channels[channel])

    def averaged(self, channel: str) -> Array:
        periods = self.samples // self.period
        return np.tile(self.channels[channel].reshape(periods, -1).mean(axis=0), periods)

    def predicted(self, channel: str) -> Array | None:
        rest = {c: m * self.averaged(c) for c, m in self.masses.items()}
        if channel in ("a2", "a3") and self.has("a3"):
            return self.averaged({"a2": "a3", "a3": "a2"}[channel])
        if channel == "P":
            return np.asarray(sum(rest.values()))
        other = sum(f for c, f in rest.items() if c != channel)
        return np.asarray((self.averaged("P") - other) / self.masses[channel])

    def lines_of(self, signal: Array) -> ComplexArray:
        return np.asarray(np.fft.rfft(signal, axis=-1))

    def on_channel(self, channel: str, X: ComplexArray) -> ComplexArray:
        N = np.zeros((len(self.frequency), 3), dtype=complex)
        m = self.masses.get(channel, 0.0)
        kappa = np.where(self.kept, STIFFNESS + 1j * self.omega * DAMPING, 0) / np.maximum(self.omega, 1) ** 2
        N[:, 0] = 1.0 if channel == "P" else -m
        N[:, 1] = {"a2": 1.0, "a3": -1.0}.get(channel, 0.0)
        N[:, 2] = {"a1": kappa, "a2": m - kappa, "a3": m}.get(channel, 0.0)
        return np.asarray(X[..., None] * N)

    def on_equations(
        self, balance: ComplexArray | float = 0, redundancy: ComplexArray | float = 0, joint: ComplexArray | float = 0
    ) -> ComplexArray:
        parts = np.broadcast_arrays(balance, redundancy, joint, np.zeros(len(self.frequency), dtype=complex))
        return np.stack(parts[:3], axis=-1)

    def equations(self) -> ComplexArray:
        """B, R and J of the channels with the true joint."""
        A = {c: self.masked(c) for c in self.channels}
        forces = {a: m * A[a] + self.pull(a) for a, m in self.masses.items()}
        driven, force = forces.pop("a1"), sum(forces.values())
        law = (STIFFNESS + 1j * self.omega * DAMPING) * self.Z
        B = A["P"] - driven - force
        return np.stack([B, A["a2"] - A["a3"], force - law], axis=-1)

    def pull(self, channel: str) -> ComplexArray:
        """Force of a suspension on what moves with an accelerometer, which is integrated in time."""
        k, c = self.suspension(channel)
        if not k and not c:
            return np.zeros(len(self.frequency), dtype=complex)
        v = self.lines_of(integral(self.channels[channel], self.rate))
        x = self.lines_of(integral(integral(self.channels[channel], self.rate), self.rate))
        return k * x + c * v


def integral(x: Array, rate: float) -> Array:
    """The integral of a periodic signal without mean, itself without mean."""
    return np.asarray(fftpack.diff(x, order=-1, period=len(x) / rate))


@cache
def amplitudes(runner: float = 0.942, passive: float = 2.2) -> dict[str, ComplexArray]:
    """Steady state under a multisine of 100 N rms: peak amplitude of every line, of the motion z too."""
    rng = np.random.default_rng(3)
    P = 100 * np.sqrt(2 / len(LINES)) * np.exp(2j * np.pi * rng.random(len(LINES)))
    mu = runner * passive / (runner + passive)
    z = mu / runner * P / (STIFFNESS - mu * OMEGA**2 + 1j * OMEGA * DAMPING)
    f = (STIFFNESS + 1j * OMEGA * DAMPING) * z
    return {"a1": (P - f) / runner, "a2": f / passive, "a3": f / passive, "P": P, "z": z}


def wave(amplitude: ComplexArray, late: float = 0.0) -> Array:
    """Re Σ amplitude e^{jω(t − late)}, four periods of it."""
    t = np.arange(PERIOD) / RATE - late
    return np.tile((np.exp(1j * np.outer(t, OMEGA)) @ amplitude).real, PERIODS)


@cache
def clean(runner: float = 0.942, passive: float = 2.2) -> Rig:
    found = amplitudes(runner, passive)
    return Rig({c: wave(found[c]) for c in ("a1", "a2", "a3", "P")})


def with_error(site: str, error: Array) -> Rig:
    return Rig({**clean().channels, site: clean().channels[site] + error})


TIME = (RUN_IN + np.arange(PERIOD * PERIODS)) / RATE


@dataclass(frozen=True)
class Injected:
    """A record with a fault, the same without it, and what the fault should be found to be."""

    faulty: Rig
    truth: Rig
    coefficients: tuple[float, ...]
    shape: Mapping[str, float] = field(default_factory=dict)


def gain(site: str, size: float) -> Injected:
    return Injected(with_error(site, size * clean().channels[site]), clean(), (size / (1 + size),))


def delay(site: str, size: float) -> Injected:
    late = size * 1e-5
    faulty = Rig({**clean().channels, site: wave(amplitudes()[site], late)})
    return Injected(faulty, clean(), (-late,))


def offset(site: str, size: float) -> Injected:
    return Injected(with_error(site, np.full(len(TIME), size)), clean(), (size,))


def drift(site: str, size: float) -> Injected:
    error = size * (0.3 + TIME * (7 - 4 * TIME))
    return Injected(with_error(site, error), clean(), (0.3 * size, 7 * size, -4 * size))


def hum(site: str, size: float) -> Injected:
    error = size * np.cos(2 * np.pi * 50.1 * TIME - 0.7) + 0.3 * size * np.cos(2 * np.pi * 150.3 * TIME + 0.2)
    first, third = size * np.exp(0.7j), 0.3 * size * np.exp(-0.2j)
    return Injected(
        with_error(site, error), clean(), (first.real, first.imag, third.real, third.imag), {"frequency": 50.1}
    )


def clipping(site: str, size: float) -> Injected:
    level = (1 - size) * float(np.max(np.abs(clean().channels[site])))
    x = clean().channels[site].copy()
    x[x > level], x[x < -level] = level, -level
    return Injected(Rig({**clean().channels, site: x}), clean(), (1.0,), {"level": level})


def curve(site: str, size: float) -> Injected:
    x = clean().channels[site]
    peak = float(np.max(np.abs(x)))
    a, b = size / peak, -0.5 * size / peak**2
    return Injected(with_error(site, a * x**2 + b * x**3), clean(), (a, b))


def rocking(site: str, size: float) -> Injected:
    w, zeta = 2 * np.pi * 4321.0, 0.02
    _, H = signal.freqs([1, 0, 0], [1, 2 * zeta * w, w**2], OMEGA)
    ringing = wave(H * amplitudes()["P"])
    channels = dict(clean().channels)
    channels["a2"], channels["a3"] = channels["a2"] + size * ringing, channels["a3"] - 0.4 * size * ringing
    return Injected(Rig(channels), clean(), (size, -0.4 * size), {"frequency": 4321.0, "damping_ratio": zeta})


def mass(site: str, size: float) -> Injected:
    truth = {**MASSES, site: MASSES[site] + size}
    channels = clean(truth["a1"], truth["a2"] + truth["a3"]).channels
    return Injected(Rig(channels), Rig(channels, truth), (size,))


def suspension(site: str, size: float) -> Injected:
    """Both bodies on springs and dampers, from the equations of two coupled oscillators."""
    k, c = size * 4e7, size * 1.3e3
    M, D = np.diag([0.942, 2.2]), np.array([[1.0, -1.0], [-1.0, 1.0]])
    held = np.diag([1.0, 0.0] if site == "a1" else [0.0, 1.0])
    w = OMEGA[:, None, None]
    dynamic = -(w**2) * M + 1j * w * (DAMPING * D + c * held) + STIFFNESS * D + k * held
    P = amplitudes()["P"]
    x = np.linalg.solve(dynamic, np.stack([P, 0 * P], axis=-1)[..., None])[..., 0]
    a = {"a1": -(OMEGA**2) * x[:, 0], "a2": -(OMEGA**2) * x[:, 1], "a3": -(OMEGA**2) * x[:, 1], "P": P}
    channels = {name: wave(A) for name, A in a.items()}
    return Injected(Rig(channels), Rig(channels, suspensions={site: (k, c)}), (k, c))


def modulated(stiffness: Array) -> Rig:
    """The rig whose force makes z the motion of the clean one while the stiffness changes: inverse dynamics."""
    z = amplitudes()["z"]
    f = (STIFFNESS + stiffness) * wave(z) + DAMPING * wave(1j * OMEGA * z)
    a2 = f / 2.2
    a1 = a2 + wave(-(OMEGA**2) * z)
    return Rig({"a1": a1, "a2": a2, "a3": a2, "P": f + 0.942 * a1})


def stiffness_drift(site: str, size: float) -> Injected:
    return Injected(
        modulated(STIFFNESS * size * (0.2 + 3 * TIME)), clean(), (3 * STIFFNESS * size, 0.2 * STIFFNESS * size, 0.0)
    )


def over_balls(site: str, size: float) -> Injected:
    ripple = STIFFNESS * size * np.cos(2 * np.pi * 8.3 * TIME - 1.1)
    found = STIFFNESS * size * np.exp(1.1j)
    return Injected(modulated(ripple), clean(), (found.real, found.imag, 0.0, 0.0), {"frequency": 8.3})


def over_balls_placed(site: str, size: float) -> Injected:
    place = 0.02 + 0.1 * TIME + 0.03 * TIME**2
    ripple = STIFFNESS * size * np.sin(2 * np.pi * place / 0.007)
    faulty = replace(modulated(ripple), position=place)
    return Injected(faulty, clean(), (0.0, STIFFNESS * size, 0.0, 0.0), {"wavelength": 0.007})


Inject = Callable[[str, float], Injected]
EXACT: list[tuple[Fault, str, Inject]] = [
    *((SensorGain(), c, gain) for c in ("a1", "a2", "a3", "P")),
    *((SensorOffset(), c, offset) for c in ("a1", "a3")),
    *((SensorDrift(), c, drift) for c in ("a2", "P")),
    *((MainsHum(), c, hum) for c in ("a1", "a3")),
    *((Clipping(), c, clipping) for c in ("a1", "a2", "P")),
    (RockingMode(), "", rocking),
    *((MissingMass(), c, mass) for c in ("a1", "a2", "a3")),
    *((Suspension(), c, suspension) for c in ("a1", "a2")),
    (StiffnessDrift(), "", stiffness_drift),
    (PositionStiffness(), "", over_balls),
    (PositionStiffness(), "", over_balls_placed),
]
FIRST_ORDER: list[tuple[Fault, str, Inject]] = [
    *((ChannelDelay(), c, delay) for c in ("a1", "a2", "a3", "P")),
    *((SensorNonlinearity(), c, curve) for c in ("a1", "a2", "P")),
]
each = pytest.mark.parametrize(
    ("fault", "site", "inject"), EXACT + FIRST_ORDER, ids=lambda x: getattr(x, "family", getattr(x, "__name__", x))
)


def missed(fault: Fault, site: str, injected: Injected) -> float:
    """Share of the change of B, R, J that columns times coefficients leave."""
    change = injected.faulty.equations() - injected.truth.equations()
    columns = fault.columns(injected.faulty, site, injected.shape)
    left = change - np.tensordot(np.array(injected.coefficients), columns, axes=1)
    unit = np.array([1.0, 2.2, 1.0])
    return float(np.linalg.norm(left * unit) / np.linalg.norm(change * unit))


def correction(fault: Fault, injected: Injected) -> Mapping[str, float]:
    found = fault.correction(np.array(injected.coefficients), injected.shape)
    assert found is not None
    return found


def undone(fault: Fault, channels: Mapping[str, Array], site: str, found: Mapping[str, float]) -> Mapping[str, Array]:
    return fault.undo(channels, site, found, SETTING)


def difference(a: Mapping[str, Array], b: Mapping[str, Array]) -> float:
    """Largest difference of two sets of channels, relative to the largest value of each."""
    return max(float(np.max(np.abs(a[c] - b[c])) / np.max(np.abs(b[c]))) for c in b)


def test_a_sound_rig_solves_all_three_equations() -> None:
    size = np.linalg.norm(clean().masked("P"))
    assert np.linalg.norm(clean().equations()) < 1e-12 * size


@pytest.mark.parametrize(("fault", "site", "inject"), EXACT)
def test_columns_are_what_the_fault_does(fault: Fault, site: str, inject: Inject) -> None:
    # The equations are differences of forces known to rounding, and the fault is 1e-2 of them.
    assert missed(fault, site, inject(site, 0.02)) < 1e-10


@pytest.mark.parametrize(("fault", "site", "inject"), FIRST_ORDER)
def test_columns_are_right_to_the_first_order(fault: Fault, site: str, inject: Inject) -> None:
    whole, half = (missed(fault, site, inject(site, size)) for size in (0.02, 0.01))
    assert whole < 0.1
    assert 1.9 < whole / half < 2.1


@each
def test_undoing_gives_the_truth_back(fault: Fault, site: str, inject: Inject) -> None:
    injected = inject(site, 0.05)
    if fault.on == "joint":
        assert undone(fault, injected.faulty.channels, site, correction(fault, injected)) == injected.faulty.channels
        return
    channels = undone(fault, injected.faulty.channels, site, correction(fault, injected))
    assert difference(channels, injected.truth.channels) < 1e-11
    if fault.on == "body":
        bodies = {c: Mass(m, 1e-3) for c, m in MASSES.items()}
        mended = fault.mended_masses(bodies, site, correction(fault, injected))
        assert {c: m.value for c, m in mended.items()} == pytest.approx(dict(injected.truth.masses))
        held = {c: (m.stiffness, m.damping) for c, m in mended.items() if m.stiffness or m.damping}
        assert held == dict(injected.truth.suspensions)
        assert {m.uncertainty for m in mended.values()} == {1e-3}


@each
def test_one_correction_stands_for_two(fault: Fault, site: str, inject: Inject) -> None:
    injected = inject(site, 0.02)
    known = correction(fault, injected)
    further = {n: v if n in fault.shape_parameters else 0.3 * v for n, v in known.items()}
    both = fault.combined(known, further)
    assert set(both) == set(known)
    once = undone(fault, injected.faulty.channels, site, both)
    twice = undone(fault, undone(fault, injected.faulty.channels, site, known), site, further)
    # A curve of a curve has a fourth power, of the order of the square of the fault.
    assert difference(once, twice) < (10 * 0.02**2 if fault.family == "sensor-nonlinearity" else 1e-11)
    bodies = {c: Mass(m) for c, m in MASSES.items()}
    if fault.on == "body":
        in_turn = fault.mended_masses(fault.mended_masses(bodies, site, known), site, further)
        at_once = fault.mended_masses(bodies, site, both)
        assert vars(at_once[site]) == pytest.approx(vars(in_turn[site]))


@each
def test_a_correction_names_its_parameters(fault: Fault, site: str, inject: Inject) -> None:
    injected = inject(site, 0.02)
    found = correction(fault, injected)
    assert set(found) <= set(fault.parameters)
    assert set(injected.shape) == fault.shape_parameters & set(found)
    assert {n: found[n] for n in injected.shape} == dict(injected.shape)
    assert all(type(v) is float for v in found.values())


@pytest.mark.parametrize(
    ("fault", "coefficients", "shape"),
    [
        (SensorGain(), (1.0,), {}),
        (SensorGain(), (2.5,), {}),
        (ChannelDelay(), (-2e-3,), {}),
        (ChannelDelay(), (2e-3,), {}),
        (Clipping(), (-1.0,), {"level": 3.0}),
        (Clipping(), (0.4,), {"level": 3.0}),
        (Clipping(), (1.6,), {"level": 3.0}),
        (Clipping(), (1.0,), {"level": -3.0}),
        (RockingMode(), (0.1, 0.1), {"frequency": -4e3, "damping_ratio": 0.01}),
        (RockingMode(), (0.1, 0.1), {"frequency": 4e3, "damping_ratio": -0.01}),
        (RockingMode(), (0.1, 0.1), {"frequency": 4e3, "damping_ratio": 1.2}),
        (MainsHum(), (1.0, 1.0, 0.0, 0.0), {"frequency": 30.0}),
        (PositionStiffness(), (1.0, 1.0), {"frequency": -8.0}),
        (PositionStiffness(), (1.0, 1.0), {"wavelength": -8.0}),
    ],
)
def test_unphysical_coefficients_are_refused(
    fault: Fault, coefficients: tuple[float, ...], shape: dict[str, float]
) -> None:
    assert fault.correction(np.array(coefficients), shape) is None


def test_either_sign_of_a_gain_delay_mass_or_offset_is_physical() -> None:
    for fault in (SensorGain(), ChannelDelay(), MissingMass(), SensorOffset()):
        (name,) = fault.parameters
        signs = [fault.correction(np.array([c]), {}) for c in (1e-4, -1e-4)]
        values = [s[name] for s in signs if s]
        assert sorted(np.sign(values)) == [-1, 1]


def test_a_gain_common_to_all_channels_shows_nowhere_on_a_linear_joint() -> None:
    columns = [SensorGain().columns(clean(), c, {}) for c in ("a1", "a2", "a3", "P")]
    assert np.linalg.norm(sum(columns)) < 1e-12 * min(np.linalg.norm(c) for c in columns)


@pytest.mark.parametrize("inject", [(SensorOffset(), {}), (SensorDrift(), {}), (MainsHum(), {"frequency": 50.0})])
def test_slow_errors_of_runner_and_force_differ_by_the_mass_alone(inject: tuple[Fault, dict[str, float]]) -> None:
    fault, shape = inject
    a1, P = (fault.columns(clean(), c, shape)[..., :2] for c in ("a1", "P"))
    np.testing.assert_array_equal(a1, -MASSES["a1"] * P)
    assert fault.family in fault.declared_pairs


def test_bodies_that_move_as_one_share_a_missing_mass() -> None:
    rail, block = (MissingMass().columns(clean(), c, {}) for c in ("a2", "a3"))
    np.testing.assert_array_equal(rail, block)
    assert "missing-mass" in MissingMass.declared_pairs


@pytest.mark.parametrize("body", ["a1", "a2", "a3"])
def test_in_the_balance_a_missing_mass_is_a_gain_of_the_accelerometer(body: str) -> None:
    mass, gain = (fault.columns(clean(), body, {})[0, :, 0] for fault in (MissingMass(), SensorGain()))
    np.testing.assert_allclose(-MASSES[body] * mass, gain, rtol=1e-12)
    assert "gain" in MissingMass.declared_pairs


def test_a_drift_that_neither_rises_nor_bends_is_an_offset() -> None:
    first = SensorDrift().columns(clean(), "P", {})[0]
    offset = SensorOffset().columns(clean(), "P", {})[0]
    np.testing.assert_allclose(first, offset, atol=1e-9 * np.abs(offset).max())
    assert "offset" in SensorDrift.declared_pairs


def test_an_offset_stands_on_the_mean_alone() -> None:
    column = SensorOffset().columns(clean(), "a2", {})[0]
    assert np.count_nonzero(column[1:]) == 0
    # Sums over the samples: −m2 N in the balance, N in the redundancy.
    np.testing.assert_allclose(column[0, :2], [-1.1 * PERIOD * PERIODS, PERIOD * PERIODS])


def test_a_signal_below_the_level_is_not_clipped() -> None:
    fault, peak = Clipping(), float(np.max(np.abs(clean().channels["a2"])))
    assert not fault.columns(clean(), "a2", {"level": 1.01 * peak}).any()
    levels = [s["level"] for s in fault.shapes([clean()], "a2")]
    assert 0.49 * peak < min(levels) < max(levels) < 0.99 * peak
    assert all(fault.columns(clean(), "a2", {"level": c}).any() for c in levels)


def test_a_clipped_acceleration_is_mended_from_the_balance_where_no_other_shows_it() -> None:
    injected = clipping("a2", 0.3)
    channels = {c: injected.faulty.channels[c] for c in ("a1", "a2", "P")}
    two = Setting(RATE, masses={"a1": 0.942, "a2": 2.2})
    mended = Clipping().undo(channels, "a2", injected.shape, two)
    assert difference(mended, {c: clean().channels[c] for c in channels}) < 1e-11
    low = np.abs(channels["a2"]) < 0.99 * injected.shape["level"]
    np.testing.assert_array_equal(mended["a2"][low], channels["a2"][low])


@pytest.mark.parametrize(("site", "have", "masses"), [("a1", "a1 a2 a3", MASSES), ("P", "a1 a2 P", {"a2": 2.2})])
def test_a_clipped_channel_that_nothing_predicts_is_refused(site: str, have: str, masses: dict[str, float]) -> None:
    channels = {c: clean().channels[c] for c in have.split()}
    with pytest.raises(InputError, match=f"nothing measured predicts {site}"):
        Clipping().undo(channels, site, {"level": 1.0}, Setting(RATE, masses=masses))


def test_a_sensor_curve_that_turns_back_is_refused() -> None:
    peak = float(np.max(np.abs(clean().channels["a2"])))
    with pytest.raises(InputError, match="the curve of a2 turns back"):
        undone(SensorNonlinearity(), clean().channels, "a2", {"quadratic": 0.0, "cubic": -0.5 / peak**2})


def test_a_strongly_bent_sensor_curve_is_straightened() -> None:
    x = clean().channels["P"]
    peak = float(np.max(np.abs(x)))
    bent = {**clean().channels, "P": x + 0.4 / peak * x**2 + 3 / peak**2 * x**3}
    mended = undone(SensorNonlinearity(), bent, "P", {"quadratic": 0.4 / peak, "cubic": 3 / peak**2})
    assert difference(mended, clean().channels) < 1e-11


def test_a_mass_below_zero_or_unknown_is_refused() -> None:
    with pytest.raises(InputError, match=r"would weigh -0\.1 kg"):
        MissingMass().mended_masses({"rail": Mass(1.1)}, "rail", {"mass": -1.2})
    with pytest.raises(InputError, match="unknown"):
        MissingMass().mended_masses({"rail": Mass(None)}, "rail", {"mass": 0.1})


def test_a_transient_record_comes_back_from_a_delay() -> None:
    t = np.arange(4096) / RATE

    def burst(late: float) -> Array:
        return np.exp(-(((t - late - 0.02) / 2e-3) ** 2)) * np.sin(2 * np.pi * 4e3 * (t - late))

    channels = {"a1": burst(3e-6)}
    mended = ChannelDelay().undo(channels, "a1", {"delay": 3e-6}, Setting(RATE))
    assert np.max(np.abs(mended["a1"] - burst(0.0))) < 1e-12
    assert np.max(np.abs(channels["a1"] - burst(0.0))) > 0.05


@pytest.mark.slow
def test_a_transient_record_comes_back_from_a_rocking_mode_at_rest_before_it() -> None:
    # The oscillator is integrated at 32 steps per sample with a force linear in between: its error is (ω step)²/12.
    fine, n = 32, 4096
    t = np.arange(n * fine) / (RATE * fine)
    P = 50 * np.exp(-(((t - 0.02) / 2e-3) ** 2)) * np.sin(2 * np.pi * 4e3 * t)
    w, zeta = 2 * np.pi * 4321.0, 0.02
    _, X, _ = signal.lsim(([1, 0, 0], [1, 2 * zeta * w, w**2]), P, t)
    ringing = X[::fine]
    found = {"frequency": 4321.0, "damping_ratio": zeta, "on_a2": 0.1, "on_a3": 0.0}
    mended = RockingMode().undo({"P": P[::fine], "a2": 0.1 * ringing}, "", found, Setting(RATE))
    bound = 10 * (w / (RATE * fine)) ** 2 / 12
    assert np.max(np.abs(mended["a2"])) < bound * np.max(np.abs(0.1 * ringing))
    with pytest.raises(InputError, match="no channel P"):
        RockingMode().undo({"a2": ringing}, "", found, Setting(RATE))


@pytest.mark.parametrize("rate", [RATE, RATE / 50])
def test_mains_are_tried_as_finely_as_the_records_resolve(rate: float) -> None:
    rig = replace(clean(), rate=rate)
    tried = np.array([s["frequency"] for s in MainsHum().shapes([rig], "a1")])
    resolved = 1 / (rig.samples / rate)
    for mains in (50.0, 60.0):
        for stray in np.linspace(-0.5, 0.5, 101):
            assert np.min(np.abs(tried - mains - stray)) < 0.25 * resolved


def test_modulation_is_tried_between_the_lines_of_the_period() -> None:
    tried = np.array([s["frequency"] for s in PositionStiffness().shapes([clean()], "")])
    resolved, spacing = 1 / 0.2, 20.0
    assert 10 < len(tried) <= 40
    assert tried[0] == pytest.approx(1.5 * resolved)
    assert np.all(np.abs(tried - spacing * np.round(tried / spacing)) > 0.99 * resolved)
    between = tried[tried < spacing]
    assert np.all(np.diff(between) < 0.51 * resolved)


def test_a_measured_place_is_tried_by_wavelength() -> None:
    placed = over_balls_placed("", 0.01).faulty
    assert placed.position is not None
    travel = float(np.ptp(placed.position))
    tried = np.array([s["wavelength"] for s in PositionStiffness().shapes([placed], "")])
    assert len(tried) == 40
    np.testing.assert_allclose(travel / tried, np.arange(1.5, 21.5, 0.5))
    assert "frequency" in PositionStiffness().shapes([placed, clean()], "")[0]
    assert PositionStiffness().shapes([replace(placed, position=0 * placed.position)], "") == ()
    with pytest.raises(InputError, match="no feed position"):
        PositionStiffness().columns(clean(), "", {"wavelength": 0.007})


def test_modes_are_tried_over_the_excited_band_and_beyond() -> None:
    tried = np.unique([s["frequency"] for s in RockingMode().shapes([clean()], "")])
    assert tried.min() == pytest.approx(2e3 / 1.7)
    assert tried.max() == pytest.approx(8e3 * 1.7)
    inside = tried[(tried > 1999) & (tried < 8001)]
    assert len(inside) == 25
    assert np.diff(inside).max() < 300
    without = Rig({c: clean().channels[c] for c in ("a1", "a2", "a3")})
    assert RockingMode().shapes([without], "") == ()


def test_the_resonance_of_the_bodies_on_the_joint_is_no_rocking_mode() -> None:
    """ω₀² = k(1/m₁ + 1/M) and ζ₀ = c/(2 k) ω₀: there a wrong gain of a2 has the shape of a mode."""
    shape = RockingMode().shapes([clean()], "")[0]
    mu = 0.942 * 2.2 / (0.942 + 2.2)
    own = np.sqrt(STIFFNESS / mu)
    assert 2 * np.pi * shape["joint_frequency"] == pytest.approx(own, rel=1e-6)
    assert shape["joint_damping_ratio"] == pytest.approx(DAMPING * own / (2 * STIFFNESS), rel=1e-4)
    f, zeta = shape["joint_frequency"], shape["joint_damping_ratio"]

    def refused(frequency: float, damping_ratio: float) -> bool:
        mode = {**shape, "frequency": frequency, "damping_ratio": damping_ratio}
        return RockingMode().correction(np.array([0.1, 0.1]), mode) is None

    def shared(frequency: float, damping_ratio: float) -> float:
        """Of the responses of both modes to white noise, by quadrature on lines far finer than their widths."""
        w = 2 * np.pi * np.arange(10.0, 5e4, 0.5)
        both = ((2 * np.pi * f, zeta), (2 * np.pi * frequency, damping_ratio))
        H = [1 / (own**2 - w**2 + 2j * share * own * w) for own, share in both]
        return float(abs(np.vdot(*H)) ** 2 / (np.vdot(H[0], H[0]).real * np.vdot(H[1], H[1]).real))

    for frequency, damping_ratio in ((f, zeta), (f + 20, zeta), (f, 1.5 * zeta), (f + 60, zeta), (f, 2 * zeta)):
        assert refused(frequency, damping_ratio) == (shared(frequency, damping_ratio) >= 0.95)
    assert refused(f, zeta)
    assert not refused(f - 60, zeta)


def test_a_rocking_mode_beside_the_joint_leaves_the_resonance_of_the_joint_where_it_is() -> None:
    faulty = rocking("", 0.05).faulty
    own, seen = (RockingMode().shapes([r], "")[0] for r in (clean(), faulty))
    assert seen["joint_frequency"] == pytest.approx(own["joint_frequency"], rel=0.01)
    assert RockingMode().correction(np.array([0.1, 0.1]), {**seen, "frequency": 4321.0, "damping_ratio": 0.02})


def test_only_what_was_measured_is_tried() -> None:
    two = Rig({c: clean().channels[c] for c in ("a1", "a2", "P")}, {"a1": 0.942, "a2": 2.2})
    assert SensorGain().sites(two) == ("a1", "a2", "P")
    assert MissingMass().sites(two) == ("a1", "a2")
    assert MissingMass().sites(replace(two, masses={"a2": 2.2})) == ("a2",)
    assert RockingMode().sites(two) == StiffnessDrift().sites(two) == ("",)
    assert len(RockingMode().columns(two, "", {"frequency": 4e3, "damping_ratio": 0.01})) == 1
    found = RockingMode().correction(np.array([0.1]), {"frequency": 4e3, "damping_ratio": 0.01})
    assert found is not None
    assert found["on_a3"] == 0


def test_the_catalogue_holds_every_family() -> None:
    installed = {f.family: f for f in catalogue().rig}
    assert set(FAMILIES.split()) <= set(installed)
    for fault in map(installed.__getitem__, FAMILIES.split()):
        assert ("{site}" in fault.words) == (fault.on in ("channel", "body"))
        assert f"({fault.family})" in fault.words
        assert fault.declared_pairs <= set(fault.look_alikes)
        assert fault.shape_parameters <= set(fault.parameters)
        assert fault.experiment.endswith(".") or not fault.needs
        assert all(text.endswith(".") for text in fault.look_alikes.values())


def test_a_stiffness_that_differs_from_record_to_record_alone_is_no_drift() -> None:
    """Any effect of the amplitude does that."""

    @dataclass(frozen=True)
    class Timed:
        time: Array

    records = [Timed(np.linspace(0.1, 0.3, 200)) for _ in range(4)]
    levels = (1e6, 3e6, -2e6, -1e6)

    def sizes(rate: float) -> list[dict[str, float]]:
        return [{"stiffness": k - 0.2 * rate, "stiffness_rate": rate, "stiffness_bend": 0.0} for k in levels]

    assert not StiffnessDrift().shows(sizes(1e6), records)  # type: ignore[arg-type]
    assert StiffnessDrift().shows(sizes(4e7), records)  # type: ignore[arg-type]
