"""A blank taken off an assembly leaves the spindle: closed forms, random assemblies, noise, tools never measured."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from repeats import repeats
from spectral_beams import BAR, LINES, Bar, in_spindle, noisy, receptance, spindle, write

import machines
from jointlib.arrays import Array, ComplexArray
from machines import Beam, Material, Segment
from machines.uncoupling.end_receptance import Hits, parts_of, taken_off
from machines.uncoupling.estimated_end import EstimatedEnd, estimated_end

LIBRARY = Path(machines.__file__).parent / "library"
STEEL = Material("steel", 210e9, 0.3, 7850.0, viscous=2e-7)
CUTTER = (Bar(0.03, 0.009), Bar(0.03, 0.012))
"""A tool that was never in the spindle."""


def free(bars: tuple[Bar, ...], lines: Array) -> ComplexArray:
    """The free blank from its tip to its face, by closed form."""
    return receptance(bars, {}, lines)


def hits(
    bars: tuple[Bar, ...], lines: Array, S: ComplexArray | None, decibels: float | None = None, seed: int = 0
) -> Hits:
    """Tip and places behind it, hit and sensed, in closed form; with ``S`` coupled to that end, else in the spindle."""
    R, n = free(bars, lines), len(bars)
    pairs = [(o, d) for o in range(n) for d in range(o + 1)]
    at = [2 * o for o in range(n)]
    end = R[:, 2 * n :, 2 * n :]
    side = np.array([R[:, k, 2 * n :] for k in at])
    plain = np.array([R[:, at[o], at[d]] for o, d in pairs])
    moves, driven = (np.array([side[pair[k]] for pair in pairs]) for k in (0, 1))
    made = Hits(plain, np.ones(plain.shape), plain, moves, driven, end)
    if S is None:
        H = in_spindle(bars, lines)
        G = np.array([H[:, o, d] for o, d in pairs])
    else:
        G = made.coupled(S)
    deviation = 1e-13 * np.abs(G)
    if decibels is not None:
        G, deviation = noisy(G, decibels, np.random.default_rng(seed))
    return Hits(G, deviation, plain, moves, driven, end)


def tip_of(bars: tuple[Bar, ...], lines: Array, S: ComplexArray) -> ComplexArray:
    """Receptance at the tip of a tool on a spindle with this end."""
    return hits(bars, lines, S).assembly[0]


def depth(H: ComplexArray) -> float:
    """Lowest stable depth in m of a cut of 700 N/mm² along one direction, −1/(2 Ks min Re H)."""
    return float(-1 / (2 * 7e8 * np.min(H.real)))


def covered(end: EstimatedEnd, S: ComplexArray) -> Array:
    """Which parts of the end lie within two stated errors, line by line."""
    return np.asarray(np.abs(parts_of(end.receptance - S)) < 2 * np.sqrt(parts_of(end.variance + 0j).real))


@pytest.mark.parametrize("end", range(4))
def test_a_free_beam_has_the_closed_form_at_every_end_deflection_and_rotation(end: int) -> None:
    lines = np.linspace(200.0, 6000.0, 80)
    bars = (Bar(0.11, 0.02), Bar(0.07, 0.035))
    segments = tuple(Segment(bar.length, STEEL, bar.diameter) for bar in bars)
    beam = Beam("b", segments, {"a": 0.0, "b": 0.18}, axis=np.array([0, 0, 1.0]))
    names = ["a.x", "a.ry", "b.x", "b.ry"]
    at = [beam.dofs.index(name) for name in names]
    H = beam.receptance(2 * np.pi * lines)[:, at][:, :, at]
    exact = free(bars, lines)[:, [0, 1, 4, 5]][:, :, [0, 1, 4, 5]]
    assert np.max(np.abs(H - exact)[:, end] / np.linalg.norm(exact[:, end], axis=1)[:, None]) < 1e-6


def random_end(lines: Array, random: np.random.Generator) -> ComplexArray:
    """A spindle of five modes and what lies above them."""
    omega, w = 2 * np.pi * lines[:, None, None], 2 * np.pi * random.uniform(300, 3800, 5)
    shape = random.standard_normal((5, 2)) * random.uniform(0.1, 0.5, 5)[:, None] * np.array([1.0, 8.0])
    zeta = random.uniform(0.02, 0.06, 5)
    S = np.tile(np.diag([4e-9, 4e-7]).astype(complex), (len(lines), 1, 1))
    for phi, wr, z in zip(shape, w, zeta, strict=True):
        S = S + np.outer(phi, phi) / (wr**2 - omega**2 + 2j * z * wr * omega)
    return S


def random_blank(random: np.random.Generator) -> tuple[Bar, ...]:
    diameter = random.uniform(0.035, 0.05)
    return Bar(random.uniform(0.03, 0.05), diameter), Bar(random.uniform(0.01, 0.03), diameter)


def test_sixty_random_assemblies_come_apart_exactly_and_together_again() -> None:
    lines = np.linspace(300.0, 4000.0, 120)
    for seed in range(60):
        random = np.random.default_rng(seed)
        S, blank = random_end(lines, random), random_blank(random)
        measured = hits(blank, lines, S)
        found = estimated_end(lines, [measured], 0.06)
        size = np.linalg.norm(S, axis=(1, 2))
        assert np.max(np.linalg.norm(found.receptance - S, axis=(1, 2)) / size) < 1e-8, seed
        back = measured.coupled(found.receptance)
        assert np.max(np.abs(back - measured.assembly) / np.abs(measured.assembly)) < 1e-10, seed


@pytest.mark.slow
@pytest.mark.parametrize(("decibels", "seeds"), [(60.0, 3), pytest.param(40.0, 3, marks=pytest.mark.thorough)])
def test_random_assemblies_with_noise_lie_in_the_stated_band(decibels: float, seeds: int) -> None:
    _in_band(decibels, range(seeds), 0.93)


@pytest.mark.slow
@pytest.mark.parametrize("decibels", [60.0, 40.0])
def test_sixty_random_assemblies_with_noise_lie_in_the_stated_band(decibels: float) -> None:
    _in_band(decibels, range(60), 0.95)


def _in_band(decibels: float, seeds: range, share: float) -> None:
    lines = np.linspace(300.0, 4000.0, 371)
    inside = []
    for seed in seeds:
        random = np.random.default_rng(seed)
        S, blank = random_end(lines, random), random_blank(random)
        found = estimated_end(lines, [hits(blank, lines, S, decibels, seed)], 0.06)
        inside.append(covered(found, S))
        again = hits(blank, lines, S, decibels, seed)
        off = np.abs(again.coupled(found.receptance) - again.assembly) / again.deviation
        assert np.mean(off[:, ~found.weak] < 4) > 0.95
    assert np.mean(inside) > share


@pytest.mark.thorough
def test_a_line_that_tells_nothing_of_the_rotation_says_so() -> None:
    slender = (Bar(0.01, 0.02), Bar(0.09, 0.02))
    found = estimated_end(LINES, [hits(slender, LINES, None, 40.0)], 0.1)
    stubby = estimated_end(LINES, [hits(BAR, LINES, None, 60.0)], 0.06)
    assert np.mean(found.weak) > 0.5
    assert not np.any(stubby.weak)
    assert np.median(found.doubt) > 10 * np.median(stubby.doubt)


@pytest.mark.slow
def test_a_tool_never_measured_is_predicted_within_five_per_cent_of_depth() -> None:
    true = in_spindle(CUTTER, LINES)[:, 0, 0]
    off = []
    for seed in range(3):
        found = estimated_end(LINES, [hits(BAR, LINES, None, 60.0, seed)], 0.06)
        H = tip_of(CUTTER, LINES, found.receptance)
        off.append(depth(H) / depth(true) - 1)
        peak, known = (LINES[np.argmax(np.abs(each))] for each in (H, true))
        assert abs(peak - known) <= 10.0
    assert np.max(np.abs(off)) < 0.02


@pytest.mark.parametrize("offset", repeats([0.01, 0.02, 0.04, 0.06], lambda offset: offset == 0.02))
def test_rotations_from_places_ten_to_sixty_millimetres_apart_predict_within_ten_per_cent(offset: float) -> None:
    blank = (Bar(offset, 0.045), Bar(0.065 - offset, 0.045))
    true = in_spindle(CUTTER, LINES)[:, 0, 0]
    for seed in range(2):
        found = estimated_end(LINES, [hits(blank, LINES, None, 60.0, seed)], 0.065)
        assert depth(tip_of(CUTTER, LINES, found.receptance)) == pytest.approx(depth(true), rel=0.05)


@pytest.mark.slow
def test_several_blanks_tell_more_than_each_alone() -> None:
    other = (Bar(0.05, 0.03), Bar(0.04, 0.03))
    measured = [hits(BAR, LINES, None, 50.0, 1), hits(other, LINES, None, 50.0, 2)]
    S = spindle(LINES)
    alone = [estimated_end(LINES, [each], 0.06) for each in measured]
    both = estimated_end(LINES, measured, 0.06)
    size = np.sqrt(np.abs(S[:, 0, 0]) ** 2)
    errors = [np.median(np.abs(e.receptance - S)[:, 0, 0] / size) for e in (*alone, both)]
    assert errors[2] < min(errors[:2])
    assert np.mean(covered(both, S)) > 0.9


def test_two_places_sensed_but_one_hit_do_not_tell_the_end() -> None:
    whole = hits(BAR, LINES, None)
    fields = ("assembly", "deviation", "free", "response", "drive")
    one_sensor = Hits(*(getattr(whole, n)[[0, 1]] for n in fields), whole.end)
    assert whole.tells_all
    assert not one_sensor.tells_all
    three = (Bar(0.02, 0.04), Bar(0.02, 0.04), Bar(0.02, 0.04))
    all_places = hits(three, LINES, None)
    rows = [0, 1, 3]  # tip hit, three places sensed
    assert not Hits(*(getattr(all_places, n)[rows] for n in fields), all_places.end).tells_all


def test_one_mode_does_not_stand_for_the_place_that_was_not_hit() -> None:
    """G_22 = G_12²/G_11 is near at a resonance, and the end is far off all the same."""
    whole, S = hits(BAR, LINES, None), spindle(LINES)
    G = whole.assembly.copy()
    G[2] = G[1] ** 2 / G[0]
    off = np.abs(G[2] / whole.assembly[2] - 1)
    at = int(np.argmin(off))
    assert off[at] < 0.01
    alike = Hits(G, whole.deviation, whole.free, whole.response, whole.drive, whole.end)
    error = np.abs(parts_of(taken_off(alike) - S)) / np.abs(parts_of(S))
    assert np.max(error[at]) > 0.3
    assert np.all(np.max(error, axis=1) > 0.05)


def test_line_by_line_is_the_formula_of_receptance_coupling() -> None:
    measured, S = hits(BAR, LINES, None), spindle(LINES)
    R = free(BAR, LINES)
    at, end = [0, 2], [4, 5]
    H = in_spindle(BAR, LINES)
    G = H[:, :2, :2]
    R11, R12, R21 = R[:, at][:, :, at], R[:, at][:, :, end], R[:, end][:, :, at]
    textbook = R21 @ np.linalg.inv(R11 - G) @ R12 - R[:, end][:, :, end]
    size = np.linalg.norm(S, axis=(1, 2))
    assert np.max(np.linalg.norm(taken_off(measured) - textbook, axis=(1, 2)) / size) < 1e-7
    assert np.max(np.linalg.norm(textbook - S, axis=(1, 2)) / size) < 1e-7


def test_the_shipped_records_are_those_of_their_maker(tmp_path: Path) -> None:
    write(tmp_path / "bar")
    made = sorted((tmp_path / "bar").glob("*.csv"))
    assert len(made) == 6
    for file in made:
        shipped = LIBRARY / "bar" / file.name
        np.testing.assert_allclose(
            np.loadtxt(file, delimiter=",", skiprows=1), np.loadtxt(shipped, delimiter=",", skiprows=1), rtol=1e-5
        )
