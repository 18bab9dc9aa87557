"""FRFs of structures that are not quite the same from record to record, under forces that vary or responses held."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from test_machine_trace import LINES, LOWER, MACHINE, UPPER, blank, chain

from jointlib import read_measurement
from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.law import JointLaw
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.cubic import Cubic
from jointlib.laws.linear import Linear
from jointlib.laws.quadratic_damping import QuadraticDamping
from jointlib.laws.viscous import Viscous
from jointlib.loop.answer.report import Verdict
from machines import Connection, Lumped, Machine
from machines.harmonic_balance.assembly import Assembly
from machines.harmonic_balance.balance import Balance
from machines.loop.judge import Judged, is_rival, preferred
from machines.loop.noise.deviation import local_slopes
from machines.loop.noise.drift import FREQUENCY, LEVEL, Drift
from machines.loop.records import LevelFRF, open_frfs
from machines.loop.trace import _said_of_lines, trace_frfs

RUBBING = chain(UPPER, Joint((*LOWER.laws, Coulomb(1.0, 2e-4))))
STIFFER = chain(Joint((Linear(3.3e7), Viscous(700.0))), LOWER)


def simulated(
    machine: Machine,
    drifts: Sequence[tuple[float, float]],
    seed: int,
    sag: float = 0.0,
    like: Sequence[LevelFRF] | None = None,
) -> list[LevelFRF]:
    """At the tool by harmonics 1, 3 and 5 at 50 dB; a record's own (δ, λ), the force lower by ``sag`` at 250 Hz."""
    rng, assembly = np.random.default_rng(seed), Assembly(machine, ("m0.x",), ("m0.x",))
    out = []
    for frf, (delta, level) in zip(blank("m0.x") if like is None else like, drifts, strict=True):
        profile = 1 - sag * np.exp(-(((frf.frequency - 250) / 80) ** 2))
        omega, F = 2 * np.pi * frf.frequency / (1 + delta), frf.force * profile
        view = assembly.at(omega)
        z: ComplexArray = np.zeros((len(omega), 3, len(assembly.nonlinear)), dtype=complex)
        z[:, 0] = Balance.of(assembly, omega, F, (1, 3, 5)).driven * F[:, None] * 0.02
        for share in np.linspace(0.02, 1.0, 12):
            balance = Balance.of(assembly, omega, share * F, (1, 3, 5))
            z, done = balance.settle(z)
        H = view.Hof[:, -1, 0] - (view.Hoz[:, -1] * balance.forces(z).force[:, 0]).sum(axis=1) / F
        H = (1 + level) * H
        sigma = np.sqrt(np.mean(np.abs(H) ** 2)) * 10 ** (-50 / 20)
        noise = (rng.standard_normal(len(H)) + 1j * rng.standard_normal(len(H))) / np.sqrt(2)
        deviation = np.full(len(H), sigma)
        whole = replace(frf, receptance=H + sigma * noise, deviation=deviation, forces=F if sag else None)
        assert like is not None or np.all(done)
        kept = {key: getattr(whole, key)[done] for key in ("frequency", "receptance", "deviation")}
        out.append(replace(whole, **kept) if like is not None else whole)
    return out


def drawn(seed: int, count: int = 3) -> list[tuple[float, float]]:
    """Drifts of records, with the deviations that are taken for usual."""
    rng = np.random.default_rng([seed, 5])
    return [(FREQUENCY * a, LEVEL * b) for a, b in rng.standard_normal((count, 2))]


def one_record(seed: int = 0) -> tuple[Array, ComplexArray, Array, Drift]:
    """A resonance, its noise, and its drift."""
    f = np.linspace(80.0, 120.0, 60)
    H = 1 / (1 - (f / 100) ** 2 + 0.03j)
    sigma = np.full(len(f), 1e-3)
    record = np.zeros(len(f), dtype=int)
    return f, H, sigma, Drift.of(f, H, record, record, sigma, np.zeros(1))


def test_slopes_are_those_of_the_response() -> None:
    """dH/df of one resonance in closed form; the fit through nine lines holds two."""
    f, H, _, _ = one_record()
    assert local_slopes(f, H) == pytest.approx(2 * f / 1e4 * H**2, rel=1e-6)


def test_a_white_residual_is_that_with_drift_fitted_under_its_prior() -> None:
    f, H, sigma, drift = one_record()
    rng = np.random.default_rng(1)
    error = rng.standard_normal(len(f)) + 1j * rng.standard_normal(len(f)) + 5 * H
    D = np.stack([LEVEL * H, -FREQUENCY * f * (2 * f / 1e4 * H**2)], axis=1) / sigma[:, None]
    A = np.concatenate([D.real, D.imag, np.eye(2)])
    b = np.concatenate([error.real, error.imag, np.zeros(2)])
    x, *_ = np.linalg.lstsq(A, b, rcond=None)
    white = drift.residual(error)
    assert np.sum(np.abs(white) ** 2) == pytest.approx(np.sum((b - A @ x) ** 2), rel=1e-6)
    assert drift.likeliest(white) == pytest.approx(np.array([[LEVEL * x[0], FREQUENCY * x[1]]]), rel=1e-5)
    assert drift.error(white) == pytest.approx(error, rel=1e-9)


