"""Motions of one point must be derivatives of each other, and a mass be that of a body."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from jointlib.answers.identify import identify as written
from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.estimation.same_motion import refuse_other_motion
from jointlib.identification import Identification, identify
from jointlib.identification.strange import strange_mass
from jointlib.io.measurement_file import read_measurement, read_records
from jointlib.joint import Joint
from jointlib.laws.viscous import Viscous
from jointlib.loop.trace import trace
from jointlib.measurement import Mass, Measurement

RATE, MASS, DAMPING, SLIP = 500.0, 20.0, 80.0, 15.0
UNITS = {"x": "displacement", "v": "velocity", "a": "acceleration", "F": "force"}
Changes = Callable[[Array], Array]


def path(folder: Path, **changes: Changes) -> Measurement:
    """A carriage on viscous and dry friction, moved by three sines at three speeds; channels as they are changed."""
    rng, text = np.random.default_rng(5), f'schema = "jointlib/measurement/1"\nkind = "path"\nsample_rate = {RATE}\n'
    text += 'carriage = "unknown"\n'
    wanted = [name for name in UNITS if name in changes or name in ("x", "F")]
    units = {"x": "m", "v": "m/s", "a": "m/s^2", "F": "N"}
    for name in wanted:
        text += f'[[channel]]\nname = "{name}"\nquantity = "{UNITS[name]}"\nunit = "{units[name]}"\n'
    t = np.arange(4000) / RATE
    for k, speed in enumerate((0.7, 1.0, 1.6)):
        lines = [(A, 2 * np.pi * f * speed) for A, f in ((0.02, 0.5), (2e-3, 2.3), (3e-4, 6.1))]
        signals = {
            "x": sum(A * np.sin(w * t) for A, w in lines) + 1e-7 * rng.standard_normal(len(t)),
            "v": sum(A * w * np.cos(w * t) for A, w in lines) + 1e-4 * rng.standard_normal(len(t)),
            "a": -sum(A * w**2 * np.sin(w * t) for A, w in lines) + 1e-2 * rng.standard_normal(len(t)),
        }
        v = np.asarray(sum(A * w * np.cos(w * t) for A, w in lines))
        signals["F"] = MASS * signals["a"] + DAMPING * v + SLIP * np.tanh(v / 1e-3) + 0.2 * rng.standard_normal(len(t))
        for name, change in changes.items():
            signals[name] = change(np.asarray(signals[name]))
        np.savez(folder / f"run_{k}.npz", **{name: signals[name] for name in wanted})
        text += f'[[record]]\nfile = "run_{k}.npz"\n'
    (folder / "slide.measurement.toml").write_text(text, "utf-8")
    return read_measurement(folder / "slide.measurement.toml")


def same(x: Array) -> Array:
    return x


def times(factor: float) -> Changes:
    return lambda x: factor * x


def doubts(m: Measurement) -> list[str]:
    return refuse_other_motion(m, read_records(m, m.records))


def fitted(m: Measurement) -> Identification:
    return identify([m], laws=("viscous", "coulomb"))


def test_channels_that_agree_within_their_noise_are_left_alone(tmp_path: Path) -> None:
    assert doubts(path(tmp_path, v=same, a=same)) == []


def test_sensors_that_drift_and_filters_that_round_are_no_contradiction(tmp_path: Path) -> None:
    drift = np.linspace(1, 3, 4000)
    assert doubts(path(tmp_path, v=lambda v: v + 0.1 * drift, a=lambda a: a + 5 * drift)) == []


@pytest.mark.parametrize(
    ("channel", "factor", "smell"),
    [
        ("a", 9.80665, "'a' is 9.8.* times the second derivative of displacement 'x'.* smells of a unit .*g for m/s"),
        ("a", 1e-3, "'a' is 0.001.* times the second derivative .* a unit .mm for m"),
        ("v", -1.0, "'v' is -1.* times the derivative of displacement 'x'.* a turned sign"),
        ("v", 1 / 25.4, "'v' is 0.039.* times .*inches for mm"),
        ("v", 60.0, "'v' is 60.* times .*mm/min for mm/s"),
        ("v", 2.0, "'v' is 2.* times .* a range or sensitivity"),
    ],
)
def test_a_channel_that_contradicts_the_displacement_is_refused(
    tmp_path: Path, channel: str, factor: float, smell: str
) -> None:
    m = path(tmp_path, **{channel: times(factor)})
    with pytest.raises(InputError, match=smell):
        fitted(m)
    with pytest.raises(InputError, match=smell):
        trace(m, Joint((Viscous(DAMPING),)))


def test_a_small_factor_and_a_delay_are_told_and_not_refused(tmp_path: Path) -> None:
    (said,) = doubts(path(tmp_path, v=times(1.1)))
    assert "'v' is 1.1 times the derivative" in said
    (said,) = doubts(path(tmp_path, v=lambda v: np.concatenate([v[:1].repeat(10), v[:-10]])))
    late = re.search(r"'v' comes (.*) ms after the derivative", said)
    assert late is not None
    assert float(late[1]) == pytest.approx(20, rel=0.1)


def test_a_point_beyond_a_flexible_part_is_no_unit(tmp_path: Path) -> None:
    """Its acceleration is 1/|1 − r²| times that of the motor, another factor on each line."""

    def beyond(a: Array) -> Array:
        H = np.fft.rfft(a)
        r = np.fft.rfftfreq(len(a), 1 / RATE) / 12.0
        return np.asarray(np.fft.irfft(H / (1 - r**2 + 0.1j * r), len(a)))

    assert not [said for said in doubts(path(tmp_path, a=beyond)) if "smells" in said]


def test_a_turned_force_is_told_by_its_mass_and_nothing_is_written(tmp_path: Path) -> None:
    """Twenty kilograms below zero are refused; where the mass was weighed the energy tells."""
    m, out = path(tmp_path, F=times(-1.0)), tmp_path / "slide.joint.toml"
    with pytest.raises(InputError, match="below zero, which no carriage has: the sign") as refused:
        written(m, laws=("viscous", "coulomb"), output=out)
    told = re.search(r"comes out at (\S+) ± ", str(refused.value))
    assert told is not None
    assert float(told[1]) == pytest.approx(-MASS, rel=0.05)
    assert not out.exists()
    with pytest.raises(InputError, match="below zero, which no carriage has: the sign"):
        trace(m, Joint((Viscous(DAMPING),)))
    weighed = replace(m, carriage=Mass(MASS))
    assert "yield energy" in " ".join(fitted(weighed).messages)
    assert "yield energy" in " ".join(trace(weighed, Joint((Viscous(DAMPING),))).warnings)


def test_a_mass_below_zero_within_its_error_is_no_reason_to_refuse(tmp_path: Path) -> None:
    m = path(tmp_path)
    assert strange_mass(m, -1.0, 2.0) == []
    (said,) = strange_mass(m, -1.0, 0.5)
    assert "or the records do not tell the mass" in said
    with pytest.raises(InputError, match="Nothing is written"):
        strange_mass(m, -1.0, 0.3)


def test_a_mass_of_tonnes_is_told_and_one_of_kilograms_is_not(tmp_path: Path) -> None:
    good = fitted(path(tmp_path))
    assert good.parameters["carriage"].value == pytest.approx(MASS, rel=0.05)
    assert not [said for said in good.messages if "moving mass" in said or "energy" in said]
    said = " ".join(fitted(path(tmp_path, x=times(1e-3))).messages)
    assert "which few carriages have: look at the units" in said


def sliders(x: Array) -> Array:
    """Three springs of 20 kN/m that slip at 2, 6 and 12 N, one step after the other."""
    k, force, past = 2e4, np.zeros((3, len(x))), np.zeros(3)
    for i in range(1, len(x)):
        past = np.clip(past + k * (x[i] - x[i - 1]), [-2.0, -6.0, -12.0], [2.0, 6.0, 12.0])
        force[:, i] = past
    return np.asarray(force.sum(axis=0))


def test_an_iwan_law_is_fitted_without_a_start(tmp_path: Path) -> None:
    """What its elements add up to is told: the force at which all slip."""
    rng, t = np.random.default_rng(2), np.arange(4000) / RATE
    for k, amplitude in enumerate((2e-4, 6e-4, 2e-3)):
        x = amplitude * np.sin(2 * np.pi * t) + 0.3 * amplitude * np.sin(2 * np.pi * 2.3 * t)
        np.savez(tmp_path / f"run_{k}.npz", x=x, F=sliders(x) + 0.05 * rng.standard_normal(len(t)))
    (tmp_path / "slide.measurement.toml").write_text(
        f'schema = "jointlib/measurement/1"\nkind = "path"\nsample_rate = {RATE}\n'
        'channel = [ { name = "x", quantity = "displacement", unit = "m" }, { name = "F", quantity = "force", '
        'unit = "N" } ]\nrecord = [ { file = "run_0.npz" }, { file = "run_1.npz" }, { file = "run_2.npz" } ]\n'
    )
    found = identify([read_measurement(tmp_path / "slide.measurement.toml")], laws=("iwan",))
    slips = [p.value for name, p in found.parameters.items() if name.startswith("iwan.slip_force")]
    assert len(slips) == 4
    assert sum(slips) == pytest.approx(20, rel=0.05)
    assert found.errors[0].relative < 0.02


def test_a_table_without_a_start_is_refused_with_what_to_give(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="tabulated: no first values for its lists, expected a start joint"):
        identify([path(tmp_path)], laws=("tabulated",))
