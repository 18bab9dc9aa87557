"""Test cuts against a machine: borders of many samples, evidence, the verdict, and what to cut next."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.special import logsumexp, ndtr
from tried_cuts import Shop, sounds

from jointlib import InputError, read_measurement
from jointlib.arrays import Array
from jointlib.cuts.heard import heard
from jointlib.cuts.tried_cut import TriedCut
from jointlib.laws.jenkins import Jenkins
from jointlib.loop.answer.report import Verdict
from jointlib.measurement import Measurement
from machines import Machine, lobes_at_amplitude, read_machine, trace
from machines.cut_loop import advice, contest, sentences, tempered
from machines.cut_loop import posterior as posteriors_room
from machines.cut_loop import trace_cuts as trace_cuts_room
from machines.cut_loop.advice import all_the_way, band, chance_at, outlook, told_by
from machines.cut_loop.borders import border, condition, conditions_of
from machines.cut_loop.contest import NEEDED, entry, folds_of
from machines.cut_loop.distances import Place, distances
from machines.cut_loop.doubted_modes import JointSlip, MissingMode, ModeFrequency
from machines.cut_loop.evidence import of_frequency, of_verdicts, replayed, sound, stable
from machines.cut_loop.exactness import learnt, of_zero_order, told
from machines.cut_loop.growth import map_of, multiplier
from machines.cut_loop.line_up import suspects_of
from machines.cut_loop.passes import arc_of, pass_of
from machines.cut_loop.problem import Problem, problem_of
from machines.cut_loop.sampled_tool import receptance, sampled_tool
from machines.cut_loop.suspects import AsItIs, Coefficient, RunOut
from machines.cut_loop.tempered import over_mixture, posterior
from machines.cut_loop.trace_cuts import trace_cuts
from machines.cutting.forced.forced_vibration import forced_vibration
from machines.cutting.process.cutting import Cutting
from machines.lobes import minimum_depth_of_mode

MILL = """
schema = "jointlib/machine/1"
name = "mill"
[[component]]
name = "cutter"
kind = "modal"
dofs = ["x", "y"]
frequency = [600, 680]
damping_ratio = [0.03, 0.03]
frequency_error = [9, 10]
damping_ratio_error = [0.003, 0.003]
modal_mass = [0.8, 0.7]
shapes = [[1.0, 0.0], [0.0, 1.0]]
[tool]
x = "cutter.x"
y = "cutter.y"
[cutting]
process = "milling"
teeth = 2
mode = "down"
immersion = 0.5
tangential = 7e8
normal = 2.1e8
diameter = "20 mm"
speed = [3000, 16000]
"""
LATHE = """
schema = "jointlib/machine/1"
name = "lathe"
[[component]]
name = "slide"
kind = "modal"
dofs = ["x"]
frequency = [150]
damping_ratio = [0.03]
frequency_error = [1.5]
damping_ratio_error = [0.003]
modal_mass = [22.5]
shapes = [[1.0]]
[tool]
x = "slide.x"
[cutting]
process = "turning"
specific = 1e9
diameter = "80 mm"
speed = [1500, 5000]
"""
SPEEDS = (1700.0, 2000.0, 2300.0, 2700.0, 3300.0, 4100.0)


def machine_of(folder: Path, text: str = LATHE) -> Machine:
    (folder / "machine.toml").write_text(text)
    return read_machine(folder / "machine.toml")


def bare(machine: Machine) -> Machine:
    """Without what is known of its errors."""
    parts = tuple(replace(c, frequency_error=None, damping_ratio_error=None) for c in machine.components)
    return replace(machine, components=parts)


def campaign(machine: Machine, seed: int, force: float = 1.0, scatter: float = 0.1, shift: float = 0.0) -> Measurement:
    """Cuts on a lathe whose verdicts are coins by the true border, and whose chatter is heard within 0.5 %."""
    rng = np.random.default_rng(seed)
    cuts = []
    true = bare(machine)
    (part,) = true.components
    moved = replace(part, frequency=part.frequency * (1 + shift))  # type: ignore[attr-defined,call-arg]
    cutting = {**(machine.cutting or {}), "specific": 1e9 * force}
    lobes = lobes_at_amplitude(replace(true, components=(moved,), cutting=cutting), np.repeat(SPEEDS, 3))
    about = lobes_at_amplitude(true, np.repeat(SPEEDS, 3)).depth
    for k, speed in enumerate(np.repeat(SPEEDS, 3)):
        depth = about[k] * rng.uniform(0.5, 1.9) / force**0.5
        sings = rng.uniform() > ndtr(np.log(lobes.depth[k] / depth) / scatter)
        f = lobes.chatter_frequency[k] * (1 + 0.005 * rng.standard_normal()) if sings else None
        verdict = "chatter" if sings else "stable"
        cuts.append(TriedCut(f"cut {k}", speed, depth, 1, verdict=verdict, chatter_frequency=f))
    return Measurement(Path("cuts"), "cuts", (), (), cuts=tuple(cuts))


def asked(machine: Machine, cuts: Measurement, draws: int = 400) -> Problem:
    table = Cutting(**dict(machine.cutting or {}))
    conditions, index = conditions_of(cuts.cuts, table, machine.tool_axes)
    tool = sampled_tool(machine, draws, 0, min(at.tooth_frequency for at in conditions))
    return problem_of(cuts.cuts, conditions, index, machine, tool, 0)


def of_one(verdict: str, apart: Array, sigma: float, shaken: float) -> Array:
    """ln P of the verdict of a cut alone."""
    return of_verdicts([verdict], apart[:, None], np.full(len(apart), sigma), np.array([shaken]))


def test_three_cuts_that_chatter_unheard_at_one_speed_are_hardly_less_likely_than_one() -> None:
    """Where the first is not heard, as its teeth leave the cut, neither are the others, nor is one that was heard."""
    beyond, sigma, forced = np.array([[-0.5, -0.45, -0.4]]), np.array([0.1]), np.full(3, 2.0)
    one, three = (np.exp(of_verdicts(["stable"] * n, beyond[:, :n], sigma, forced[:n]))[0] for n in (1, 3))
    assert one / 3 < three < one
    both = np.exp(of_verdicts(["stable", "chatter", "stable"], beyond, sigma, forced))[0]
    assert both < three / 3
    clear = np.array([[0.5, 0.6, 0.7]])
    apart_ = np.exp(sum(of_one("stable", clear[:, i], 0.1, 2.0) for i in range(3)))
    assert np.exp(of_verdicts(["stable"] * 3, clear, sigma, forced)) == pytest.approx(apart_, rel=0.01)


def test_verdicts_that_are_replayed_are_as_many_as_they_are_likely() -> None:
    """Patterns of two cuts of a place, one before and one beyond the border."""
    apart, sigma, forced = np.tile([[0.05, -0.3]], (20_000, 1)), np.full(20_000, 0.1), np.array([0.5, 2.0])
    found = replayed(apart, sigma, forced, np.random.default_rng(0))
    for pattern in ([True, True], [True, False], [False, True], [False, False]):
        said = ["stable" if one else "chatter" for one in pattern]
        p = float(np.exp(of_verdicts(said, apart[:1], sigma[:1], forced)[0]))
        assert np.mean(np.all(found == pattern, axis=1)) == pytest.approx(p, abs=4 * np.sqrt(p * (1 - p) / 20_000))


def test_chatter_that_the_teeth_drown_is_often_not_heard(tmp_path: Path) -> None:
    """Teeth that pass with a mode shake the tool by many feeds, however large the feed is."""
    speeds = 60 * 600 / 2, 60 * 410 / 2
    cuts = tuple(TriedCut(f"{n}", n, 12e-3, 1, verdict="stable") for n in speeds)
    measurement = Measurement(Path("cuts"), "cuts", (), (), cuts=cuts)
    fed = machine_of(tmp_path, MILL + 'feed = "0.05 mm"\n')
    drowned, clear = asked(fed, measurement, 2).shaken
    assert clear < 1 < drowned
    assert [drowned, clear] == pytest.approx(forced_vibration(fed, speeds, 12e-3).amplitude / 50e-6)
    assert asked(machine_of(tmp_path, MILL), measurement, 2).shaken == pytest.approx([drowned, clear])
    beyond, sigma = np.array([-0.2]), np.array([0.1])
    assert stable(beyond, sigma, drowned) > 2 * stable(beyond, sigma, clear)
    for verdict in ("stable", "marginal"):
        assert of_one(verdict, beyond, 0.1, drowned) > of_one(verdict, beyond, 0.1, clear)


@pytest.mark.parametrize("shaken", [0.0, 1.0, 8.0])
def test_verdicts_of_a_cut_are_as_likely_as_they_are_many(shaken: float) -> None:
    """Stable, marginal and chatter leave nothing over but what a marginal cut may be called as well."""
    apart = np.linspace(-1.5, 0.5, 41)
    chance = {v: np.exp(of_one(v, apart, 0.1, shaken)) for v in ("stable", "marginal", "chatter")}
    assert chance["stable"] == pytest.approx(stable(apart, np.array(0.1), shaken), abs=0.02)  # by eight depths
    assert np.all(np.diff(chance["stable"]) >= 0)
    assert chance["stable"] + chance["chatter"] == pytest.approx(np.ones(41))
    assert np.all((chance["marginal"] > 0.019) & (chance["marginal"] < 0.95))


def test_what_is_advised_to_be_stable_is_so_and_not_only_unheard() -> None:
    apart, sigma = [np.full((4, 2), -0.2), np.full((4, 2), 0.3)], np.full((4, 1), 0.1)
    chance, bits = told_by(apart, sigma, np.full((2, 2), 5.0))
    assert chance[0] == pytest.approx(0.02 + 0.96 * ndtr(-2.0))
    assert chance[1] == pytest.approx(0.02 + 0.96 * ndtr(3.0))
    assert np.all(bits == pytest.approx(0.0, abs=1e-12))


def test_no_cut_beyond_an_island_of_chatter_is_safe() -> None:
    apart, sigma = [np.tile([1.0, -0.3, 0.8], (5, 1))], np.full((5, 1), 0.1)
    assert told_by(apart, sigma, np.zeros((1, 3)))[0][0] == pytest.approx([0.98, 0.0213, 0.98], abs=1e-3)
    assert all_the_way(apart, sigma)[0] == pytest.approx([0.98, 0.0213, 0.0213], abs=1e-3)


def test_a_safe_cut_that_multipliers_deny_gives_way_to_the_next(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two speeds: at the faster one the border that was guessed lies at 8 mm and that of multipliers at 3."""
    ladder, sigma = 1e-3 * np.arange(1.0, 9.0), np.full((4, 1), 0.1)
    border_at = {5000.0: 5.5e-3, 8000.0: 3e-3}
    places = [SimpleNamespace(at=SimpleNamespace(speed=n)) for n in border_at]
    monkeypatch.setattr(
        advice, "_by_multipliers", lambda _, place, deep: np.tile(np.log(border_at[place.at.speed] / deep), (4, 1))
    )
    guessed = [np.tile(np.log(b / ladder), (4, 1)) for b in (5.5e-3, 8e-3)]
    through = all_the_way(guessed, sigma)
    removed = np.where(through >= 0.95, np.array([[5000.0], [8000.0]]) * ladder, -1.0)
    assert removed.max() == 8000.0 * 6e-3
    advice._prove(removed, through, [], places, ladder, sigma, 0.95)  # type: ignore[arg-type]
    assert removed.max() == 5000.0 * 4e-3
    assert through[1, 5] < 0.03


