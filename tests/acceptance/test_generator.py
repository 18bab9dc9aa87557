"""The generator of the acceptance suite obeys mechanics, checked by routes of its own."""

from __future__ import annotations

import ast
from pathlib import Path

import effects
import faults
import numpy as np
import pytest
from cells import CATALOGUE, GROUPS, LINEAR_THERE, MAKERS
from effects import ANGLE, COLOUR, KAPPA, PRELOAD, Maker, guide_stiffness, hertz_force
from excitation import PERIOD, RATE, SIGNALS, force
from generator import Array, Equation, Rig, by_mixture, by_steps, sampled, solve
from masing import backbone, masing
from measure import LEVELS, SETTLE, noise, simulate, write
from repeats import repeats
from scipy.integrate import solve_ivp

HERE = Path(__file__).parent
RIG = Rig()


def drive_of(peak: float, seed: int = 3) -> Array:
    """Two records of a multisine, eight points a sample, N."""
    rng = np.random.default_rng(seed)
    P = force(np.array([SIGNALS["MS"](rng) for _ in range(2)]), 1, 8)
    return np.asarray(P * peak / np.abs(P).max())


def cubic_rig(k3: float) -> Rig:
    return Rig(hidden=lambda z, v, t: k3 * z**3)


def test_it_shares_no_code_with_the_program() -> None:
    for path in HERE.glob("*.py"):
        if path.name.endswith(("table.py", "mills.py")) or path.name.startswith("test_"):  # these ask the program
            continue
        tree = ast.walk(ast.parse(path.read_text()))
        roots = {n.module or "" for n in tree if isinstance(n, ast.ImportFrom)}
        roots |= {a.name for n in ast.walk(ast.parse(path.read_text())) if isinstance(n, ast.Import) for a in n.names}
        assert not [r for r in roots if r.split(".")[0] in ("jointlib", "machines", "fmu")], path.name


def test_a_linear_rig_has_the_accelerance_of_two_free_masses() -> None:
    m = solve(RIG, drive_of(600.0), 1 / (8 * RATE))
    w = 2j * np.pi * np.arange(100, 401) * 20
    D = RIG.stiffness + w * RIG.damping
    # (m1 s² + D) x1 − D x2 = P, (M s² + D) x2 = D x1.
    M = RIG.m2 + RIG.m3
    x1 = (M * w**2 + D) / ((RIG.m1 * w**2 + D) * (M * w**2 + D) - D**2)
    x2 = D * x1 / (M * w**2 + D)
    P = np.fft.rfft(m.drive)[:, 100:401]
    for a, x in ((m.a1, x1), (m.a2, x2)):
        np.testing.assert_allclose(np.fft.rfft(a)[:, 100:401], w**2 * x * P, rtol=1e-9)


def test_a_hung_rig_has_the_accelerance_of_masses_on_springs() -> None:
    (k1, c1), (k2, c2) = cords = ((2e6, 300.0), (8e5, 90.0))
    rig = Rig(cords=cords)
    m = solve(rig, drive_of(600.0), 1 / (8 * RATE))
    P = np.fft.rfft(m.drive)
    M, C, K = (
        np.array([[a + b, -b], [-b, d + b]])
        for a, b, d in ((rig.m1, 0.0, rig.m2 + rig.m3), (c1, rig.damping, c2), (k1, rig.stiffness, k2))
    )
    for line in (100, 173, 400):
        w = 2j * np.pi * 20 * line
        x = np.linalg.solve(M * w**2 + C * w + K, [1.0, 0.0])
        for a, share in ((m.a1, x[0]), (m.a2, x[1])):
            np.testing.assert_allclose(np.fft.rfft(a)[:, line], w**2 * share * P[:, line], rtol=1e-9)


@pytest.mark.parametrize(
    "name",
    repeats(
        ["coulomb", "hysteresis", "gap", "structural-damping"],
        lambda name: name == "gap",
        lambda name: name == "structural-damping",
    ),
)
def test_the_steady_motion_obeys_newton_on_both_bodies(name: str) -> None:
    test = simulate(name, (MAKERS[name],), "MS", 1)
    a1, a2, P = (test.channels[c][:-1] for c in ("a1", "a2", "P"))
    balance = P - 0.942 * a1 - 2.2 * a2
    assert np.abs(balance).max() < 1e-9 * np.abs(P).max()


