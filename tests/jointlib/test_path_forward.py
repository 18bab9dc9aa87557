"""A model found along a path, run forward under the measured force alone; all records here are simulated."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import make_interp_spline

from jointlib.arrays import Array
from jointlib.joint import Joint
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from jointlib.loop.answer.report import TraceReport
from jointlib.loop.path.forward import free_run
from jointlib.loop.path.preparation import Preparation, finer, prepare
from jointlib.loop.trace import trace
from jointlib.measurement import Channel, Mass, Measurement, Record, RecordSource

RATE, MASS, DAMPING, STIFFNESS, CUBIC = 500.0, 2.0, 30.0, 4e4, 1.5e9
START = Joint((Linear(3e4), Viscous(10.0)))


def oscillator(seed: int, level: float, samples: int = 3000) -> dict[str, Array]:
    """A hardening oscillator under random lines up to 40 Hz, integrated with an adaptive method of order 8."""
    rng = np.random.default_rng(seed)
    t = np.arange(samples) / RATE
    lines = np.arange(1.0, 40.0, 0.5)
    phases = rng.uniform(0, 2 * np.pi, len(lines))
    force = level * np.cos(2 * np.pi * lines[:, None] * t + phases[:, None]).sum(axis=0)
    drive = make_interp_spline(t, force, k=5)

    def rate(time: float, state: Array) -> Array:
        z, v = state
        return np.array([v, (drive(time) - DAMPING * v - STIFFNESS * z - CUBIC * z**3) / MASS])

    solved = solve_ivp(rate, (0, t[-1]), [0.0, 0.0], method="DOP853", t_eval=t, rtol=1e-9, atol=1e-12)
    return {"z": np.asarray(solved.y[0]), "F": force}


def measurement(folder: Path, carriage: Mass | None, **files: tuple[dict[str, Array], str]) -> Measurement:
    records = []
    for name, (columns, role) in files.items():
        np.savez(folder / f"{name}.npz", allow_pickle=False, **columns)
        records.append(RecordSource(folder / f"{name}.npz", role, condition=name))
    channels = Channel("z", "displacement", "m", "m", 1.0), Channel("F", "force", "N", "N", 1.0)
    return Measurement(folder / "m.toml", "path", channels, tuple(records), sample_rate=RATE, carriage=carriage)


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> TraceReport:
    files = {f"r{i}": (oscillator(i, level), "fit") for i, level in enumerate((1.0, 1.5, 2.0))}
    m = measurement(tmp_path_factory.mktemp("free"), Mass(None), **files, kept=(oscillator(9, 2.2), "sealed"))
    return trace(m, START)


@pytest.mark.slow
def test_the_free_run_falls_with_the_term_that_was_missing(report: TraceReport) -> None:
    assert report.chosen is not None
    assert report.chosen.family == "cubic"
    assert report.mended.parameters["cubic.stiffness3"] == pytest.approx(CUBIC, rel=0.02)
    for where in ("displacement", "displacement_sealed"):
        run = report.resimulation[where]
        assert run["before"] > 0.1
        assert run["after"] < 0.02


@pytest.mark.slow
def test_the_linear_run_is_the_convolution_with_the_impulse_response(tmp_path: Path) -> None:
    """Runge–Kutta against the transfer function of the same oscillator over one period of a steady state."""
    n, joint = 2000, Joint((Linear(STIFFNESS), Viscous(DAMPING)))
    lines = np.fft.rfftfreq(n, 1 / RATE)
    rng = np.random.default_rng(2)
    spectrum = np.where((lines > 0) & (lines < 40), np.exp(2j * np.pi * rng.random(len(lines))), 0)
    omega = 2 * np.pi * lines
    response = spectrum / (STIFFNESS - MASS * omega**2 + 1j * omega * DAMPING)
    z, F = (np.tile(np.fft.irfft(x, n), 3) for x in (response, spectrum))
    m = measurement(tmp_path, Mass(MASS), r=({"z": z, "F": F}, "fit"))
    preparation = Preparation(RATE, 200.0, 100, 1, "spectral", "")
    run = prepare(m, Record(m.records[0], {"z": z, "F": F}, RATE, None, ""), preparation)
    found = free_run([run], joint, MASS, 0.0)[0]
    expected = z[run.begin : run.begin + len(found)]
    assert found == pytest.approx(expected, abs=2e-3 * float(np.max(np.abs(z))))


@pytest.mark.slow
def test_an_offset_of_the_force_moves_nothing(tmp_path: Path) -> None:
    record = oscillator(3, 1.0)
    lifted = {**record, "F": record["F"] + 7.0}
    m = measurement(tmp_path, Mass(MASS), r=(lifted, "fit"))
    preparation = Preparation(RATE, 200.0, 100, 1, "spectral", "")
    plain, high = (prepare(m, Record(m.records[0], c, RATE, None, ""), preparation) for c in (record, lifted))
    joint = Joint((Linear(STIFFNESS), Viscous(DAMPING)))
    apart = free_run([plain], joint, MASS, 0.0)[0] - free_run([high], joint, MASS, 7.0)[0]
    assert np.max(np.abs(apart)) < 1e-9 * np.max(np.abs(record["z"])) + 1e-12


def test_between_the_samples_a_force_is_band_limited() -> None:
    t, factor = np.arange(400) / RATE, 8
    dense = np.arange((len(t) - 1) * factor + 1) / (factor * RATE)
    wave = [np.sin(2 * np.pi * 60 * x) * np.exp(-(((x - 0.4) / 0.1) ** 2)) for x in (t, dense)]
    assert finer(wave[0], factor) == pytest.approx(wave[1], abs=1e-6)


@pytest.mark.thorough
def test_without_inertia_the_force_along_the_path_is_the_prediction(tmp_path: Path) -> None:
    t = np.arange(0, 12, 1 / RATE)
    rng = np.random.default_rng(0)
    files = {}
    for i, amplitude in enumerate((0.5e-3, 1e-3)):
        z = amplitude * np.sin(2 * np.pi * t)
        files[f"r{i}"] = {"z": z, "F": 1e5 * z + 1e11 * z**3 + rng.standard_normal(len(t))}, "fit"
    report = trace(measurement(tmp_path, None, **files), Joint((Linear(1e5),)))
    row = report.resimulation["force"]
    assert row["before"] == report.error_before["in_sample"]
    assert row["after"] == report.error_after["in_sample"]
    assert "no inertia" in row["reason"]