def test_the_lower_edge_of_the_band_is_as_safe_as_it_says(tmp_path: Path) -> None:
    """One border, known for certain: 5 and 95 % of the depths at which cuts turn, as the probability has them."""
    machine = machine_of(tmp_path)
    at = condition(Cutting(**dict(machine.cutting or {})), 3000.0, machine.tool_axes)
    border_at, sigma = 2e-3, np.full((4, 1), 0.1)
    place = Place(at, border_at * np.exp(np.linspace(-0.8, 0.8, 9)), 0)
    apart = [np.tile(np.log(border_at / place.depths), (4, 1))]
    low, middle, high = band([place], apart, sigma)[:, 0]
    assert middle == pytest.approx(border_at, rel=0.02)
    edges = np.log(border_at / np.array([[low, high]]))
    assert np.mean(sound(edges, sigma[:1]), axis=0) == pytest.approx(0.02 + 0.96 * np.array([0.95, 0.05]), abs=1e-9)


@pytest.mark.parametrize("damping", [0.0, 5e4])
def test_borders_of_samples_are_those_of_the_chart(tmp_path: Path, damping: float) -> None:
    for text, method in ((LATHE, "turning"), (MILL, "zero-order")):
        machine = bare(machine_of(tmp_path, text))
        tool = sampled_tool(machine, 2, 0, 60.0)
        G = receptance(tool.poles, tool.residue, tool.direct, tool.lines)
        table = dict(machine.cutting or {}) | ({"process_damping": damping} if damping else {})
        for speed in (2300.0, 3100.0, 9000.0) if method == "turning" else (7000.0, 9000.0, 14000.0):
            at = condition(Cutting(**table), speed, machine.tool_axes)
            depth, frequency = border(G, tool.lines, at, tool.tangential, tool.normal, np.full(2, damping))
            chart = lobes_at_amplitude(replace(machine, cutting=table), [speed], method=method)
            np.testing.assert_allclose(depth, chart.depth[0], rtol=0.01 if damping else 0.004)
            np.testing.assert_allclose(frequency, chart.chatter_frequency[0], rtol=0.003)


