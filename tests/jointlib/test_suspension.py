"""Bodies of a rig that are held to ground: found, declared, refused. All records are simulated."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from jointlib.corrections import joined
from jointlib.errors import InputError
from jointlib.io.measurement_file import read_measurement
from jointlib.joint import Joint
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from jointlib.loop.answer.report import TraceReport, Verdict
from jointlib.loop.balance.bodies import rig_of
from jointlib.loop.periodic.route import trace_periodic
from jointlib.measurement import Channel, Mass, Measurement, RecordSource

Array = NDArray[np.float64]
MASSES = {"block": 0.942, "rail": 1.1, "steel": 1.1}
K, C = 6e8, 520.0
RATE, PERIOD, PERIODS = 51200.0, 1280, 4
LEVELS = (0.4, 0.7, 1.0, 1.0)
"""The last one is sealed."""
SPRING, DAMPER = 9e5, 60.0
START = Joint((Linear(5.5e8), Viscous(400.0)), "guide")
FILE = """schema = "jointlib/measurement/1"
kind = "rig"
sample_rate = "1 kHz"
driven = "block"
[bodies]
block = 0.9
rail = { mass = 1.1, stiffness = "0.9 N/um", damping = 60.0 }
[[channel]]
name = "a1"
quantity = "acceleration"
body = "block"
[[channel]]
name = "a2"
quantity = "acceleration"
body = "rail"
[[record]]
file = "r.csv"
"""


def records(held: str, decibel: float, seed: int, band: tuple[float, float], damper: float) -> list[dict[str, Array]]:
    """M ẍ + C ẋ + K x = (P, 0), one line at a time; the body ``held`` hangs on a spring and a damper."""
    rng = np.random.default_rng(seed)
    frequency = np.fft.rfftfreq(PERIOD, 1 / RATE)
    lines = np.flatnonzero((frequency >= band[0]) & (frequency <= band[1]))
    w = 2 * np.pi * frequency[lines][:, None, None]
    between = np.array([[1.0, -1.0], [-1.0, 1.0]])
    to_ground = np.diag([1.0, 0.0] if held == "block" else [0.0, 1.0])
    M = np.diag([MASSES["block"], MASSES["rail"] + MASSES["steel"]])
    dynamic = K * between + SPRING * to_ground + 1j * w * (C * between + damper * to_ground) - w**2 * M
    out = []
    for level in LEVELS:
        P = level * np.exp(2j * np.pi * rng.random(len(lines)))
        x = np.linalg.solve(dynamic, np.stack([P, 0 * P], axis=-1)[..., None])[..., 0]
        a = -(w[:, :, 0] ** 2) * x
        record = {}
        for name, X in {"a1": a[:, 0], "a2": a[:, 1], "a3": a[:, 1], "P": P}.items():
            spectrum = np.zeros(len(frequency), dtype=complex)
            spectrum[lines] = X * PERIOD
            clean = np.tile(np.fft.irfft(spectrum, PERIOD), PERIODS)
            record[name] = clean + clean.std() * 10 ** (-decibel / 20) * rng.standard_normal(len(clean))
        out.append(record)
    return out


def measured(
    folder: Path,
    held: str,
    decibel: float,
    seed: int,
    *,
    band: tuple[float, float] = (2000.0, 8000.0),
    damper: float = DAMPER,
    **bodies: Mass,
) -> Measurement:
    bodies_of = {"a1": "block", "a2": "rail", "a3": "steel", "P": None}
    units = {name: ("acceleration", "m/s^2") if body else ("force", "N") for name, body in bodies_of.items()}
    channels = tuple(Channel(n, *units[n], units[n][1], 1.0, body) for n, body in bodies_of.items())
    sources = []
    for i, data in enumerate(records(held, decibel, seed, band, damper)):
        np.savez(folder / f"r{i}.npz", allow_pickle=False, **data)
        role = "sealed" if i == len(LEVELS) - 1 else "fit"
        sources.append(RecordSource(folder / f"r{i}.npz", role, condition=f"level {LEVELS[i]:g}"))
    return Measurement(
        source=folder / "rig.measurement.toml",
        kind="rig",
        channels=channels,
        records=tuple(sources),
        sample_rate=RATE,
        period=PERIOD,
        driven="block",
        bodies={**{name: Mass(m) for name, m in MASSES.items()}, **bodies},
    )


def off(report: TraceReport) -> dict[str, float]:
    """Errors of the suspension that was found, in its standard errors."""
    assert report.chosen is not None
    truth = {"stiffness": SPRING, "damping": DAMPER}
    return {n: (p.value - truth[n]) / p.standard_error for n, p in report.chosen.parameters.items()}


@pytest.mark.slow
@pytest.mark.parametrize("body", ["block", "rail"])
def test_a_body_held_to_ground_is_named_with_stiffness_and_damping(tmp_path: Path, body: str) -> None:
    report = trace_periodic(measured(tmp_path, body, 60.0, 3), START)
    assert report.verdict is Verdict.IDENTIFIED, report.sentence
    assert report.chosen is not None
    assert (report.chosen.family, report.chosen.body) == ("suspension", body)
    assert max(map(abs, off(report).values())) < 4
    assert f"that {body} is held to ground" in report.sentence
    assert "N s/m" in report.sentence
    (correction,) = report.corrections
    assert (correction.family, correction.body) == ("suspension", body)
    assert report.error_after["balance_N"] < 1.1 * report.error_after["balance_floor_N"]
    assert report.mended.parameters["linear.stiffness"] == pytest.approx(K, rel=1e-3)


@pytest.mark.thorough
@pytest.mark.parametrize("body", ["block", "rail"])
def test_a_declared_suspension_leaves_nothing_missing(tmp_path: Path, body: str) -> None:
    held = {body: Mass(MASSES[body], 0.0, SPRING, DAMPER)}
    report = trace_periodic(measured(tmp_path, body, 60.0, 3, **held), START)
    assert report.verdict is Verdict.NOTHING_MISSING, report.sentence
    assert report.error_before["chi2"] == pytest.approx(1.0, abs=0.05)
    for channel in report.resimulation.values():
        before = channel["before"]
        assert before is not None
        assert before < 3e-3


@pytest.mark.slow
def test_what_is_declared_too_much_is_taken_back(tmp_path: Path) -> None:
    held = {"rail": Mass(MASSES["rail"], 0.0, 2 * SPRING, 2 * DAMPER)}
    report = trace_periodic(measured(tmp_path, "rail", 60.0, 4, **held), START)
    assert report.chosen is not None
    assert report.chosen.family == "suspension"
    assert report.chosen.parameters["stiffness"].value == pytest.approx(-SPRING, rel=0.05)


@pytest.mark.slow
def test_where_a_narrow_band_cannot_tell_it_from_a_mass_both_stay(tmp_path: Path) -> None:
    """On one line −k/ω² of a spring and a mass that is too small are one."""
    report = trace_periodic(measured(tmp_path, "rail", 50.0, 5, band=(4600.0, 5000.0), damper=0.0), START)
    assert report.verdict is Verdict.AMBIGUOUS, report.sentence
    assert report.chosen is not None
    assert {"suspension", "missing-mass"} <= {report.chosen.family, *(r.family for r in report.rivals)}


def declared(rail: Mass) -> Measurement:
    channels = tuple(Channel(n, "acceleration", "m/s^2", "m/s^2", 1.0, b) for n, b in (("a1", "block"), ("a2", "rail")))
    return Measurement(Path("m"), "rig", channels, (), driven="block", bodies={"block": Mass(0.9), "rail": rail})


def test_both_sensors_on_one_body_share_its_suspension() -> None:
    m = declared(Mass(2.0, 0.0, 8e5, 30.0))
    both = replace(m, channels=(*m.channels, replace(m.channels[1], name="a3")))
    assert rig_of(both).suspensions == {"a1": (0.0, 0.0), "a2": (4e5, 15.0), "a3": (4e5, 15.0)}
    assert rig_of(m).suspensions == {"a1": (0.0, 0.0), "a2": (8e5, 30.0)}


def written(folder: Path, text: str) -> Path:
    path = folder / "m.toml"
    path.write_text(text)
    return path


def test_a_file_declares_it_and_a_correction_adds_to_it(tmp_path: Path) -> None:
    held = read_measurement(written(tmp_path, FILE)).bodies["rail"]
    assert (held.value, held.stiffness, held.damping) == pytest.approx((1.1, 9e5, 60.0))
    further = '[[correction]]\nfamily = "suspension"\nbody = "rail"\nstiffness = "-0.1 N/um"\ndamping = 5.0\n'
    m = read_measurement(written(tmp_path, FILE + further))
    assert (m.bodies["rail"].stiffness, m.bodies["rail"].damping) == pytest.approx((8e5, 65.0))
    (together,) = joined("rig", m.corrections, m.corrections)
    assert together.parameters == pytest.approx({"stiffness": -2e5, "damping": 10.0})


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("damping = 60.0", "damping = -1.0", "rail is held to ground by 900000 N/m and -1 N s/m, expected 0 or more"),
        ('stiffness = "0.9 N/um"', 'stiffness = "-0.9 N/um"', "rail is held to ground by -900000 N/m and 60 N s/m"),
        ("damping = 60.0", "damper = 60.0", "damper"),
        (
            "[[record]]",
            '[[correction]]\nfamily = "suspension"\nbody = "rail"\nstiffness = -1e6\ndamping = -90\n[[record]]',
            "'rail' would be held by -100000 N/m and -30 N s/m",
        ),
    ],
)
def test_what_cannot_be_is_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_measurement(written(tmp_path, FILE.replace(old, new)))