def test_what_no_drift_explains_is_not_explained_by_drift() -> None:
    """A model that answers nothing keeps its error; inverse and slopes hold where the drift is at its bound."""
    f, H, sigma, drift = one_record()
    white = drift.residual(H / sigma)
    assert np.sum(np.abs(white) ** 2) > 0.9 * np.sum(np.abs(H / sigma) ** 2)
    assert drift.error(white) == pytest.approx(H / sigma, rel=1e-9)
    change = (1 + 1j * f / 100)[:, None]
    step = (drift.residual(H / sigma + 1e-4 * change[:, 0]) - white) / 1e-4
    assert drift.slopes(white, change)[:, 0] == pytest.approx(step, rel=1e-5)


def test_a_drift_that_is_taken_out_still_costs_what_it_is_worth() -> None:
    """Moved to 3 deviations, the loss is that of the unmoved record where first order holds."""
    f, _H, sigma, _drift = one_record()
    delta = 3 * FREQUENCY
    # One fifth of the half-power width: what is left of second order is a thousandth of the response.
    measured = 1 / (1 - (f / (1 + delta) / 100) ** 2 + 0.03j)
    record = np.zeros(len(f), dtype=int)
    there = f / (1 + delta)
    moved = Drift.of(there, measured, record, record, sigma, np.array([delta]))
    white = moved.residual((measured - 1 / (1 - (there / 100) ** 2 + 0.03j)) / sigma)
    assert np.sum(np.abs(white) ** 2) == pytest.approx(9.0, rel=0.02)
    assert moved.likeliest(white)[0, 1] == pytest.approx(delta, rel=0.02)


@pytest.mark.parametrize("seed", range(4))
def test_a_machine_that_only_drifts_lacks_nothing(seed: int) -> None:
    found = trace_frfs(simulated(MACHINE, drawn(seed), seed, sag=0.4), MACHINE)
    assert found.verdict is Verdict.NOTHING_MISSING, found.sentence


def test_a_large_drift_near_the_peak_lacks_nothing() -> None:
    found = trace_frfs(simulated(MACHINE, [(2.5e-3, 0.0), (-2e-3, 0.01), (3e-3, -0.02)], 9), MACHINE)
    assert found.verdict is Verdict.NOTHING_MISSING, found.sentence


def test_a_peak_narrower_than_its_drift_lacks_nothing() -> None:
    """One mass on a joint, Q = 2000 in closed form: the records drift by up to four half-power widths."""
    mass, omega = 2.0, 2 * np.pi * 120
    joint = Joint((Linear(mass * omega**2), Viscous(mass * omega / 2000)))
    parts = (Lumped("m0", ("x",), np.array([[mass]])), Lumped("g", ("x",), np.array([[1e9]])))
    machine = Machine(parts, (Connection("clamp", ("m0.x", "g.x"), joint),), tool={"x": "m0.x"})
    rng, lines, drifts = np.random.default_rng(4), 120 * (1 + np.linspace(-0.005, 0.005, 240)), (-0.65e-3, 2.06e-3, 0.0)
    frfs = []
    for frf, drift in zip(blank("m0.x", lines), drifts, strict=True):
        r = lines / (1 + drift) / 120
        H = 1 / (1 - r**2 + 1j * r / 2000) / (mass * omega**2)
        sigma = 0.004 * np.abs(H)
        noise = sigma * (rng.standard_normal(240) + 1j * rng.standard_normal(240)) / np.sqrt(2)
        frfs.append(replace(frf, receptance=H + noise, deviation=sigma))
    found = trace_frfs(frfs, machine)
    assert found.verdict is Verdict.NOTHING_MISSING, found.sentence
    told = [r["frequency"] for r in found.noise_floor["drift"]]
    assert told == pytest.approx(drifts, abs=1e-5)


