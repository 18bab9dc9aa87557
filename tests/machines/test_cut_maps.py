"""The quick maps of test cuts against plain ones: eigenvalues on finer nodes, and the equations that they solve."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from repeats import repeats

from jointlib.arrays import Array
from machines import read_machine
from machines.cut_loop import distances as rooms
from machines.cut_loop import growth as rates
from machines.cut_loop import passes
from machines.cut_loop.borders import Condition, condition
from machines.cut_loop.distances import Draws, Place, distances, first_border
from machines.cut_loop.growth import growth, map_of, multiplier
from machines.cut_loop.line_up import suspects_of
from machines.cut_loop.passes import arc_of, pass_of
from machines.cut_loop.sampled_tool import Drawn, SampledTool, sampled_tool
from machines.cut_loop.suspects import AsItIs, RunOut, Suspect
from machines.cutting.process.cutting import Cutting

MILL = Path(__file__).parents[2] / "machines" / "library" / "end_mill_cuts" / "mill.toml"
OPERATIONS = (
    {},
    {"teeth": 3, "immersion": 0.2, "mode": "up"},
    {"teeth": 3, "mode": "slot", "immersion": None},
)


def drawn(change: dict[str, object], draws: int = 25) -> tuple[SampledTool, Cutting]:
    machine = read_machine(MILL)
    table = {k: v for k, v in ({**(machine.cutting or {}), **change}).items() if v is not None}
    return sampled_tool(replace(machine, cutting=table), draws, 0, 60.0), Cutting(**table)  # type: ignore[arg-type]


def told(one: Suspect, tool: SampledTool, table: Cutting) -> tuple[Array, Array]:
    z = np.random.default_rng(3).standard_normal((tool.count, len(one.parameters)))
    out = []
    for speed in (3000.0, 5200.0, 9000.0, 14000.0):
        teeth = table.cuts_per_revolution
        place = Place(
            condition(table, 2 * speed / teeth, tool.axes), np.array([2e-3, 3.5e-3, 6e-3, 9e-3]) * 2 / teeth, 0
        )
        out.append(distances(Draws(one, tool, tool.drawn(), np.arange(tool.count), one.values(z)), place))
    apart, frequency, _ = zip(*out, strict=True)
    return np.concatenate(apart), np.concatenate(frequency)


def told_map(found: passes.Pass, depth: float) -> Array:
    return map_of(found.steps(np.full(len(found.rest), depth)), found.states).astype(float)


def by_eigenvalues(passing: rates.Real) -> tuple[Array, Array]:
    value = np.linalg.eigvals(passing)
    largest = np.take_along_axis(value, np.argmax(np.abs(value), axis=1)[:, None], axis=1)[:, 0]
    return np.log(np.abs(largest)), np.abs(np.angle(largest))


@pytest.mark.parametrize("family", ["as it is", "run-out"])
def test_the_frequency_at_the_border_is_that_of_a_cut_as_deep(family: str) -> None:
    tool, table = drawn({"teeth": 3}, 6)
    one = AsItIs() if family == "as it is" else RunOut(3)
    at, rows = condition(table, 7000.0, tool.axes), np.arange(6)
    values = one.values(np.random.default_rng(1).standard_normal((6, len(one.parameters))))
    place = Place(at, np.array([2e-3, 4e-3, 8e-3, 16e-3]), 0, sung=True)
    apart, _, at_border = distances(Draws(one, tool, tool.drawn(), rows, values), place)
    for k, depth in enumerate(first_border(place, apart)):
        alone = Place(at, np.array([depth]), 0)
        _, frequency, _ = distances(Draws(one, tool, tool.drawn().of(rows[[k]]), rows[[k]], values[[k]]), alone)
        assert at_border[k] == pytest.approx(frequency[0, 0], rel=1e-6)


@pytest.mark.parametrize(
    "change", repeats(OPERATIONS, lambda change: change is OPERATIONS[0]), ids=["half", "up", "slot"]
)
def test_draws_stand_where_eigenvalues_on_finer_nodes_put_them(
    change: dict[str, object], monkeypatch: pytest.MonkeyPatch
) -> None:
    tool, table = drawn(change, 25 if "slot" not in change.values() else 8)
    suspects: dict[str, Suspect] = {one.family: one for one in suspects_of(tool, table, 14000.0, 4e-3)[0]}
    every = [AsItIs(), *suspects.values()]
    quick = [told(one, tool, table) for one in every]
    monkeypatch.setattr(rooms, "multiplier", by_eigenvalues)
    monkeypatch.setattr(rooms, "growth", lambda *steps: by_eigenvalues(map_of(*steps)))
    for name, value in (("_NODES", 7.0), ("_PER_PERIOD", 5.0), ("_SPAN", 1.5)):
        monkeypatch.setattr(passes, name, value)
    for one, (apart, frequency) in zip(every, quick, strict=True):
        exact, at = told(one, tool, table)
        near = np.abs(exact) < 1
        off, beside = np.abs(apart - exact)[near], np.abs(frequency - at)[near]
        assert np.count_nonzero(near) > 2 * tool.count, one.family
        # A verdict scatters by 0.1, a frequency by 2.4 Hz. Where two multipliers are alike, 512 steps part them badly.
        assert np.median(off) < 5e-4, one.family
        assert np.quantile(off, 0.95) < 0.01, one.family
        assert np.max(off) < 0.1, one.family
        assert np.quantile(beside, 0.95) < 0.1, one.family


def relations(tool: SampledTool, at: Condition, changed: Drawn) -> passes.Pass:
    return pass_of(changed, tool.direct, at, arc_of(at, tool.highest), tool.axes)


@pytest.mark.parametrize("rubbing", [0.0, 1e5])
def test_a_map_solves_the_relations_of_its_pass(rubbing: float) -> None:
    tool, table = drawn({}, 5)
    changed = replace(tool.drawn(), damping=np.full(5, rubbing))
    found, b, rng = relations(tool, condition(table, 4000.0, tool.axes), changed), 3e-3, np.random.default_rng(0)
    s, old = rng.standard_normal((5, found.states)), rng.standard_normal((5, found.nodes))
    after = np.einsum("sij,sj->si", told_map(found, b), np.concatenate([s, old], axis=1))
    begin = found.states
    assert len(found.stretches) > 1
    for part in found.stretches:
        n = part.within.shape[2]
        x = after[:, begin : begin + n]
        chips = (x - old[:, begin - found.states :][:, :n])[:, :, None]
        felt = (part.into @ s[:, :, None]) - b * (part.within @ chips)
        end = (part.free @ s[:, :, None]) - b * (part.out @ chips)
        if part.rubbed is not None and part.rubbed_out is not None:
            y = np.linalg.solve(np.eye(n) + b * part.rubbed[:, n:], felt[:, n:])
            felt = felt[:, :n] - b * (part.rubbed[:, :n] @ y)
            end -= b * (part.rubbed_out @ y)
        np.testing.assert_allclose(x, felt[:, :n, 0], rtol=1e-4, atol=1e-5)  # single precision
        s, begin = end[:, :, 0], begin + n
        assert (part.rubbed is None) == (rubbing == 0)
    np.testing.assert_allclose(after[:, : found.states], np.einsum("sij,sj->si", found.rest, s), rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("rubbing", [0.0, 1e5])
@pytest.mark.parametrize("change", OPERATIONS, ids=["half", "up", "slot"])
def test_an_arc_may_be_cut_into_any_stretches(
    change: dict[str, object], rubbing: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    tool, table = drawn(change, 5)
    changed = replace(tool.drawn(), damping=np.full(5, rubbing))
    at = condition(table, 4000.0, tool.axes)
    monkeypatch.setattr(passes, "_NODES", 8.0)
    grown, pieces = [], []
    for span in (0.3, passes._SPAN):
        monkeypatch.setattr(passes, "_SPAN", span)
        found = relations(tool, at, changed)
        pieces.append(len(found.stretches))
        grown.append(by_eigenvalues(told_map(found, 3e-3))[0])
    assert pieces[0] > 2 * pieces[1]
    np.testing.assert_allclose(grown[0], grown[1], atol=1e-5)


@pytest.mark.thorough
def test_maps_are_told_alike_alone_and_among_many() -> None:
    tool, table = drawn({}, 300)
    passing = told_map(relations(tool, condition(table, 9000.0, tool.axes), tool.drawn()), 4e-3)
    every = np.array(multiplier(passing))
    some = [0, 127, 128, 200, 299]
    np.testing.assert_allclose(np.array(multiplier(passing[some])), every[:, some], rtol=1e-6)
    exact = np.array(by_eigenvalues(passing))
    np.testing.assert_allclose(every[0], exact[0], atol=5e-3)
    assert np.ptp(exact[0]) > 0.02


def test_a_map_far_beyond_every_border_is_told_too() -> None:
    """Squares of its entries are no numbers of single precision."""
    passing = 1e30 * np.array([[[1.0, 0.2], [0.1, 0.5]], [[0.0, -2.0], [2.0, 0.0]]])
    grown, angle = multiplier(passing)
    exact, turned = by_eigenvalues(passing)
    np.testing.assert_allclose(grown, exact, rtol=1e-6)
    np.testing.assert_allclose(angle, turned, atol=1e-6)


def random_steps(seed: int) -> tuple[list[passes.Single], int]:
    """Steps of 20 draws of a cutter and a cut that nobody chose, some of them far from their border."""
    rng = np.random.default_rng(seed)
    count, modes = 20, int(rng.integers(1, 5))
    hertz = rng.uniform(300, 3000, modes) * (1 + 0.02 * rng.standard_normal((count, modes)))
    s, ratio = 2 * np.pi * hertz, rng.uniform(0.005, 0.08, modes)
    shape = rng.standard_normal((modes, 2))
    mass = rng.uniform(0.1, 2.0, modes)
    residue = (shape[:, :, None] * shape[:, None] / mass[:, None, None])[None] / (2j * s)[:, :, None, None]
    flat = np.ones(count)
    damping = flat * (1e5 if rng.uniform() < 0.3 else 0.0)
    changed = Drawn(s * (-ratio + 1j), residue, 7e8 * flat, 3e8 * flat, damping)
    mode, teeth = ("up", "down", "slot")[int(rng.integers(3))], int(rng.integers(1, 6))
    table = Cutting("milling", teeth=teeth, tangential=7e8, normal=3e8, mode=mode, diameter=0.012,
                    immersion=None if mode == "slot" else float(rng.uniform(0.1, 0.9)))  # fmt: skip
    at = condition(table, float(np.exp(rng.uniform(np.log(1500), np.log(20000)))), ("x", "y"))
    found = pass_of(changed, np.zeros((count, 2, 2)), at, arc_of(at, float(np.max(hertz))), ("x", "y"))
    return found.steps(np.exp(rng.uniform(np.log(1e-4), np.log(2e-2), count))), found.states


@pytest.mark.slow
@pytest.mark.parametrize("long", [0, rates._LONG, 10**6], ids=["carried", "either", "raised"])
def test_growth_is_that_of_the_largest_eigenvalue(long: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Vectors that are carried and powers against numpy, on cutters drawn at random; a side is lost nowhere but within
    what the numerics leave open."""
    monkeypatch.setattr(rates, "_LONG", long)
    off, sizes = list[Array](), list[int]()
    for seed in range(60):
        steps, states = random_steps(seed)
        passing = map_of(steps, states)
        found, exact = growth(steps, states), by_eigenvalues(passing)
        off.append(np.abs(found[0] - exact[0])[np.abs(exact[0]) < 1])
        sizes.append(passing.shape[1])
        assert not np.any(((found[0] > 0) != (exact[0] > 0)) & (np.abs(exact[0]) > 5e-3)), seed
    assert min(sizes) < 30
    assert max(sizes) > 150
    every = np.concatenate(off)
    assert np.quantile(every, 0.95) < 1e-3
    assert np.max(every) < 1e-2