def test_the_motion_belongs_to_its_accelerations_and_force() -> None:
    rig = cubic_rig(0.05 * RIG.stiffness / (3e-6) ** 2)
    m = solve(rig, drive_of(600.0), 1 / (8 * RATE))
    omega = 2 * np.pi * 20 * np.arange(m.z.shape[1] // 2 + 1)
    relative = np.fft.rfft(m.a1 - m.a2)
    low = omega < 2 * np.pi * RATE / 2
    lack = np.abs(relative + omega**2 * np.fft.rfft(m.z))[:, low]
    assert lack.max() < 1e-9 * np.abs(relative).max()
    expected = rig.stiffness * m.z + rig.damping * m.v + rig.hidden(m.z, m.v, m.z[0])
    np.testing.assert_allclose(m.force, expected, atol=1e-9 * np.abs(expected).max())
    assert np.abs(rig.hidden(m.z, m.v, m.z[0])).max() > 0.01 * np.abs(m.force).max()


def test_an_adaptive_integrator_stays_on_the_periodic_motion() -> None:
    rig = cubic_rig(0.05 * RIG.stiffness / (3e-6) ** 2)
    m = solve(rig, drive_of(600.0)[:1], 1 / (8 * RATE))
    lines = np.fft.rfft(m.drive[0])[100:401] * 2 / m.drive.shape[1]
    omega = 2 * np.pi * 20 * np.arange(100, 401)

    def rate(t: float, y: Array) -> list[float]:
        P = float(np.real(np.sum(lines * np.exp(1j * omega * t))))
        f = rig.stiffness * y[0] + rig.damping * y[1] + float(rig.hidden(y[:1], y[1:], y[:1])[0])
        return [y[1], P / rig.m1 - rig.inverse_mass * f]

    until = 800
    t = np.arange(until) / (8 * RATE)
    y = solve_ivp(rate, (0, t[-1]), [m.z[0, 0], m.v[0, 0]], "DOP853", t, rtol=1e-9, atol=[1e-15, 1e-10])
    np.testing.assert_allclose(y.y[0], m.z[0, :until], atol=1e-7 * np.abs(m.z).max())


@pytest.mark.slow
def test_both_ways_lead_to_one_motion() -> None:
    rig = cubic_rig(0.05 * RIG.stiffness / (3e-6) ** 2)
    equation = Equation(rig, drive_of(600.0), 1 / (8 * RATE))
    one, other = by_mixture(equation), by_steps(equation, 4)
    np.testing.assert_allclose(one.z, other.z, atol=1e-9 * np.abs(one.z).max())


@pytest.mark.thorough
def test_a_masing_loop_encloses_its_area_and_remembers_turning_points() -> None:
    n, reach, p = 20000, 1.0, 2.0
    x = 5 * np.sin(2 * np.pi * np.arange(n) / n)[None]
    f = masing(x, reach, p)
    # Four times the area between backbone and chord, twice over: W = 8 ∫ g − 4 A g(A).
    s = np.linspace(0, 5, 20001)
    g = backbone(s, reach, p)
    area = 8 * float(np.sum((g[1:] + g[:-1]) / 2) * (s[1] - s[0])) - 4 * 5 * g[-1]
    work = float(np.sum(f[0] * (np.roll(x[0], -1) - np.roll(x[0], 1)) / 2))
    assert work == pytest.approx(area, rel=1e-4)
    # A small inner loop leaves the outer branch where it was.
    rise = np.linspace(-5, 5, 2001)
    inner = np.concatenate([rise[:1200], np.linspace(rise[1199], rise[999], 200)[1:], rise[1000:], -rise[1:]])
    plain = np.concatenate([rise, -rise[1:]])
    assert masing(inner[None], reach, p)[0][-2800:] == pytest.approx(masing(plain[None], reach, p)[0][-2800:], abs=1e-9)
    # Against a chain of sliders that are stepped: the density of their reaches is −g″.
    path = 2.5 * (np.sin(2 * np.pi * np.arange(n) / n) + 0.7 * np.sin(10 * np.pi * np.arange(n) / n))
    edges = np.linspace(0, 60, 3001)
    centre = (edges[1:] + edges[:-1]) / 2
    slope = np.gradient(backbone(edges, reach, p), edges)
    weight = slope[:-1] - slope[1:]
    q = np.zeros(len(centre))
    stepped_force = []
    for turn in range(2):
        for i in range(n):
            q = np.clip(q + path[i] - path[i - 1], -centre, centre)
            if turn:
                stepped_force.append(float(weight @ q + slope[-1] * path[i]))
    loop = masing(path[None], reach, p)[0]
    assert loop == pytest.approx(np.array(stepped_force), abs=5e-3)


def test_the_ball_guide_has_its_declared_stiffness_and_lifts_off() -> None:
    h = 1e-10
    slope = (hertz_force(np.array(h), PRELOAD, KAPPA, ANGLE) - hertz_force(np.array(-h), PRELOAD, KAPPA, ANGLE)) / (
        2 * h
    )
    assert slope == pytest.approx(guide_stiffness(PRELOAD), rel=1e-6)
    parted = KAPPA * PRELOAD ** (2 / 3) / np.sin(ANGLE)
    assert hertz_force(np.array(parted), PRELOAD, KAPPA, ANGLE) == pytest.approx(
        4 * np.sqrt(2) * PRELOAD * np.sin(ANGLE)
    )


def test_a_period_is_cut_off_exactly() -> None:
    t = np.arange(8 * 64) / (8 * 64)
    fine = np.cos(2 * np.pi * 5 * t) + np.cos(2 * np.pi * 40 * t)
    np.testing.assert_allclose(sampled(fine, 64), np.cos(2 * np.pi * 5 * t[::8]), atol=1e-12)


@pytest.mark.parametrize("channel", list(COLOUR))
def test_noise_has_its_strength_and_colour(channel: str) -> None:
    x = np.ones((len(LEVELS) + 1, 60000))
    n = noise(np.random.default_rng(1), x, COLOUR[channel], 40.0)
    assert n.std() == pytest.approx(1e-2, rel=0.02)
    assert np.mean(n[:, 1:] * n[:, :-1]) == pytest.approx(COLOUR[channel] * 1e-4, abs=2e-6)


def test_noise_that_grows_with_the_drive_is_at_rest_what_it_was(tmp_path: Path) -> None:
    sizes = []
    for name in ("nothing", "noise-with-drive"):
        (tmp_path / name).mkdir()
        test = simulate(name, (MAKERS[name],), "MS", 2)
        write(test, tmp_path / name, 40.0, name, 2)
        read = [np.load(tmp_path / name / f"r{r}.npz")["a1"] - test.channels["a1"][r] for r in (0, 2, 5)]
        sizes.append([x.std() / np.std(test.channels["a1"][2]) for x in read])
    (times, _) = test.truth.louder["a1"]
    calm, loud = np.array(sizes)
    assert loud / calm == pytest.approx(np.sqrt(1 + (times * np.array([LEVELS[0], LEVELS[2], 0.0])) ** 2), rel=0.03)


@pytest.mark.slow
def test_something_that_changes_along_the_record_is_no_period_but_repeats_nowhere_else() -> None:
    drifting = simulate("stiffness-drift", (effects.stiffness_drift,), "MS", 0)
    steady = simulate("cubic", (effects.cubic,), "MS", 0)
    for test, smallest, largest in ((steady, 0.0, 1e-9), (drifting, 1e-3, 0.2)):
        a = test.channels["a2"][0].reshape(-1, PERIOD)[SETTLE:]
        change = np.abs(a[1:] - a[:-1]).max() / np.abs(a).max()
        assert smallest <= change <= largest


def test_a_rocking_mode_moves_rail_and_block_apart_and_keeps_the_force() -> None:
    test = simulate("rocking-mode", (faults.rocking_mode,), "MS", 0)
    a2, a3, P, a1 = (test.channels[c][:-1] for c in ("a2", "a3", "P", "a1"))
    assert 0.05 < np.std(a2 - a3) / np.std(a2) < 0.15
    np.testing.assert_allclose(1.1 * (a2 + a3), P - 0.942 * a1, atol=1e-9 * np.abs(P).max())


@pytest.mark.parametrize("name", ["cubic", "quadratic", "contact-loss", "stribeck", "hysteresis-with-play"])
def test_effects_are_a_few_per_cent_of_the_peak_force(name: str) -> None:
    z = 3e-6 * np.sin(2 * np.pi * np.arange(4000) / 4000)[None]
    v = 3e-6 * 3e4 * np.cos(2 * np.pi * np.arange(4000) / 4000)[None]
    scale = effects.Scale(3e-6, 0.09, 0.03, 1962.0, 1, 0.3, np.zeros(1), 0.4)
    maker: Maker = MAKERS[name]
    for seed in range(5):
        made = maker(np.random.default_rng(seed), scale, 0.04)
        assert 0.02 < np.abs(made.hidden(z, v, z[0])).max() / scale.force < 0.07


def test_the_same_seed_gives_the_same_files_and_another_seed_others(tmp_path: Path) -> None:
    for folder, seed in (("a", 1), ("b", 1), ("c", 2)):
        (tmp_path / folder).mkdir()
        write(
            simulate("gain-carried", (MAKERS["gain-carried"],), "AM", seed),
            tmp_path / folder,
            40.0,
            "gain-carried",
            seed,
        )
    a, b, c = (np.load(tmp_path / folder / "r0.npz")["a2"] for folder in "abc")
    assert np.array_equal(a, b)
    assert not np.array_equal(a, c)


def test_every_cell_has_a_name_of_its_own_and_five_seeds_at_least() -> None:
    cells = [c for group, cells in GROUPS.items() if group != "quick" for c in cells]
    assert len({c.name for c in cells}) == len(cells)
    for name in CATALOGUE:
        signal = "MS" if name in LINEAR_THERE else "AM"
        assert len([c for c in GROUPS["main"] if (c.effect, c.signal, c.decibel) == (name, signal, 30.0)]) >= 5
    assert len(GROUPS["null"]) >= 300