def test_what_lies_beside_the_others_is_called_drift_where_nothing_else_is_left() -> None:
    floor = {"left_out": 0, "drift": [{"name": "r1", "frequency": 0.005, "level": -0.057}]}
    (sure,), (unsure,) = (_said_of_lines(floor, explained) for explained in (True, False))
    assert sure.endswith("beside those of the others; that is taken for drift from record to record.")
    assert unsure.endswith("; that may be what is still missing, or drift from record to record.")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("machine", "place", "families"),
    [pytest.param(RUBBING, "j1", {"coulomb"}, marks=pytest.mark.slow), (STIFFER, "j0", {"refit"})],
)
def test_an_effect_is_found_beside_the_drift_and_a_varying_force(
    machine: Machine, place: str, families: set[str]
) -> None:
    found = trace_frfs(simulated(machine, drawn(3), 3, sag=0.4), MACHINE)
    assert found.place == place, found.sentence
    named = {found.chosen.family} | {r.family for r in found.rivals if r.place == place}  # type: ignore[union-attr]
    assert named & families, found.sentence
    assert found.error_after["chi2"] < 3
    if machine is STIFFER:
        value = found.mended.joints()[0].parameters["linear.stiffness"]
        assert value == pytest.approx(3.3e7, rel=0.01)


@pytest.mark.slow
def test_the_force_of_each_line_counts() -> None:
    """A cubic joint at 60 % of the force it was said to have had: read with its column nothing is missing."""
    machine = chain(UPPER, Joint((Linear(6e7), Viscous(2500.0), Cubic(3e18))))
    frfs = simulated(machine, [(0.0, 0.0)] * 3, 2, sag=0.4)
    assert trace_frfs(frfs, machine).verdict is Verdict.NOTHING_MISSING
    assert trace_frfs([replace(f, forces=None) for f in frfs], machine).verdict is not Verdict.NOTHING_MISSING


@pytest.mark.slow
def test_a_beam_in_vacuum_that_stiffens_and_is_damped_more_as_it_moves() -> None:
    """Q is 2200, the records drift by four half-power widths, two effects at once: no name, but k(A) and c(A)."""
    k, omega, top = 142122.0, 2 * np.pi * 60, 1e-3
    c = omega / 2200

    def beam(*laws: JointLaw) -> Machine:
        ground = Lumped("g", ("x",), np.array([[1e6]]), np.array([[1e3]]), np.array([[1e8]]))
        parts = (Lumped("m0", ("x",), np.array([[1.0]])), ground)
        return Machine(parts, (Connection("clamp", ("m0.x", "g.x"), Joint(laws)),), tool={"x": "m0.x"})

    true = beam(Linear(k), Viscous(c), Cubic(0.02 * k / top**2), QuadraticDamping(2 * c / (top * omega)))
    lines = 60 * (1 + np.linspace(-0.004, 0.012, 160))
    like = blank("m0.x", lines, (2e-7 * k, 8e-7 * k, 2e-6 * k))
    frfs = simulated(true, [(-1.2e-3, 0.006), (0.7e-3, -0.008), (0.9e-3, -0.015)], 5, like=like)
    found = trace_frfs(frfs, beam(Linear(1.003 * k), Viscous(1.1 * c)))
    assert found.verdict is Verdict.PARTIAL, found.sentence
    assert found.chosen is not None
    assert found.chosen.family == "tabulated"
    assert "The nearest law, " in found.sentence
    assert found.error_after["relative"] < 0.05 < 1 < found.error_before["relative"]
    drift = {r["name"]: r["frequency"] for r in found.noise_floor["drift"]}
    first, second, third = drift.values()
    # What they have in common is the joint's stiffness.
    assert second - first == pytest.approx(1.9e-3, abs=1e-4)
    assert third - first == pytest.approx(2.1e-3, abs=1e-4)
    A = np.array([1e-4, 2e-4, 4e-4])
    told, truth = (m.joints()[0].first_harmonic(A, omega).gain for m in (found.mended, true))
    common = 2 * (drift[frfs[0].name] + 1.2e-3)
    assert told.real / truth.real - 1 + common == pytest.approx(np.zeros(3), abs=2e-4)
    assert told.imag == pytest.approx(truth.imag, rel=0.05)


def test_a_clearly_worse_effect_does_not_tie() -> None:
    """Both leave much beyond noise; the one that leaves three times as much is neither chosen nor a rival."""
    rng = np.random.default_rng(0)
    before = 100 * (rng.standard_normal(40) + 1j * rng.standard_normal(40))

    def explaining(share: float, size: int, family: str) -> Judged:
        rest = np.sqrt(1 - share) * (before if family == "coulomb" else before * np.exp(0.2j))
        place = SimpleNamespace(name="j")
        fitted = SimpleNamespace(
            residual=rest,
            loss=float(np.sum(np.abs(rest) ** 2)),
            u=np.zeros(size),
            hypothesis=SimpleNamespace(place=place, family=family),
            penalty=0.0,
        )
        return Judged(fitted, before, (), (), ())  # type: ignore[arg-type]

    better, worse = explaining(0.945, 4, "coulomb"), explaining(0.844, 2, "cubic")
    assert preferred([worse, better]) is better
    assert not is_rival(better, worse)
    near = explaining(0.9445, 2, "cubic")
    assert preferred([near, better]) is near


