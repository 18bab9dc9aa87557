"""The generator of machine records obeys mechanics, checked by an adaptive integrator and by receptance coupling."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import machine_steps
import numpy as np
import pytest
from machine_forces import HIDDEN, Array, Term, first_harmonic
from machine_records import Case, draw, machine_file, measure, write
from machine_steps import Structure, first_harmonics
from scipy.integrate import solve_ivp

from jointlib.io.measurement_file import read_measurement
from machines import Newton, read_machine, response
from machines.loop.records import read_frfs

# Seeds whose cases are small: a chain with everything declared, a rocking slide, one with each kind of hidden force.
CHAIN, ROCKING = 0, 2


def few(case: Case, lines: int = 6, forces: int = 2) -> Case:
    """The same case on a few lines, the largest forces."""
    pick = np.linspace(0, len(case.frequency) - 1, lines).astype(int)
    return replace(case, frequency=case.frequency[pick], forces=case.forces[-forces:], sealed=None)


def settled(s: Structure, omega: float, force: float, periods: float, start: Array) -> complex:
    """First harmonic along the drive after a run with a step that adapts itself."""
    n = len(s.mass)
    inverse = np.linalg.inv(s.mass)
    none = np.zeros((0, 1))

    def rate(t: float, y: Array) -> Array:
        x, v = y[:n], y[n:]
        z, w = s.rows @ x, s.rows @ v
        f = np.array(
            [sum(float(q.force(z[j : j + 1], w[j : j + 1], none)[0]) for q in s.terms[j]) for j in range(len(z))]
        )
        return np.concatenate(
            [v, inverse @ (s.drive * force * np.cos(omega * t) - s.stiffness @ x - s.damping @ v - s.rows.T @ f)]
        )

    period = 2 * np.pi / omega
    t = (periods + np.arange(512) / 512) * period
    y = solve_ivp(rate, (0, t[-1]), start, "DOP853", t, rtol=1e-9, atol=1e-15)
    return complex(2 / 512 * (s.drive @ y.y[:n]) @ np.exp(-2j * np.pi * np.arange(512) / 512))


@pytest.mark.slow
@pytest.mark.parametrize("seed", [pytest.param(CHAIN, marks=pytest.mark.slow), ROCKING])
def test_an_adaptive_integrator_settles_to_the_same_motion(seed: int) -> None:
    case = few(draw(seed), 5, 1)
    s = case.actual.structure()
    omega = 2 * np.pi * case.frequency[2]
    x, repeats = first_harmonics(s, np.array([omega]), case.forces)
    assert repeats < 1e-6
    found = settled(s, omega, float(case.forces[0]), 160, np.zeros(2 * len(s.mass)))
    assert complex(s.drive @ x[0, 0]) == pytest.approx(found, rel=2e-3)


@pytest.mark.thorough
@pytest.mark.parametrize("seed", [CHAIN, ROCKING, 1, 9])
def test_where_nothing_is_altered_receptance_coupling_agrees_within_its_own_estimate(seed: int, tmp_path: Path) -> None:
    case = draw(seed, altered=False)
    case = replace(case, frequency=case.frequency[::6], forces=case.forces[[0, -1]], sealed=None)
    path = tmp_path / "machine.toml"
    path.write_text(machine_file(case.declared, case))
    records = measure(case)
    found = response(read_machine(path), case.forces, case.frequency, method=Newton(), outputs=case.responses)
    for level in range(2):
        (branch,) = found.branches[level]
        ours = branch.output[:, 0] / case.forces[level]
        apart = np.abs(ours - records.exact[level, :, 0]) / np.abs(ours)
        assert np.all(apart < 3 * branch.error + 1e-4), float(np.max(apart / (branch.error + 1e-5)))


@pytest.mark.slow
def test_an_alteration_changes_the_responses_by_more_than_the_noise() -> None:
    for seed in range(6):
        case = draw(seed)
        plain = draw(seed, altered=False)
        assert case.place in [j.name for j in case.declared.joints]
        assert case.change > 0.05
        assert machine_file(case.declared, case) == machine_file(plain.declared, plain)


@pytest.mark.parametrize("name", HIDDEN)
def test_hidden_forces_have_their_size_and_take_energy(name: str) -> None:
    A, omega = 2e-6, 900.0
    term = HIDDEN[name](30.0, A, A * omega, np.random.default_rng(4))
    theta = 2 * np.pi * np.arange(4000) / 4000
    z, v = A * np.cos(theta), -A * omega * np.sin(theta)
    at = np.zeros((len(term.springs), 1))
    f = np.empty(4000)
    for _ in range(2):
        for i in range(4000):
            f[i] = term.force(z[i : i + 1], v[i : i + 1], at)[0]
            at = term.carried(z[i : i + 1], at)
    assert 0.7 * 30.0 < np.max(np.abs(f)) < 1.4 * 30.0
    work = float(np.sum(f * v)) * 2 * np.pi / omega / 4000
    assert work > -1e-9 * 30.0 * A
    direct = 2 / 4000 * np.sum(f * np.exp(-1j * theta)) / A
    G = first_harmonic((term,), np.array([A]), np.array([omega]))[0]
    assert pytest.approx(direct, rel=0.02) == G


def test_stuck_sliders_are_springs() -> None:
    term = Term(springs=np.array([2e6, 3e6]), slips=np.array([10.0, 50.0]))
    at = np.zeros((2, 1))
    z = np.array([1e-6])
    assert term.force(z, z, at)[0] == pytest.approx(5.0)
    assert term.carried(z, at) == pytest.approx(at)


@pytest.mark.slow
def test_a_hardening_oscillator_keeps_its_branch_up_to_the_jump() -> None:
    # One mass whose spring hardens: a sweep up stays on the upper branch and falls once.
    m, k, c, k3 = 10.0, 1e7, 200.0, 3e16
    s = Structure(*(np.array([[q]]) for q in (m, c, k)), np.eye(1), ((Term(lambda z, v: k3 * z**3),),), np.ones(1))
    omega = np.linspace(0.95, 1.25, 121) * np.sqrt(k / m)
    x, _ = first_harmonics(s, omega, np.array([12.0]))
    A = np.abs(x[0, :, 0])
    drops = np.flatnonzero(np.diff(A) < -0.35 * A[:-1])
    assert len(drops) == 1
    assert np.all(np.diff(A[: drops[0] + 1]) > 0)
    # The jump comes no later than the upper branch lasts: backbone ω² = (k + 3/4 k3 A²)/m, peak A = F/(c ω).
    last = np.sqrt((k + 0.75 * k3 * A[drops[0]] ** 2) / m)
    assert omega[drops[0]] <= last * 1.01


@pytest.mark.slow
def test_files_are_read_and_their_noise_is_what_was_added(tmp_path: Path) -> None:
    case = draw(CHAIN)
    case = replace(case, forces=case.forces[-2:], sealed=1)
    records = measure(case)
    machine, measurement = write(case, records, tmp_path)
    frfs = read_frfs(read_measurement(measurement), read_machine(machine))
    assert [f.sealed for f in frfs] == [False] * len(case.responses) + [True] * len(case.responses)
    for i, frf in enumerate(frfs):
        level, r = divmod(i, len(case.responses))
        assert frf.force == case.forces[level]
        np.testing.assert_allclose(frf.receptance, records.noisy[level, :, r], rtol=1e-8)
        assert np.mean(frf.deviation) == pytest.approx(records.deviation[level, r], rel=0.25)
    noise = records.noisy - records.exact
    share = np.sqrt(np.mean(np.abs(noise) ** 2)) / np.sqrt(np.mean(np.abs(records.exact) ** 2))
    assert share == pytest.approx(0.01, rel=0.15)


@pytest.mark.slow
def test_steps_are_fine_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    case = few(draw(ROCKING), 6, 1)
    coarse = measure(case).exact
    steps = machine_steps._steps_for
    monkeypatch.setattr(machine_steps, "_steps_for", lambda s, omega: 2 * steps(s, omega))
    np.testing.assert_allclose(coarse, measure(case).exact, rtol=2e-4)


@pytest.mark.slow
def test_the_same_seed_gives_the_same_records() -> None:
    a, b = (measure(few(draw(CHAIN), 4, 1)).noisy for _ in range(2))
    assert np.array_equal(a, b)