def test_the_lowest_border_in_turning_is_the_closed_form(tmp_path: Path) -> None:
    machine = bare(machine_of(tmp_path))
    tool = sampled_tool(machine, 1, 0, 25.0)
    G = receptance(tool.poles, tool.residue, tool.direct, tool.lines)
    table = Cutting(**dict(machine.cutting or {}))
    depths = [
        border(G, tool.lines, condition(table, n, ("x",)), tool.tangential, tool.normal, np.zeros(1))[0][0]
        for n in np.linspace(2000, 3000, 60)
    ]
    k = 22.5 * (2 * np.pi * 150) ** 2
    assert min(depths) == pytest.approx(float(minimum_depth_of_mode(k, 0.03, 1e9)), rel=0.01)


@pytest.mark.thorough
def test_what_zero_order_misses_is_learnt_from_multipliers(tmp_path: Path) -> None:
    """Of tools with other modes and forces, against the charts of these tools."""
    uneven = {"teeth": 4, "pitch": (83, 97, 83, 97), "helix": 35.0}
    machine = machine_of(tmp_path, MILL)
    machine = replace(machine, cutting={**(machine.cutting or {}), **uneven})
    table, speeds = Cutting(**dict(machine.cutting or {})), [4200.0, 7000.0]
    conditions = [condition(table, n, machine.tool_axes) for n in speeds]
    chart = lobes_at_amplitude(bare(machine), speeds)
    depths = [np.array([0.8, 1.0, 1.2]) * depth for depth in chart.depth]
    tool = sampled_tool(machine, 30, 1, 200.0)
    exact = learnt(machine, tool, conditions, depths, 0)
    (part,) = machine.components
    moved = replace(part, frequency=part.frequency * np.array([1.02, 0.985]))  # type: ignore[attr-defined,call-arg]
    harder = {**(machine.cutting or {}), "tangential": 1.1 * 7e8, "normal": 1.1 * 2.1e8}
    other = bare(replace(machine, components=(moved,), cutting=harder))
    one = sampled_tool(other, 1, 0, 200.0)
    chart = lobes_at_amplitude(other, speeds)
    for k, at in enumerate(conditions):
        rough = of_zero_order(one, at, one.drawn(), np.arange(1))
        apart, hertz, _ = told(*rough, one.drawn(), depths[k], exact, k)
        nearest = int(np.argmin(np.abs(apart)))
        border_at = depths[k] * np.exp(apart[0])
        assert 0.01 < exact.of[k].scatter < 0.25
        assert abs(np.log(border_at[nearest] / chart.depth[k])) < 2 * exact.of[k].scatter + 0.02
        off = hertz[0, nearest] - chart.chatter_frequency[k]
        assert abs(off - at.tooth_frequency * np.round(off / at.tooth_frequency)) < 0.02 * 640


def multipliers(machine: Machine, speed: float, depth: float, flutes: int = 0) -> tuple[float, float]:
    """ln|μ| and Hz of the machine as it is at a cut; ``flutes`` of its teeth cut where that is not 0."""
    tool, table = sampled_tool(bare(machine), 1, 0, 60.0), Cutting(**dict(machine.cutting or {}))
    at = condition(table, speed, machine.tool_axes)
    found = pass_of(tool.drawn(), tool.direct, at, arc_of(at, tool.highest), tool.axes)
    cut, teeth = map_of(found.steps(np.full(1, depth)), found.states), table.cuts_per_revolution
    passing = cut
    for tooth in range(1, teeth if flutes else 1):
        passing = (cut if tooth < flutes else found.idle()) @ passing
    value = np.linalg.eigvals(passing[0])
    largest = value[np.argmax(np.abs(value))]
    growth, angle = multiplier(passing)
    assert growth[0] == pytest.approx(np.log(abs(largest)), abs=0.02)
    repeats = speed / 60 if flutes else at.tooth_frequency
    # A tenth of what a chatter frequency is told by at the border, 0.4 % of 600 Hz.
    assert angle[0] / (2 * np.pi) * repeats == pytest.approx(abs(np.angle(largest)) / (2 * np.pi) * repeats, abs=0.24)
    return float(np.log(abs(largest))), float(angle[0]) / (2 * np.pi) * repeats