@pytest.mark.parametrize("size", [0.01, 0.5, 3.0, 50.0])
def test_a_force_is_taken_back_however_large_it_is(size: float) -> None:
    """Chips that hang on what was before, by powers that vanish or, where they first swell, by elimination."""
    rng = np.random.default_rng(4)
    before = np.tril(rng.standard_normal((6, 12, 12)), -1) + 0.05 * rng.standard_normal((6, 12, 12))
    A = (size / 12 * before).astype(np.float32)
    back = passes._inverse(A).astype(float)
    left = back @ (np.eye(12) + A) - np.eye(12)
    assert np.max(np.abs(left)) < 1e-5 * max(1.0, float(np.max(np.abs(back))))


@pytest.mark.parametrize("other", [0.999, 0.98, 0.5])
@pytest.mark.parametrize("angle", [0.0, 0.7, np.pi])
def test_two_multipliers_that_are_alike_are_told(angle: float, other: float) -> None:
    """A pair or a real one beside a pair that is nearly as large, in a basis that is not upright."""
    rng = np.random.default_rng(5)
    turns = [np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]) for a in (angle, 2.0)]
    plain = np.zeros((20, 6, 6))
    plain[:, :2, :2], plain[:, 2:4, 2:4] = 1.1 * turns[0], 1.1 * other * turns[1]
    basis = np.eye(6) + 0.3 * rng.standard_normal((20, 6, 6))
    grown, turned = multiplier(basis @ plain @ np.linalg.inv(basis))
    np.testing.assert_allclose(grown, np.log(1.1), atol=2e-3)
    if other < 0.99:
        np.testing.assert_allclose(turned, angle, atol=1e-3)


@pytest.mark.parametrize("decay", [3e4, 3e5, 3e6])
def test_a_mode_that_is_forgotten_within_a_tooth_adds_next_to_nothing(decay: float) -> None:
    tool, table = drawn({}, 5)
    plain, at = tool.drawn(), condition(table, 3000.0, tool.axes)
    pole = np.full((5, 1), decay * (-1 + 1j))
    residue = 1e-9 * np.abs(pole)[:, :, None, None] * np.eye(2)
    more = replace(
        plain,
        poles=np.concatenate([plain.poles, pole], axis=1),
        residue=np.concatenate([plain.residue, residue], axis=1),
    )
    grown = [by_eigenvalues(told_map(relations(tool, at, one), 3e-3))[0] for one in (plain, more)]
    np.testing.assert_allclose(grown[1], grown[0], atol=0.02)