RECORD = """schema = "jointlib/measurement/1"
kind = "frf"
[[record]]
file = "a.csv"
drive = "m0.x"
response = "m0.x"
quantity = "receptance"
{held}
"""


def record(folder: Path, held: str, table: str | None = None, lines: int = 24) -> LevelFRF:
    f = np.linspace(50.0, 150.0, lines)
    H = 1e-6 / (1 - (f / 100) ** 2 + 0.1j)
    if table is None:
        np.savetxt(folder / "a.csv", np.column_stack([f, H.real, H.imag]), delimiter=",", header="f,re,im", comments="")
    else:
        (folder / "a.csv").write_text(table)
    (folder / "m.toml").write_text(RECORD.format(held=held))
    measurement = read_measurement(folder / "m.toml")
    return open_frfs(measurement, measurement.records)[0]


def test_a_held_response_gives_the_force_of_every_line(tmp_path: Path) -> None:
    frf = record(tmp_path, 'amplitude = "2 um"')
    assert frf.line_forces * np.abs(frf.receptance) == pytest.approx(np.full(24, 2e-6))
    assert frf.level == "2e-06 m"
    assert "to hold 2e-06 m" in frf.remarks[0]
    shaken = record(tmp_path, 'acceleration = "5 m/s^2"')
    omega = 2 * np.pi * shaken.frequency
    assert shaken.line_forces * np.abs(shaken.receptance) * omega**2 == pytest.approx(np.full(24, 5.0))


def test_a_force_column_is_read_in_its_unit(tmp_path: Path) -> None:
    f = np.linspace(50.0, 150.0, 24)
    rows = "\n".join(f"{x:g},1e-6,-1e-7,{0.5 + i / 100:g}" for i, x in enumerate(f))
    frf = record(tmp_path, 'force = "600 N"', f"frequency [Hz],real [m/N],imag [m/N],force [kN]\n{rows}\n")
    assert frf.line_forces == pytest.approx(500 + 10 * np.arange(24))
    assert frf.force == 600
    assert "the force varies from 500 to 730 N" in frf.remarks[0]


@pytest.mark.parametrize(
    ("held", "said"),
    [
        ("", "key 'force' is missing"),
        ('force = "5 N"\namplitude = "2 um"', "amplitude and force are given, expected the one that was held"),
        ('amplitude = "0 um"', "amplitude is 0 m, expected the peak of the response, more than 0"),
        ('acceleration = "2 N"', "acceleration"),
    ],
)
def test_what_was_held_is_said_once(tmp_path: Path, held: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        record(tmp_path, held)


def test_a_force_of_zero_on_a_line_is_refused(tmp_path: Path) -> None:
    rows = "\n".join(f"{x:g},1e-6,-1e-7,{i}" for i, x in enumerate(np.linspace(50.0, 150.0, 24)))
    with pytest.raises(InputError, match="the force must be finite, more than 0"):
        record(tmp_path, 'force = "6 N"', f"frequency [Hz],real [m/N],imag [m/N],force [N]\n{rows}\n")


def test_a_record_may_be_one_line_where_its_noise_is_known(tmp_path: Path) -> None:
    frf = record(tmp_path, 'force = "6 N"', "frequency [Hz],real [m/N],imag [m/N],deviation\n98,1e-6,-1e-6,2e-9\n")
    assert frf.frequency == pytest.approx([98.0])
    assert frf.deviation == pytest.approx([2e-9])
    with pytest.raises(InputError, match="1 lines above 0 Hz do not tell their noise, expected at least 16"):
        record(tmp_path, 'force = "6 N"', "frequency [Hz],real [m/N],imag [m/N]\n98,1e-6,-1e-6\n")


@pytest.mark.slow
def test_single_lines_at_many_forces_show_a_joint_that_hardens() -> None:
    """Dwells at one frequency under twelve forces beside one sweep: the cubic term comes from the dwells."""
    machine = chain(UPPER, Joint((Linear(6e7), Viscous(2500.0), Cubic(1e17))))
    sweep = simulated(machine, [(0.0, 0.0)], 6, like=blank("m0.x", LINES, (1.0,)))
    at = LINES[np.argmax(np.abs(sweep[0].receptance))] * 0.97
    dwells = blank("m0.x", np.array([at]), np.geomspace(2, 60, 12))
    frfs = [*sweep, *simulated(machine, [(0.0, 0.0)] * 12, 7, like=dwells)]
    found = trace_frfs(frfs, chain(UPPER, Joint((Linear(6e7), Viscous(2500.0)))))
    assert found.place == "j1", found.sentence
    assert found.chosen is not None
    assert found.chosen.family == "cubic", found.sentence