@pytest.mark.thorough
@pytest.mark.parametrize(
    "change",
    [{}, {"immersion": 0.1, "mode": "up"}, {"teeth": 4}, {"mode": "slot", "immersion": None, "teeth": 3},
     {"process_damping": 1e5}],
)  # fmt: skip
def test_the_largest_multiplier_is_one_on_the_border_of_the_chart(tmp_path: Path, change: dict[str, object]) -> None:
    machine = machine_of(tmp_path, MILL)
    table = {k: v for k, v in ({**(machine.cutting or {}), **change}).items() if v is not None}
    machine = replace(machine, cutting=table)
    speeds = [5200.0, 9000.0, 14000.0]
    chart = lobes_at_amplitude(bare(machine), speeds)
    for speed, depth, f in zip(speeds, chart.depth, chart.chatter_frequency, strict=True):
        growth, heard_at = multipliers(machine, speed, depth)
        above, _ = multipliers(machine, speed, 1.01 * depth)
        assert abs(growth) < 0.1 * abs(above - growth)  # within a thousandth of the depth
        tooth = speed / 60 * float(table["teeth"])  # type: ignore[arg-type]
        folded = f % tooth
        assert heard_at == pytest.approx(min(folded, tooth - folded), abs=0.3)


def test_flutes_that_find_nothing_to_cut_leave_a_cutter_with_fewer(tmp_path: Path) -> None:
    machine = machine_of(tmp_path, MILL)
    one = replace(machine, cutting={**(machine.cutting or {}), "teeth": 1})
    for speed, depth in ((9000.0, 6e-3), (13000.0, 3e-3)):
        growth, f = multipliers(machine, speed, depth, flutes=1)
        alone, at = multipliers(one, speed, depth)
        assert growth == pytest.approx(alone, abs=2e-4)
        assert f == pytest.approx(at, abs=0.01)
        everything, _ = multipliers(machine, speed, depth, flutes=2)
        assert everything == pytest.approx(2 * multipliers(machine, speed, depth)[0], abs=1e-6)
    assert set(RunOut(4).values(np.random.default_rng(0).standard_normal((200, 1))).ravel()) == {1, 2, 3}


def test_a_joint_that_slips_is_a_spring_and_a_damper_of_its_amplitude(tmp_path: Path) -> None:
    tool = sampled_tool(bare(machine_of(tmp_path, MILL)), 1, 0, 60.0)
    share, r = 0.3, 2.5
    one = JointSlip(0, 600.0, 2e-3).changed(tool.drawn(), np.array([[share, 2e-3]]), 9000.0, r * 2e-3)
    found = Jenkins(stiffness=share, slip_force=share).describing_function(np.array([r]), 1.0)[0] + (1 - share)
    s = one.poles[0, 0]
    assert abs(s) / (2 * np.pi * 600) == pytest.approx(np.sqrt(found.real), rel=1e-6)
    # 2ζ·√k of the mode and the loss of the spring over the frequency, c·ω = Im k.
    assert -2 * s.real / (2 * np.pi * 600) == pytest.approx(2 * 0.03 + found.imag, rel=1e-6)
    stuck = JointSlip(0, 600.0, 2e-3).changed(tool.drawn(), np.array([[share, 2e-3]]), 9000.0, 1.9e-3)
    np.testing.assert_allclose(stuck.poles, tool.poles, rtol=1e-12)


def test_a_verdict_is_a_coin_and_a_frequency_a_density() -> None:
    x = np.linspace(-5, 5, 41)
    said = {verdict: np.exp(of_one(verdict, x, 0.1, 0.0)) for verdict in ("stable", "chatter", "marginal")}
    np.testing.assert_allclose(said["stable"] + said["chatter"], 1.0, rtol=1e-12)
    assert np.argmax(said["marginal"]) == 20
    assert np.all(said["stable"][16:20] > said["chatter"][24:20:-1])  # chatter goes unheard, and is not made up
    tooth, at = 100.0, 612.0
    heard_at = np.linspace(600.0, 700.0, 20001)
    one = np.array([at])
    density = np.array([np.exp(of_frequency(f, one, one, np.zeros(1), tooth, False)[0]) for f in heard_at[::20]])
    assert np.mean(density) == pytest.approx(1.0, rel=0.03)  # over the uniform one of a tooth frequency
    other = np.array([634.0])
    for hertz in (at, 617.5, 623.0, 634.0):  # from the border to the depth of the cut, and nowhere else
        assert of_frequency(hertz, one, other, np.zeros(1), tooth, False) > 0.5
        assert of_frequency(hertz, other, one, np.zeros(1), tooth, False) > 0.5
    for hertz in (600.0, 646.0):
        assert of_frequency(hertz, one, other, np.zeros(1), tooth, False) < -1.5
    assert of_frequency(634.0, one, one, np.zeros(1), tooth, False) < -1.5
    # The way between is the short one, across a multiple of the tooth frequency.
    assert of_frequency(700.0, np.array([697.0]), np.array([703.0]), np.zeros(1), tooth, False) > 0.5


def test_no_name_is_given_that_tells_the_verdicts_worse(monkeypatch: pytest.MonkeyPatch) -> None:
    """However well it tells the frequencies of chatter."""
    monkeypatch.setattr(contest, "_unexplained", lambda *_: False)
    cuts = tuple(TriedCut(f"{k}", 3000.0, 1e-3, 2, verdict=said) for k, said in enumerate(("stable", "chatter") * 4))
    problem = SimpleNamespace(cuts=cuts, tool=SimpleNamespace(count=300))

    def fared(family: str, evidence: float, right: float) -> contest.Entry:
        suspect = SimpleNamespace(family=family, told=lambda *_: family)
        found = SimpleNamespace(suspect=suspect, evidence=evidence, effective=200.0, strain=0.5, count=300)
        stable_ = np.array([right, 1 - right] * 4)
        return contest.Entry(found, np.full(4, evidence / 4), stable_, np.ones(8))  # type: ignore[arg-type]

    base = fared("as it is", 0.0, 0.9)
    for right, named in ((0.92, True), (0.7, False)):
        outcome = contest.decided(base, [fared("coefficient", 9.0, right)], problem)  # type: ignore[arg-type]
        assert (outcome.chosen is not None) is named
        assert outcome.odds == pytest.approx(9.0)


