"""Noise and slopes of a path, on records whose noise and slopes are known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from jointlib import read_measurement, trace
from jointlib.arrays import Array
from jointlib.effects.stribeck import StribeckFriction
from jointlib.identification.path_record import slope
from jointlib.io.measurement_file import read_records
from jointlib.joint import Joint
from jointlib.laws.linear import Linear
from jointlib.laws.stribeck import Stribeck
from jointlib.laws.viscous import Viscous
from jointlib.loop.answer.report import Verdict
from jointlib.loop.path.band_floor import band_floor
from jointlib.loop.path.preparation import choose_preparation, prepare
from jointlib.loop.path.strokes import divide

TOP = 5.0
STIFFNESS, DAMPING = 2e3, 800.0


def motion(rng: np.random.Generator, rate: float) -> tuple[Array, Array]:
    """z in m and ż in m/s up to 5 Hz, the faster the smaller."""
    f = np.fft.rfftfreq(int(40 * rate), 1 / rate)
    inside = (f > 0.1) & (f < TOP)
    Z = np.where(inside, np.exp(2j * np.pi * rng.uniform(size=len(f))) / (1 + f), 0)
    z, v = np.fft.irfft(Z), np.fft.irfft(2j * np.pi * f * Z)
    return 6e-3 / z.std() * z, 6e-3 / z.std() * v


def head(rate: float, records: str) -> str:
    """A measurement file of records with z and F, whose names are single letters."""
    listed = ", ".join(f'{{ file = "{name}.npz" }}' for name in records)
    return (
        f'schema = "jointlib/measurement/1"\nkind = "path"\nsample_rate = {rate}\nrecord = [{listed}]\n'
        'channel = [{ name = "z", quantity = "displacement", unit = "m" },\n'
        '{ name = "F", quantity = "force", unit = "N" }]\n'
    )


def floor_of(folder: Path, friction: float, noise_F: float, noise_z: float, rate: float = 500.0) -> tuple[float, float]:
    """The floor found, and what noise of force and displacement makes of the force within the band, N rms."""
    rng = np.random.default_rng(7)
    z, v = motion(rng, rate)
    force = STIFFNESS * z + DAMPING * v + friction * v / np.sqrt(v**2 + 0.02**2)
    np.savez(folder / "r.npz", z=z + noise_z * rng.normal(size=len(z)), F=force + noise_F * rng.normal(size=len(z)))
    (folder / "m.toml").write_text(head(rate, "r"))
    test = read_measurement(folder / "m.toml")
    records = read_records(test, test.records)
    preparation = choose_preparation(test, records)
    runs = tuple(prepare(test, record, preparation) for record in records)
    found = band_floor(test, records, preparation, divide(runs))
    assert found is not None
    f = np.linspace(0, preparation.cutoff, 1001)
    answer = np.abs(STIFFNESS + 2j * np.pi * f * DAMPING)
    share = preparation.cutoff / (rate / 2)
    honest = np.sqrt(share * (noise_F**2 + noise_z**2 * np.mean(answer**2)))
    return float(np.sqrt(np.mean(found.power))), float(honest)


@pytest.mark.parametrize("rate", [100.0, 500.0, 4000.0])
@pytest.mark.parametrize(("noise_F", "noise_z"), [(0.02, 1e-8), (0.002, 1.5e-6)])
def test_noise_of_a_spring_and_damper_is_what_it_is(
    noise_F: float, noise_z: float, rate: float, tmp_path: Path
) -> None:
    """However densely a record is sampled: it is thinned where it is far more so than its motion asks for."""
    share = np.sqrt(rate / 500.0)
    found, honest = floor_of(tmp_path, 0.0, share * noise_F, share * noise_z, rate)
    assert found == pytest.approx(honest, rel=0.25)


def test_what_friction_makes_of_quiet_frequencies_is_no_noise(tmp_path: Path) -> None:
    """Its force reaches to where the motion is lost in its noise, which says nothing of how that noise is carried."""
    found, honest = floor_of(tmp_path, 5.0, 0.05, 1e-6)
    assert 0.8 * honest < found < 3 * honest


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_path_on_which_nothing_hides_is_told_so_at_sixty_decibels(seed: int, tmp_path: Path) -> None:
    """What differences between samples leave of a velocity lies below the noise."""
    rng = np.random.default_rng(seed)
    for name in "abc":
        z, v = motion(rng, 125.0)
        force = STIFFNESS * z + DAMPING * v
        small = 1e-3 * rng.normal(size=(2, len(z)))
        np.savez(tmp_path / f"{name}.npz", z=z + 0.1 * z.std() * small[0], F=force + force.std() * small[1])
    (tmp_path / "m.toml").write_text(head(125.0, "abc"))
    found = trace(read_measurement(tmp_path / "m.toml"), Joint((Linear(1.1 * STIFFNESS), Viscous(0.9 * DAMPING))))
    assert found.verdict is Verdict.NOTHING_MISSING, found.sentence


def test_a_slope_is_short_by_the_fourth_power_of_the_frequency() -> None:
    t = np.arange(400) / 100.0
    for f in (1.0, 3.0, 6.0):
        omega = 2 * np.pi * f
        found = slope(np.sin(omega * t), 100.0)[2:-2]
        short = 1 - found @ np.cos(omega * t)[2:-2] / (omega * np.sum(np.cos(omega * t)[2:-2] ** 2))
        assert short == pytest.approx((omega / 100) ** 4 / 30, rel=0.1)


def test_a_bump_that_fades_before_friction_has_risen_is_no_friction_that_falls() -> None:
    effect = StribeckFriction()
    assert effect.shows(Joint((Stribeck(20.0, 30.0, 0.02, 0.01),)))
    assert not effect.shows(Joint((Stribeck(20.0, 300.0, 0.002, 0.01),)))
