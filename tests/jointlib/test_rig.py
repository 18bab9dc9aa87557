"""The simulated rigs obey mechanics, and the shipped records are what their recipe makes."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
from rig_samples import GUIDE, PERIOD, RATE, shaken

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.identification import restoring_force
from jointlib.io.measurement_file import read_measurement, read_records
from jointlib.joint import Joint
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from jointlib.rig import guide_records
from jointlib.rig.dynamic import DynamicRig
from jointlib.rig.excitation import Excitation, modulated_sine, multisine
from jointlib.rig.sensors import Converter
from jointlib.rig.static import StaticRig, push_and_pull

LIBRARY = Path(__file__).parents[2] / "machines" / "library" / "guide_mill"


def test_linear_rig_follows_its_exact_frequency_response() -> None:
    k, c = 640e6, 480.0
    steady = shaken(Joint((Linear(k), Viscous(c))), (60.0,))
    rig = DynamicRig(GUIDE)
    omega = 2 * np.pi * np.fft.rfftfreq(PERIOD, 1 / RATE)
    shaker = np.fft.rfft(steady.shaker_force[:, 0])
    exact = shaker / rig.runner_block / (-(omega**2) + (k + 1j * omega * c) / rig.reduced_mass)
    found = np.fft.rfft(steady.displacement[:, 0])
    # Fourth order at 80 steps per cycle of 5 kHz: 0.35 (ωh)^4 = 1e-5 of the frequency, over a loss factor of 0.024.
    assert np.linalg.norm(found - exact) < 6e-4 * np.linalg.norm(exact)
    assert steady.unsettled < 1e-4


def test_halving_the_step_gains_more_than_a_decade() -> None:
    drive, rest = multisine(np.random.default_rng(7), 150.0, period=256, sample_rate=RATE), np.zeros(1)

    def end(substeps: int) -> Array:
        """Displacement at the samples of the first 2.5 ms from rest."""
        shaker = np.append(drive.force(substeps), 0.0)[:, None]
        course = DynamicRig(GUIDE).motion(shaker, 1 / (RATE * substeps), (rest, rest, np.empty((1, 0))))
        return course.displacement[::substeps]

    reference = end(16)
    coarse, fine = (np.max(np.abs(end(n) - reference)) for n in (4, 8))
    # From rest the first steps are of low order, which costs (ωh)² of the first force once.
    assert fine < coarse / 3
    assert fine < 1e-3 * np.max(np.abs(reference))


@pytest.mark.thorough
def test_shaker_work_is_what_the_damper_takes() -> None:
    rig, steady = DynamicRig(GUIDE), shaken()
    put_in = rig.reduced_mass / rig.runner_block * np.mean(steady.shaker_force * steady.velocity, axis=0)
    taken = 480.0 * np.mean(steady.velocity**2, axis=0)
    assert put_in == pytest.approx(taken, rel=1e-3)


@pytest.mark.thorough
def test_channels_balance_the_shaker_force() -> None:
    channels = shaken().channels
    balance = channels["P"] - 0.942 * channels["a1"] - 1.1 * channels["a2"] - 1.1 * channels["a3"]
    assert np.max(np.abs(balance)) < 1e-11 * np.max(np.abs(channels["P"]))


def test_free_rig_rings_at_its_natural_frequency_and_decay() -> None:
    rig = DynamicRig(GUIDE)
    guide = GUIDE.laws[0]
    assert isinstance(guide, HertzGuide)
    omega0 = np.sqrt(guide.stiffness / rig.reduced_mass)
    decay = 480.0 / (2 * rig.reduced_mass)
    omega, h, steps = np.sqrt(omega0**2 - decay**2), 1 / (8 * RATE), 4000
    z0 = np.array([1e-10])
    start = z0, np.zeros(1), GUIDE.initial_state(z0)
    t = h * np.arange(steps + 1)
    course = rig.motion(np.zeros((steps + 1, 1)), h, start)
    exact = 1e-10 * np.exp(-decay * t) * (np.cos(omega * t) + decay / omega * np.sin(omega * t))
    # The starting formulas of first and second order leave an error of (ωh)² once.
    assert np.max(np.abs(course.displacement[:, 0] - exact)) < 3e-3 * 1e-10


def test_slider_takes_coulomb_work_in_a_loading_cycle() -> None:
    law, reach = Jenkins(stiffness=3e7, slip_force=40.0), 5e-6
    path = push_and_pull(reach, 400)
    lap = np.concatenate([path, path[1:]])
    _, load = StaticRig(Joint((law,)), load_noise=0.0, displacement_noise=0.0).curve(np.random.default_rng(0), lap)
    z, f = lap[len(path) - 1 :], load[len(path) - 1 :]
    # The corner where slip begins falls between two points: one step of 12.5 nm times the slip force at most.
    work = np.trapezoid(f, z)
    assert work == pytest.approx(4 * law.slip_force * (reach - law.slip_force / law.stiffness), rel=2e-3)


def test_static_curve_passes_through_the_hertz_loads() -> None:
    guide = HertzGuide(630.0, 3.931408125e-8)
    rig = StaticRig(Joint((guide,)), load_noise=0.0, displacement_noise=0.0)
    _, load = rig.curve(np.random.default_rng(0), np.array([1e-6, 3e-6, 6e-6]))
    assert load == pytest.approx([652.5126, 1912.695, 3455.364], rel=1e-6)


def test_multisine_fills_its_band_evenly() -> None:
    lines = np.abs(np.fft.rfft(multisine(np.random.default_rng(3), 50.0).force()))
    frequency = np.fft.rfftfreq(5120, 1 / RATE)
    inside = (frequency >= 2e3) & (frequency <= 8e3)
    assert np.ptp(lines[inside]) < 1e-9 * lines.max()
    assert np.max(lines[~inside]) < 1e-9 * lines.max()
    assert np.sqrt(2 * np.sum((lines / 5120) ** 2)) == pytest.approx(50.0)


def test_modulated_sine_has_two_side_bands() -> None:
    force = modulated_sine(50.0).force(3)
    lines = 2 * np.abs(np.fft.rfft(force)) / len(force)
    assert lines[239] / lines[240] == pytest.approx(0.4)
    assert lines[241] / lines[240] == pytest.approx(0.4)
    assert np.sqrt(np.mean(force**2)) == pytest.approx(50.0)
    with pytest.raises(InputError, match="multiples of 20 Hz"):
        modulated_sine(50.0, carrier=4805.0)


def test_excitations_of_two_grids_are_refused() -> None:
    rng = np.random.default_rng(0)
    pair: list[Excitation] = [multisine(rng, 1.0), multisine(rng, 1.0, period=1024)]
    with pytest.raises(InputError, match="one grid"):
        DynamicRig(GUIDE).steady_state(pair)


def test_converter_rounds_to_counts_and_clips() -> None:
    counts = Converter(4096.0).counts(np.array([0.06, 0.07, 5000.0, -5000.0]))
    assert counts.tolist() == [0, 1, 32767, -32768]


def test_shipped_records_obey_the_declared_joint() -> None:
    rig = read_measurement(LIBRARY / "rig.measurement.toml")
    sources = [r for r in rig.records if r.role != "quiet"]
    surfaces = [restoring_force(rig, record) for record in read_records(rig, sources)]
    z, v = (np.stack([np.tile(x, 2) for x in xs], axis=-1) for xs in ([s.z for s in surfaces], [s.v for s in surfaces]))
    force = guide_records.TRUE_JOINT.force_along(z, v, 1 / 102.4e3)[5120:]
    for k, surface in enumerate(surfaces):
        left = surface.f - surface.filtered(force[:, k])
        # Noise of a2 and a3 (0.32 m/s² each on 1.1 kg) and of z (κ = K/ω²) halved by four periods.
        assert np.sqrt(np.mean(left**2)) < 0.5
        assert np.sqrt(np.mean(surface.f**2)) > 100


def test_shipped_loading_curve_obeys_the_declared_joint() -> None:
    static = read_measurement(LIBRARY / "static.measurement.toml")
    (record,) = read_records(static, static.records)
    set_path = push_and_pull(guide_records.REACH, 75)
    load = guide_records.TRUE_JOINT.force_along(set_path, np.zeros_like(set_path))
    assert np.std(record.channels["load"] - load) == pytest.approx(15.0, rel=0.15)
    assert np.std(record.channels["deflection"] - set_path) == pytest.approx(10e-9, rel=0.15)


@pytest.mark.slow
def test_shipped_records_are_what_the_recipe_makes() -> None:
    steady = guide_records.steady_states()
    assert steady.unsettled < 1e-6
    for name, channels in guide_records.rig_records(steady).items():
        with np.load(LIBRARY / f"{name}.npz") as shipped:
            for channel, counts in channels.items():
                change = np.abs(shipped[channel].astype(int) - counts)
                # Another processor may round the last bit of a value that lies between two counts.
                assert change.max() <= 1
                assert np.count_nonzero(change) <= 20


def test_shipped_loading_curve_is_what_the_recipe_makes() -> None:
    deflection, load = guide_records.static_record()
    table = np.loadtxt(LIBRARY / "static.csv", delimiter=",", skiprows=2)
    assert table[:, 0] == pytest.approx(1e6 * deflection, abs=6e-5)
    assert table[:, 1] == pytest.approx(load, abs=6e-3)


def test_shipped_declaration_fits_the_converters_and_says_simulated() -> None:
    rig = read_measurement(LIBRARY / "rig.measurement.toml")
    for name, converter in guide_records.CONVERTERS.items():
        assert rig.channel(name).factor == converter.count
        assert rig.channel(name).full_scale == converter.full_scale
    assert [r.role for r in rig.records].count("fit") == 5
    for path in LIBRARY.glob("*.measurement.toml"):
        assert tomllib.loads(path.read_text())["simulated"] is True
        assert "Simulated" in path.read_text()
    assert sum(p.stat().st_size for p in LIBRARY.iterdir()) < 1.2e6


def test_shipped_files_do_not_give_the_truth_away() -> None:
    for path in LIBRARY.glob("*.toml"):
        text = path.read_text().lower()
        assert not any(word in text or word in path.name for word in ("jenkins", "slip", "hyster", "612", "35.71"))