@pytest.mark.thorough
def test_evidence_of_a_sharp_likelihood_is_the_closed_form() -> None:
    """A bell of ten widths' distance in six dimensions, drawn at powers as far apart as they are in a campaign."""
    rng, size, width, away, top = np.random.default_rng(0), 6, 0.15, 0.6, 100.0
    totals, powers = [], [0.0, 0.05, 0.2, 0.85, 1.0, 1.0, 1.0]
    for power in powers:
        tight = 1 + power / width**2
        z = power / width**2 * away / tight + rng.standard_normal((400, size)) / np.sqrt(tight)
        totals.append(top - 0.5 * np.sum((z - away) ** 2, axis=1) / width**2)
    over = over_mixture(np.array(totals), np.array(powers))
    found = logsumexp(over + np.ravel(totals)) - np.log(over.size)
    closed = top - size / 2 * (np.log1p(1 / width**2) + away**2 / (1 + width**2))
    assert found == pytest.approx(closed, abs=0.3)


def test_the_size_of_an_effect_is_that_of_quadrature(tmp_path: Path) -> None:
    machine = bare(machine_of(tmp_path))
    cuts = campaign(machine, 3, force=1.5)
    problem = asked(machine, cuts, 1500)
    found = posterior(Coefficient(), problem)
    s = np.exp(np.linspace(-1.2, 1.2, 241))
    z = np.linspace(-3, 3, 41)
    plain = lobes_at_amplitude(machine, [cut.speed for cut in cuts.cuts])
    total, none = np.zeros((len(s), len(z))), 2 * problem.tool.lines[-1]
    for cut, b, f in zip(cuts.cuts, plain.depth, plain.chatter_frequency, strict=True):
        if cut.chatter_frequency is not None:
            beyond = np.log(b / s / cut.depth)
            one = of_frequency(cut.chatter_frequency, at := np.full(len(s), f), at, beyond, none, False)
            total += one[:, None]
    sigma = np.tile(0.1 * np.exp(0.35 * z), len(s))
    for speed in {cut.speed for cut in cuts.cuts}:
        here = [(cut, b) for cut, b in zip(cuts.cuts, plain.depth, strict=True) if cut.speed == speed]
        beyond = np.log([b / s / cut.depth for cut, b in here]).T.repeat(len(z), axis=0)
        verdicts = [str(cut.verdict) for cut, _ in here]
        total += of_verdicts(verdicts, beyond, sigma, np.zeros(len(here))).reshape(total.shape)
    total += -0.5 * (np.log(s)[:, None] / 0.35) ** 2 - 0.5 * z**2
    over = logsumexp(total - np.log(0.35 * 2 * np.pi))  # both normal densities of the prior
    marginal = over + np.log((np.log(s[1]) - np.log(s[0])) * (z[1] - z[0]))
    weight = np.exp(total - np.max(total)).sum(axis=1)
    weight /= weight.sum()
    mean = weight @ np.log(s)
    deviation = np.sqrt(weight @ (np.log(s) - mean) ** 2)
    mine = found.weights() @ np.log(found.values[:, 0])
    assert found.effective > 100
    assert mine == pytest.approx(mean, abs=0.15 * deviation + 0.01)
    mine = np.sqrt(found.weights() @ (np.log(found.values[:, 0]) - mine) ** 2)
    assert mine == pytest.approx(deviation, rel=3 / np.sqrt(2 * found.effective))
    low, high = found.interval()["factor"]
    inside = np.sum(weight[(s > low) & (s < high)])
    assert inside == pytest.approx(0.95, abs=3 * np.sqrt(0.95 * 0.05 / found.effective))
    assert found.evidence == pytest.approx(marginal, abs=3 * np.sqrt(4 / found.effective))


@pytest.mark.slow
def test_where_nothing_is_missing_nothing_is_named(tmp_path: Path) -> None:
    machine = machine_of(tmp_path)
    for seed in range(2):
        found = trace_cuts(campaign(machine, seed, shift=0.008 * (-1) ** seed), machine, draws=250)
        assert (found.verdict.value, found.chosen) == ("nothing_missing", None), found.sentence
        assert found.error_after == found.error_before
        assert found.error_before["right"] > 0.7
        assert found.effective_size["before"] > NEEDED


@pytest.mark.slow
def test_forces_that_are_larger_than_the_file_says_are_named(tmp_path: Path) -> None:
    machine = machine_of(tmp_path)
    found = trace_cuts(campaign(machine, 5, force=2.2), machine, draws=300)
    assert found.chosen is not None
    assert (
        found.chosen.family == "coefficient"
    )  # another mode at the same frequency would do as well, with more parameters
    assert found.error_after["log_score"] > found.error_before["log_score"]
    assert found.error_after["right"] >= found.error_before["right"]
    (coefficient,) = (c for c in found.candidates if c.family == "coefficient")
    low, high = coefficient.parameters["factor"]["ci95"]
    assert low < 2.2 < high


def test_moves_that_no_draw_could_follow_are_left_early(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In whichever order places are asked, and whether moves are left there or not, the same ones are taken."""
    machine = machine_of(tmp_path)
    problem = asked(machine, campaign(machine, 3), 200)
    usual, told, counted = posteriors_room.telling, [], []
    for order, likelier in ((1, tempered._LIKELIER), (-1, tempered._LIKELIER), (1, np.inf)):
        monkeypatch.setattr(posteriors_room, "telling", lambda beside, by=order: usual(beside)[::by])
        monkeypatch.setattr(tempered, "_LIKELIER", likelier)
        count = counted_draws(monkeypatch)
        found = posterior(Coefficient(), problem)
        told.append((found.evidence, *found.weights()))
        counted.append(sum(count))
    np.testing.assert_allclose(told[1:], [told[0]] * 2, rtol=1e-9)  # ends of arrays are rounded otherwise
    assert counted[0] < counted[1]
    assert counted[0] < 0.95 * counted[2]


def counted_draws(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many draws are asked at each place, as it happens."""
    count = list[int]()
    monkeypatch.setattr(posteriors_room, "distances", lambda *at: (count.append(len(at[0].rows)), distances(*at))[1])
    return count


@pytest.mark.thorough
def test_few_effective_draws_are_a_residual_and_no_posterior(tmp_path: Path) -> None:
    machine = machine_of(tmp_path)
    found = trace_cuts(campaign(machine, 0), machine, draws=2)
    assert found.effective_size["before"] < NEEDED
    assert any("a residual and no posterior" in said for said in found.warnings)
    assert (found.verdict.value, found.chosen) == ("unexplained", None)


@pytest.mark.slow
def test_a_mode_far_off_is_found_where_the_cuts_have_it(tmp_path: Path) -> None:
    machine = machine_of(tmp_path)
    found = trace_cuts(campaign(machine, 6, shift=0.1), machine, draws=300)
    assert found.chosen is not None
    assert found.chosen.family == "mode-frequency"
    low, high = found.chosen.parameters["factor"]["ci95"]
    assert low * 150 < 165 < high * 150
    assert found.error_after["log_score"] > found.error_before["log_score"]


@pytest.mark.slow
def test_chatter_in_turning_is_heard_at_its_own_frequency_and_no_other(tmp_path: Path) -> None:
    """Of a mode a third higher than the file has it, several times the speed of revolution beside those of the file."""
    machine = machine_of(tmp_path)
    found = trace_cuts(campaign(machine, 6, shift=0.35), machine, draws=300)
    assert found.chosen is not None
    assert found.chosen.family == "missing-mode"
    low, high = found.chosen.parameters["frequency"]["ci95"]
    assert low < 1.35 * 150 < high


@pytest.mark.slow
def test_what_has_no_name_leaves_cuts_unexplained(tmp_path: Path) -> None:
    machine = machine_of(tmp_path)
    cuts = campaign(machine, 6)
    other = {"stable": "chatter", "chatter": "stable"}
    odd = sorted({cut.speed for cut in cuts.cuts})[::2]
    turned = tuple(
        replace(cut, verdict=other[str(cut.verdict)], chatter_frequency=None) if cut.speed in odd else cut
        for cut in cuts.cuts
    )
    found = trace_cuts(replace(cuts, cuts=turned), machine, draws=300)
    assert found.verdict.value not in ("nothing_missing", "identified")
    assert any(cut.unexplained for cut in found.cuts)


@pytest.mark.slow
def test_the_next_cut_lies_where_the_border_is_in_doubt(tmp_path: Path) -> None:
    machine = machine_of(tmp_path)
    found = trace_cuts(campaign(machine, 0), machine, draws=250, safe=0.9)
    assert 0.2 < found.next_cut.probability < 0.8
    assert 0 < found.next_cut.bits <= 1
    assert found.safe_cut is not None
    assert found.safe_cut.probability >= 0.9
    i = int(np.argmin(np.abs(found.speed - found.safe_cut.speed)))
    assert found.safe_cut.depth < found.band_after[1, i]
    width = [np.nanmean(np.log(b[2] / b[0])) for b in (found.band_before, found.band_after)]
    assert width[1] < width[0]


@pytest.mark.thorough
def test_a_trace_of_cuts_shows_itself(tmp_path: Path) -> None:
    machine = machine_of(tmp_path)
    found = trace_cuts(campaign(machine, 0), machine, draws=60)
    assert np.all(np.diff(found.probability, axis=1) <= 0)  # a deeper cut is reached through every shallower one
    assert found.plot().get_ylabel() == "depth of cut [mm]"
    assert "of held-out cuts" in repr(found)
    assert len(found.columns()["family"][0]) == len(found.candidates)
    assert any(line.startswith("tells most: ") for line in found.words())


@pytest.mark.slow
def test_the_same_seed_gives_the_same_bytes(tmp_path: Path) -> None:
    machine = machine_of(tmp_path)
    cuts = campaign(machine, 1)
    one, two = (json.dumps(trace_cuts(cuts, machine, draws=150, seed=4).as_json()) for _ in range(2))
    assert one == two


def test_a_mode_that_is_added_has_its_compliance(tmp_path: Path) -> None:
    tool = sampled_tool(bare(machine_of(tmp_path)), 2, 0, 60.0)
    suspect = MissingMode(0, "x", 100.0, 200.0, 1e-6)
    values = np.array([[300.0, 2e7, 0.04], [250.0, 1e7, 0.02]])
    changed = suspect.changed(tool.drawn(), values, 1000.0, 1e-3)
    f = np.array([100.0, 280.0, 400.0])
    added = receptance(changed.poles, changed.residue, tool.direct, f) - receptance(
        tool.poles, tool.residue, tool.direct, f
    )
    for (natural, k, zeta), G in zip(values, added[:, :, 0, 0], strict=True):
        r = f / natural
        np.testing.assert_allclose(G, 1 / (k * (1 - r**2 + 2j * zeta * r)), rtol=1e-9)
    moved = ModeFrequency(0, 150.0).changed(tool.drawn(), np.array([[1.1, 0.0], [1.1, 1.0]]), 1000.0, 1e-3)
    r = f / 165.0
    for i, k in enumerate(
        (22.5 * (2 * np.pi * 165) ** 2, 22.5 * (2 * np.pi * 150) ** 2)
    ):  # its mass kept, its stiffness
        G = receptance(moved.poles, moved.residue, tool.direct, f)[i, :, 0, 0]
        np.testing.assert_allclose(G, 1 / (k * (1 - r**2 + 0.06j * r)), rtol=1e-6)


def test_without_a_diameter_rubbing_cannot_be_decided(tmp_path: Path) -> None:
    machine = machine_of(tmp_path, LATHE.replace('diameter = "80 mm"\n', ""))
    tool = sampled_tool(machine, 10, 0, 25.0)
    suspects, undecided = suspects_of(tool, Cutting(**dict(machine.cutting or {})), 4100.0, 1e-3)
    assert {row["family"] for row in undecided} == {"process-damping", "joint-slip", "run-out"}
    assert "process-damping" not in {one.family for one in suspects}
    assert AsItIs().told({}) == "the machine as it is"


def written(folder: Path, seed: int, **what: float) -> tuple[Path, Path]:
    """Files of a machine and of a campaign on it."""
    cuts = campaign(machine_of(folder), seed, **what)
    text = 'schema = "jointlib/measurement/1"\nkind = "cuts"\nsimulated = true\n[cutting]\nprocess = "turning"\n'
    for cut in cuts.cuts:
        text += f'[[cut]]\nname = "{cut.name}"\nspeed = {cut.speed}\ndepth = {cut.depth}\nverdict = "{cut.verdict}"\n'
        text += "" if cut.chatter_frequency is None else f"chatter_frequency = {cut.chatter_frequency}\n"
    (folder / "cuts.toml").write_text(text)
    return folder / "cuts.toml", folder / "machine.toml"


@pytest.mark.slow
def test_what_was_found_is_written_with_the_mended_machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cuts, file = written(tmp_path, 5, force=2.2)
    monkeypatch.setattr(trace_cuts_room, "DRAWS", 250)
    found = trace(cuts, machine=file, output=tmp_path / "out")
    assert sorted(path.name for path in found.files) == ["chart.svg", "machine.toml", "report.html", "trace.json"]
    report = json.loads((tmp_path / "out" / "trace.json").read_text())
    assert {"verdict", "chosen", "rivals", "candidates", "error_before", "error_after", "next_cut"} <= set(report)
    assert set(report["next_cut"]) >= {"speed", "depth", "probability"}
    assert set(report["error_before"]) >= {"right", "log_score"}
    mended = read_machine(tmp_path / "out" / "machine.toml")
    assert mended.cutting is not None
    assert report["chosen"]["family"] == "coefficient"
    assert mended.cutting["specific"] == pytest.approx(2.2e9, rel=0.25)
    assert report["repro"]["simulated"] is True


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda cuts, file: (cuts, file.replace('"turning"\nspecific = 1e9', '"milling"\nteeth = 3\nmode = "slot"\n'
         "tangential = 1e9\nnormal = 1e8")), "was made with 1 teeth, the machine has 3"),
        (lambda cuts, file: (cuts, file.partition("[cutting]")[0]), "no [cutting]"),
        (lambda cuts, file: (cuts.partition('[[cut]]\nname = "cut 4"')[0], file), "expected at least 6"),
    ],
)  # fmt: skip
def test_what_cannot_be_traced_is_told_in_a_sentence(tmp_path: Path, change: object, said: str) -> None:
    cuts, file = written(tmp_path, 5)
    new = change(cuts.read_text(), file.read_text())  # type: ignore[operator]
    cuts.write_text(new[0])
    file.write_text(new[1])
    with pytest.raises(InputError) as caught:
        trace(cuts, machine=file, output=tmp_path / "out")
    assert said in str(caught.value)
    assert not (tmp_path / "out").exists()


def test_cuts_have_arcs_of_their_own(tmp_path: Path) -> None:
    table = Cutting(**dict(machine_of(tmp_path, MILL).cutting or {}))
    cuts = [
        TriedCut("as the machine", 9000.0, 1e-3, 2, verdict="stable"),
        TriedCut("less", 9000.0, 1e-3, 2, immersion=0.1, verdict="stable"),
        TriedCut("slot", 9000.0, 1e-3, 2, mode="slot", verdict="stable"),
        TriedCut("as the first", 9000.0, 2e-3, 2, verdict="stable"),
    ]
    conditions, index = conditions_of(cuts, table, ("x", "y"))
    assert index.tolist() == [0, 1, 2, 0]
    assert [at.cutting.immersion for at in conditions] == [0.5, 0.1, None]
    with pytest.raises(InputError, match="a slot is cut at 1"):
        conditions_of([TriedCut("odd", 9000.0, 1e-3, 2, mode="slot", immersion=0.3, verdict="stable")], table, ("x",))


def test_cuts_need_a_machine_and_nothing_else_is_safe(tmp_path: Path) -> None:
    cuts, file = written(tmp_path, 5)
    with pytest.raises(InputError, match="expected --machine with it"):
        trace(cuts, joint=tmp_path / "guide.joint.toml")
    with pytest.raises(InputError, match="expected a probability from"):
        trace(cuts, machine=file, safe=0.3)


@pytest.mark.slow
def test_a_mill_cut_in_time_whose_forces_were_half_as_large_again(tmp_path: Path) -> None:
    machine, shop = machine_of(tmp_path, MILL), Shop(tangential=10.5e8, normal=3.15e8)
    rng = np.random.default_rng(1)
    speed = np.round(rng.uniform(4000, 16000, 10), -1).repeat(2)
    limit = lobes_at_amplitude(bare(machine), np.unique(speed)).depth[np.unique(speed, return_inverse=True)[1]]
    depth = limit * np.where(np.arange(20) % 2, rng.uniform(1, 1.9, 20), rng.uniform(0.4, 1, 20))
    cuts = []
    for k, x in enumerate(sounds(shop, speed, depth)):
        told = heard(x, 8192.0, speed[k], 2, "cut")
        f = told.chatter_frequency if told.verdict != "stable" else None
        cuts.append(TriedCut(f"{k}", speed[k], depth[k], 2, verdict=told.verdict, chatter_frequency=f))
    found = trace_cuts(Measurement(Path("cuts"), "cuts", (), (), cuts=tuple(cuts)), machine)
    named = [] if found.chosen is None else [found.chosen.family]
    assert "coefficient" in {*named, *(r.family for r in (*found.rivals, *found.left_open))}
    assert found.chosen is not None or "rule out that something is missing" in found.sentence


@pytest.mark.parametrize(("odds", "speaks"), [(2.0, False), (5.7, True), (49.0, True)])
def test_odds_that_speak_for_something_are_told_with_those_of_all_suspects(
    odds: float, speaks: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One suspect may have more than a name needs, which counts all of them."""
    of = SimpleNamespace(evidence=np.log(78.0) - 20.0, told=lambda: Coefficient().told({"factor": 1.34}))
    best = SimpleNamespace(posterior=of, weight=of.evidence)
    found = SimpleNamespace(chosen=None, left_open=(best,), odds=np.log(odds), verdict=Verdict.NOTHING_MISSING)
    monkeypatch.setattr(sentences, "surprising", lambda *_: np.zeros(0))
    base, problem = SimpleNamespace(weight=-20.0), SimpleNamespace(cuts=())
    said = sentences.sentence(found, base, problem, None)  # type: ignore[arg-type]
    assert ("do not rule out that something is missing" in said) == speaks
    told = sentences.nearly(base, found)  # type: ignore[arg-type]
    assert len(told) == speaks
    if speaks:
        assert told[0].startswith(
            "It would make the cuts 78 times as likely if this were so: cutting forces 1.34 times"
        )
        assert f"All suspects together make them {odds:.2g} times as likely, a name needs 50: cut on." in told[0]


def test_why_what_is_likely_has_no_name_is_told() -> None:
    of = SimpleNamespace(effective=3.7, strain=0.7, told=lambda: Coefficient().told({"factor": 1.34}))
    for reached, said in (
        (False, "No name, for it has 3.7 effective draws"),
        (True, "On cuts held out it does no better"),
    ):
        best = SimpleNamespace(posterior=of, weight=0.0, reached=reached)
        found = SimpleNamespace(chosen=None, left_open=(best,), odds=np.log(7500.0))
        (told,) = sentences.nearly(SimpleNamespace(weight=-9.0), found)  # type: ignore[arg-type]
        assert said in told
        assert "need" not in told


def test_no_cut_is_told_to_be_safe_by_draws_that_do_not_explain_the_cuts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A mode of 560 Hz that nobody measured: the cut that was told as safe at 0.95 lay at 1.7 times the border."""
    machine = machine_of(tmp_path)
    outcomes = {}
    for verdict in (Verdict.UNEXPLAINED, Verdict.NOTHING_MISSING):
        monkeypatch.setattr(contest, "_unnamed", lambda *_, v=verdict: v)
        outcomes[verdict] = trace_cuts(campaign(machine, 3), machine, draws=100)
    assert outcomes[Verdict.NOTHING_MISSING].safe_cut is not None
    assert outcomes[Verdict.UNEXPLAINED].safe_cut is None
    assert any("no cut is told to be safe" in line for line in outcomes[Verdict.UNEXPLAINED].words())


def test_a_campaign_is_read_as_it_was_written(tmp_path: Path) -> None:
    cuts, _ = written(tmp_path, 2)
    back = read_measurement(cuts)
    assert len(back.cuts) == 18
    assert {cut.verdict for cut in back.cuts} == {"stable", "chatter"}


def test_suspects_that_few_draws_put_far_behind_are_not_drawn_in_full(monkeypatch: pytest.MonkeyPatch) -> None:
    """And who may be named but has few effective draws is moved three times as often."""
    behind = {"likely": (20.0, 40.0), "near": (16.0, 8.0), "far": (12.0, 8.0), "no name": (2.0, 8.0)}
    tried: list[tuple[str, int, int]] = []

    def drawn(suspect: str, problem: SimpleNamespace, most: int | None = None, times: int = 1) -> SimpleNamespace:
        tried.append((suspect, min(most or problem.tool.count, problem.tool.count), times))
        evidence, effective = behind[suspect]
        return SimpleNamespace(evidence=evidence, effective=effective, count=tried[-1][1])

    monkeypatch.setattr(tempered, "posterior", drawn)
    again = [("near", 2000, 1), ("near", 2000, 3)]
    cases = (
        (2000, list(behind), [("likely", 2000, 1), *again]),
        (2000, ["no name"], []),
        (300, list(behind), [("near", 300, 3)]),
    )
    for count, suspects, more in cases:
        tried.clear()
        problem = SimpleNamespace(tool=SimpleNamespace(count=count))
        found = tempered.posteriors(suspects, problem, 12.0)  # type: ignore[arg-type]
        assert tried == [*((one, 300, 1) for one in suspects), *more]
        in_full = {name for name, _, _ in more}
        assert [one.count for one in found] == [count if one in in_full else 300 for one in suspects]


def test_the_frequency_of_a_missing_mode_is_one_number_only_where_the_cuts_place_it() -> None:
    missing = MissingMode(0, "x", 500.0, 900.0, 1e-7)
    value = {"frequency": 1439.0, "stiffness": 1e7, "damping_ratio": 0.03}
    assert "near 1439 Hz" in missing.told_within(value, {"frequency": (1390.0, 1480.0)})
    wide = missing.told_within(value, {"frequency": (551.0, 1648.0)})
    assert "1439" not in wide
    assert "from 551 to 1648 Hz" in wide


@pytest.mark.parametrize(("heard", "top"), [(0.0, 1440.0), (1200.0, 1440.0), (1800.0, 2070.0), (9000.0, 3600.0)])
def test_a_mode_may_be_missing_where_chatter_was_heard(heard: float, top: float) -> None:
    missing = MissingMode(0, "x", 500.0, 900.0, 1e-7, heard)
    frequency = missing.values(np.array([[-6.0, 0.0, 0.0], [0.0, 0.0, 0.0], [6.0, 0.0, 0.0]]))[:, 0]
    np.testing.assert_allclose(frequency, [300.0, np.sqrt(300.0 * top), top], rtol=1e-3)
    assert missing.highest == pytest.approx(1.15 / 1.6 * top)


def test_the_highest_chatter_that_was_heard_goes_to_the_modes_that_may_be_missing(tmp_path: Path) -> None:
    machine = machine_of(tmp_path)
    tool, table = sampled_tool(machine, 10, 0, 25.0), Cutting(**dict(machine.cutting or {}))
    tops = [
        one.top
        for heard in (0.0, 2.5 * tool.highest)
        for one in suspects_of(tool, table, 4100.0, 1e-3, heard)[0]
        if isinstance(one, MissingMode)
    ]
    low, high = tops[: len(tops) // 2], tops[len(tops) // 2 :]
    np.testing.assert_allclose(high, 2.875 * tool.highest, rtol=1e-9)
    np.testing.assert_allclose(low, 1.6 * tool.highest, rtol=1e-9)


def test_the_chance_of_a_cut_that_is_asked_for_is_that_of_the_map(tmp_path: Path) -> None:
    machine = machine_of(tmp_path)
    problem = asked(machine, campaign(machine, 0), 150)
    believed = [entry(posterior(AsItIs(), problem), problem, folds_of(problem))]
    seen = outlook(machine, problem, believed, 0.95, 0)
    rows = [(i, int(np.argmin(np.abs(seen.probability[i] - p)))) for i, p in ((4, 0.9), (11, 0.5), (19, 0.2))]
    told = [chance_at(machine, problem, believed, seen.speed[i], seen.depth[k], 0) for i, k in rows]
    np.testing.assert_allclose(told, [seen.probability[i, k] for i, k in rows], atol=0.06)
