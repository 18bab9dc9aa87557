"""Cutters with unequal pitches, helix and rubbing flanks: their limits by methods that share no solver."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from revolution_steps import Case, growth_by_steps, growth_in_time
from scipy.optimize import fsolve
from semi_discretization import extrapolated

from jointlib.errors import CheckFailed, InputError
from machines import Lumped, Machine, lobes_at_amplitude
from machines.cutting.amplitude.frozen_modes import multipliers as multipliers_of
from machines.cutting.cutters.growing import growing
from machines.cutting.cutters.pattern_map import pattern_map
from machines.cutting.cutters.pattern_multipliers import largest_multipliers
from machines.cutting.in_time.witness import vibrate
from machines.cutting.loops import multipliers
from machines.cutting.process.cutter import Cutter
from machines.cutting.rest.cutter_search import CutterSearch
from machines.lobes import Cutting, stability_lobes, unstable_depths, unstable_depths_of, witness
from machines.tool.tool_model import ToolModel
from machines.tool.tool_point import tool_point

TOOL = ToolModel.from_modes([800.0] * 2, [0.02] * 2, [1.0] * 2, np.eye(2))
"""1 kg at 800 Hz in both directions."""
STRAIGHT = Cutting("milling", teeth=4, tangential=2e8, normal=6e7, mode="down", immersion=0.5)
PAIRS = (70.0, 110.0, 70.0, 110.0)
TWISTED = replace(STRAIGHT, helix=40.0, diameter=0.012)


@pytest.mark.parametrize(
    ("cutting", "speed", "millimetres"),
    [
        (replace(STRAIGHT, pitch=PAIRS), 5000.0, 18.68208),
        (replace(STRAIGHT, pitch=PAIRS), 9000.0, 14.24808),
        (TWISTED, 9000.0, 10.30823),
    ],
)
@pytest.mark.parametrize("method", ["multi-frequency", "collocation"])
def test_reference_depths_of_a_semi_discretisation_over_the_revolution(
    cutting: Cutting, speed: float, millimetres: float, method: str
) -> None:
    chart = stability_lobes(TOOL, cutting, [speed], method)
    assert 1e3 * chart.depth[0] == pytest.approx(millimetres, rel=1e-5)
    assert chart.kind[0] == "hopf"


@pytest.mark.slow
def test_harmonics_and_collocation_agree_for_every_kind_of_cutter() -> None:
    two = ToolModel.from_modes([620.0, 910.0], [0.03, 0.025], [0.8, 0.6], np.eye(2))
    for more in (
        {"pitch": (84.0, 96.0, 85.0, 95.0)},
        {"pitch": (84.0, 96.0, 85.0, 95.0), "helix": (30.0, 34.0, 31.0, 33.0)},
        {"helix": (0.0, 35.0, 0.0, 35.0)},
        {"pitch": (120.0, 110.0, 130.0), "teeth": 3, "helix": 50.0, "process_damping": 3e4, "mode": "up"},
        {"mode": "slot", "immersion": None, "pitch": (150.0, 210.0), "teeth": 2},
    ):
        cutting = replace(STRAIGHT, **{"diameter": 0.016, **more})
        found = [stability_lobes(two, cutting, [9100.0], method) for method in ("multi-frequency", "collocation")]
        np.testing.assert_allclose(found[0].depth, found[1].depth, rtol=1e-4)
        np.testing.assert_allclose(found[0].chatter_frequency, found[1].chatter_frequency, rtol=1e-4)


def test_without_anything_uneven_it_is_the_chart_of_even_cutters() -> None:
    speeds = [5000.0, 7300.0, 12500.0]
    even = stability_lobes(TOOL, STRAIGHT, speeds, "collocation")
    point = tool_point(TOOL, TOOL.axes, TOOL.lines)
    search = CutterSearch.of(point, STRAIGHT, TOOL)
    depth = [search.found(rpm)[0][0].crossing.depth for rpm in speeds]
    np.testing.assert_allclose(depth, even.depth, rtol=1e-6)
    at = np.array([4e-3, 9e-3])
    whole = [
        np.abs(np.linalg.eigvals(pattern_map(TOOL, Cutter.of(STRAIGHT), np.array([5000.0]), b).maps()[0])) for b in at
    ]
    beside = multipliers.largest_multipliers(TOOL, STRAIGHT, np.array([5000.0]), at)[0]
    np.testing.assert_allclose([np.max(one) for one in whole], beside, rtol=1e-6)
    same = replace(STRAIGHT, pitch=(90.0,) * 4, helix=0.0, process_damping=0.0)
    assert np.array_equal(stability_lobes(TOOL, same, speeds, "collocation").depth, even.depth)


@pytest.mark.slow
def test_pitches_that_hardly_differ_chatter_like_even_ones() -> None:
    near = replace(STRAIGHT, pitch=(90.001, 89.999, 90.0005, 89.9995))
    even, other = (stability_lobes(TOOL, c, [5000.0, 9000.0], "multi-frequency").depth for c in (STRAIGHT, near))
    np.testing.assert_allclose(other, even, rtol=1e-4)


def test_where_the_helix_takes_a_whole_pitch_only_the_mean_of_the_cut_is_left() -> None:
    lag = 2 * np.tan(np.radians(40)) / 0.012
    depth = np.pi / 2 / lag
    point = tool_point(TOOL, TOOL.axes, TOOL.lines)
    loop = CutterSearch.of(point, TWISTED).loop(9000.0)
    nu = np.linspace(0.03, 0.47, 9)
    found = np.linalg.eigvals(loop.closed(nu, depth))
    omega = 2 * np.pi * loop.frequency * (nu[:, None] + loop.orders)
    late = 1 - np.exp(-1j * omega * np.pi / 2 / (2 * np.pi * 150))
    alone = np.linalg.eigvals(depth * (TWISTED.mean_stiffness @ TOOL(omega / (2 * np.pi))) * late[..., None, None])
    np.testing.assert_allclose(
        np.sort(np.abs(found)), np.sort(np.abs(alone).reshape(len(nu), -1)), rtol=1e-8, atol=1e-14
    )


def test_nyquist_counts_the_multipliers_that_grow() -> None:
    cutting = replace(TWISTED, pitch=(84.0, 96.0, 85.0, 95.0), immersion=0.1, helix=30.0)
    cutter, point = Cutter.of(cutting), tool_point(TOOL, TOOL.axes, TOOL.lines)
    search = CutterSearch.of(point, cutting)
    seen = set()
    for speed in (6000.0, 11900.0, 16000.0):
        loop = search.loop(speed)
        nu = np.concatenate([[0.0], search.resolved.folded(loop.frequency)])
        for depth in (10e-3, 45e-3, 90e-3):
            count = growing(lambda v, b=depth, one=loop: one.closed(v, b), nu)[0]
            mu = np.linalg.eigvals(pattern_map(TOOL, cutter, np.array([speed]), depth, 9).maps()[0])
            assert count == np.count_nonzero(np.abs(mu) > 1)
            seen.add(count)
    assert len(seen) > 1


@pytest.mark.thorough
def test_a_helix_closes_period_doubling_into_an_island_that_multipliers_confirm() -> None:
    thin = Cutting("milling", teeth=1, tangential=6e8, normal=2e8, mode="down", immersion=0.05, diameter=0.008)
    soft = ToolModel.from_modes([800.0], [0.02], [0.03], np.eye(1), ("x",))
    for helix, islands in ((0.0, 0), (30.0, 1)):
        cutting = replace(thin, helix=helix)
        chart = stability_lobes(soft, cutting, [31000.0], "collocation")
        (found,) = unstable_depths_of(soft, cutting, chart, 12e-3)
        assert len(found.lenses) == islands
        for one in found.intervals:
            depth = np.array([0.99 * one.low, 1.01 * one.low, min(1.01 * one.high, found.deepest)])
            mu = [largest_multipliers(soft, cutting, np.array([31000.0]), np.array([b]))[0, 0] for b in depth]
            assert (np.array(mu) > 1).tolist() == [False, True, not np.isfinite(one.high)]
    (alike,) = unstable_depths_of(soft, cutting, stability_lobes(soft, cutting, [31000.0], "multi-frequency"), 12e-3)
    np.testing.assert_allclose([i.low for i in alike.intervals], [i.low for i in found.intervals], rtol=1e-4)


def test_a_fold_is_met_where_an_even_cutter_would_double_its_period() -> None:
    thin = Cutting("milling", teeth=2, tangential=6e8, normal=2e8, mode="down", immersion=0.05)
    soft = ToolModel.from_modes([800.0], [0.02], [0.03], np.eye(1), ("x",))
    even = stability_lobes(soft, thin, [15500.0], "collocation")
    other = stability_lobes(soft, replace(thin, pitch=(179.9, 180.1)), [15500.0], "collocation")
    assert even.kind[0] == "flip"
    assert other.kind[0] == "fold"
    assert other.chatter_frequency[0] == pytest.approx(even.chatter_frequency[0], rel=1e-9)
    assert other.depth[0] == pytest.approx(even.depth[0], rel=0.01)


def test_unequal_pitches_in_zero_order_take_the_mean_of_their_delays() -> None:
    cutting = replace(STRAIGHT, pitch=(60.0, 120.0, 80.0, 100.0), mode="slot", immersion=None)
    one = ToolModel.from_modes([800.0], [0.02], [1.0], np.eye(1), ("x",))
    depth = stability_lobes(one, cutting, [8000.0], "zero-order").depth[0]
    late = np.radians(cutting.pitch) / (2 * np.pi * 8000 / 60)
    f = np.linspace(400.0, 1500.0, 400001)
    value = (
        cutting.mean_stiffness[0, 0] * one(f)[:, 0, 0] * np.mean(1 - np.exp(-2j * np.pi * f[:, None] * late), axis=1)
    )
    crossed = np.flatnonzero((value.imag[1:] * value.imag[:-1] < 0) & (value.real[1:] < 0))
    assert depth == pytest.approx(np.min(-1 / value.real[crossed]), rel=1e-4)


@pytest.mark.parametrize("speed", [60.0, 150.0, 700.0, 2500.0])
def test_process_damping_in_turning_is_the_closed_form(speed: float) -> None:
    natural, zeta, k, K_s, C, diameter = 2 * np.pi * 120.0, 0.03, 2e7, 1.2e9, 8e4, 0.08
    tool = ToolModel.from_modes([120.0], [zeta], [k / natural**2], np.eye(1), ("x",))
    cutting = Cutting("turning", specific=K_s, process_damping=C, diameter=diameter)
    chart = stability_lobes(tool, cutting, [speed])
    v, tau = np.pi * diameter * speed / 60, 60 / speed

    def equation(unknown: np.ndarray) -> list[float]:
        b, omega = unknown[0] * 1e-3, unknown[1] * natural
        c = 2 * zeta * k / natural + C * b / v
        dynamic = k - k * omega**2 / natural**2 + 1j * c * omega + K_s * b * (1 - np.exp(-1j * omega * tau))
        return [dynamic.real / k, dynamic.imag / k]

    start = [1e3 * chart.depth[0], 2 * np.pi * chart.chatter_frequency[0] / natural]
    exact = fsolve(equation, start, xtol=1e-14)
    assert 1e-3 * exact[0] == pytest.approx(chart.depth[0], rel=1e-9)
    if speed > 500:
        mu = largest_multipliers(tool, cutting, np.array([speed]), chart.depth[:1] * np.array([0.999, 1.001]))
        assert mu[0, 0] < 1 < mu[0, 1]
    none = stability_lobes(tool, replace(cutting, process_damping=None), [speed])
    assert chart.depth[0] > none.depth[0]


@pytest.mark.slow
def test_process_damping_lifts_the_slow_lobes_of_a_mill_and_leaves_the_fast_ones() -> None:
    rubbed = replace(STRAIGHT, process_damping=2e4, diameter=0.02)
    rise = []
    for speeds in ([1500.0, 1540.0, 1580.0, 1620.0], [3000.0, 3200.0, 3400.0], [9500.0, 10500.0, 11500.0]):
        lifted = [stability_lobes(TOOL, c, speeds, "multi-frequency").minimum_depth for c in (STRAIGHT, rubbed)]
        rise.append(lifted[1] / lifted[0])
    assert rise[0] > rise[1] > rise[2] > 1
    assert rise[0] > 1.2


@pytest.mark.slow
def test_process_damping_in_milling_agrees_with_the_cut_stepped_in_time() -> None:
    cutting = replace(STRAIGHT, process_damping=3e4, diameter=0.02)
    depth = float(stability_lobes(TOOL, cutting, [6000.0], "collocation").depth[0])
    cases = [_case(TOOL_OF, cutting, 6000.0, depth * share) for share in (0.995, 1.005)]
    grown = growth_in_time(cases, 600)
    assert grown[0] < 1 < grown[1]


UNLIKE = (84.0, 96.0, 85.0, 95.0)


def mill(**more: Any) -> Machine:
    """`TOOL` in the cut of `STRAIGHT`, as a machine."""
    cutting = {"process": "milling", "teeth": 4, "tangential": 2e8, "normal": 6e7, "mode": "down", "immersion": 0.5}
    k = (2 * np.pi * 800) ** 2
    tool = Lumped("tool", ("x", "y"), np.eye(2), 2 * 0.02 * np.sqrt(k) * np.eye(2), k * np.eye(2))
    axes = {"x": "tool.x", "y": "tool.y"}
    return Machine((tool,), (), tool=axes, frequency=(300.0, 2000.0), cutting=cutting | {"diameter": 0.012} | more)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("more", "waves", "within"),
    [
        pytest.param({"helix": 40.0}, 120, 5e-3, marks=pytest.mark.thorough),
        pytest.param({"process_damping": 3e4}, 120, 5e-3, marks=pytest.mark.thorough),
        ({"pitch": PAIRS}, 120, 5e-3),
        pytest.param({"helix": (40.0, 38.0, 40.0, 38.0)}, 120, 5e-3, marks=pytest.mark.thorough),
        pytest.param({"pitch": UNLIKE, "helix": 30.0}, 400, 0.02, marks=pytest.mark.slow),
        pytest.param({"pitch": UNLIKE}, 900, 0.02, marks=pytest.mark.slow),
        # With a feed the edges leave the cut where the chip ends, which the multipliers do not know.
        pytest.param({"pitch": UNLIKE, "feed": 1e-4, "helix": 30.0}, 400, 0.3, marks=pytest.mark.slow),
        pytest.param({"pitch": PAIRS, "feed": 1e-4}, 400, 0.3, marks=pytest.mark.slow),
        pytest.param(
            {"pitch": UNLIKE, "helix": (30.0, 33.0, 31.0, 35.0), "process_damping": 2e4},
            400,
            0.02,
            marks=pytest.mark.slow,
        ),
    ],
)
def test_the_simulated_cut_grows_and_dies_as_the_multipliers_of_any_cutter_say(
    more: dict[str, Any], waves: int, within: float
) -> None:
    machine = mill(**more)
    depth = float(lobes_at_amplitude(machine, [9000.0]).depth[0])
    for share in (0.97, 1.03):
        mu = float(multipliers_of(machine, [9000.0], [share * depth])[0, 0])
        found = witness(machine, 9000.0, share * depth, [1e-7], rounds=1, waves=waves)
        assert found.rate == pytest.approx(np.log(mu) * 600, rel=within)
        assert np.all(found.grows == (share > 1))


@pytest.mark.slow
def test_no_simulated_cut_denies_the_unstable_depths_of_uneven_cutters() -> None:
    for more, speed in (
        ({"pitch": PAIRS}, 5000.0),
        ({"helix": (30.0, 36.0, 30.0, 36.0)}, 6100.0),
        ({"pitch": (75.0, 105.0, 85.0, 95.0), "helix": 20.0}, 7000.0),
        ({"pitch": (150.0, 210.0), "teeth": 2, "immersion": 0.1, "tangential": 6e8, "normal": 2e8}, 12500.0),
    ):
        machine = mill(**more)
        (zones,) = unstable_depths(machine, lobes_at_amplitude(machine, [speed]))
        assert zones.intervals
        for zone in zones.intervals:
            depths = [(0.97 * zone.low, False), (1.03 * zone.low, True)]
            depths += [(0.97 * zone.high, True), (1.03 * zone.high, False)] if np.isfinite(zone.high) else []
            for depth, chatters in depths:
                if depth / zones.deepest > 0.97 or any(
                    one.low * 0.98 < depth < one.high * 1.02 for one in zones.intervals if one != zone
                ):
                    continue
                found = witness(machine, speed, depth, [1e-7], rounds=1, waves=400)
                assert bool(found.grows[0]) == chatters, (more, depth)


@pytest.mark.slow
def test_the_simulated_cut_of_pitches_that_hardly_differ_is_that_of_even_ones() -> None:
    at, motions = np.linspace(0.0, 0.05, 3001), []
    for pitch in ((90.0,) * 4, (90.00001, 89.99999, 90.00001, 89.99999)):
        run = vibrate(mill(pitch=pitch, feed=5e-5), 9000.0, 8e-3, np.array([1e-6]), 850.0, waves=60).run
        time = (np.arange(len(run.motion))[:, None] * run.period + run.time).ravel()
        motions.append(np.stack([np.interp(at, time, run.motion[:, :, k, 0].ravel()) for k in (0, 1)]))
    even, other = motions
    assert np.max(np.abs(other - even)) < 1e-3 * np.ptp(even)


def test_uneven_flutes_are_simulated_at_one_depth_and_not_where_they_hide_a_fold() -> None:
    machine = mill(pitch=PAIRS, feed=1e-4)
    with pytest.raises(InputError, match="several depths at once"):
        vibrate(machine, 9000.0, [1e-3, 2e-3], np.array([1e-6, 1e-6]), 800.0)
    with pytest.raises(InputError, match="900 Hz repeats with the flutes at 9000 rpm"):
        vibrate(machine, 9000.0, 1e-3, np.array([1e-6]), 900.0)


def test_bad_cutters_are_refused_in_one_sentence() -> None:
    for more, said in (
        ({"pitch": (70.0, 110.0, 70.0, 111.0)}, "pitch is 361 degrees in all, expected 360"),
        ({"pitch": (120.0, 120.0, 120.0)}, "pitch has 3 angles, expected one a tooth, 4"),
        ({"pitch": (-90.0, 270.0, 90.0, 90.0)}, "pitch holds -90 degrees, expected more than 0"),
        ({"helix": 90.0, "diameter": 0.01}, "helix is 90 degrees, expected from 0 to below 90"),
        ({"helix": 30.0}, "helix needs 'diameter', of the cutter, which is missing"),
        ({"helix": (30.0, 35.0), "diameter": 0.01}, "helix has 2 angles, expected one, or one a tooth, 4"),
        ({"process_damping": 1e5}, "process_damping needs 'diameter', of the cutter"),
        ({"process_damping": -1.0, "diameter": 0.01}, "process_damping is -1.0, expected at least 0, in N/m"),
    ):
        with pytest.raises(InputError, match=said.replace("(", r"\(")):
            replace(STRAIGHT, **more)
    with pytest.raises(InputError, match="'pitch' belongs to milling"):
        Cutting("turning", specific=1e9, pitch=(360.0,))
    with pytest.raises(InputError, match="zero-order: the flutes have different helices"):
        stability_lobes(TOOL, replace(STRAIGHT, helix=(30.0, 32.0, 30.0, 32.0), diameter=0.01), [9000.0], "zero-order")
    meeting = replace(STRAIGHT, helix=(0.0, 60.0, 0.0, 60.0), diameter=0.01)
    with pytest.raises(CheckFailed, match="two flutes of different helix meet"):
        largest_multipliers(TOOL, meeting, np.array([9000.0]), np.array([20e-3]))


TOOL_OF = ((800.0, 800.0), (0.02, 0.02), (1.0, 1.0))


def _case(tool: Any, cutting: Cutting, speed: float, depth: float) -> Case:
    """The same cut for the routes in time."""
    hertz, ratio, mass = tool
    assert cutting.teeth is not None
    pitch = (360 / cutting.teeth,) * cutting.teeth if cutting.pitch is None else cutting.pitch
    helix = np.broadcast_to(np.asarray(cutting.helix or 0.0), (cutting.teeth,))
    lag = np.zeros(cutting.teeth) if cutting.diameter is None else 2 * np.tan(np.radians(helix)) / cutting.diameter
    rubbing = (cutting.process_damping or 0.0) / (np.pi * (cutting.diameter or 1.0) * speed / 60)
    return Case(
        tuple(2 * np.pi * f for f in hertz),
        ratio,
        mass,
        cutting.tangential or 0.0,
        cutting.normal or 0.0,
        (cutting.entry_angle, cutting.exit_angle),
        tuple(np.radians(pitch).tolist()),
        tuple(lag.tolist()),
        speed,
        depth,
        rubbing,
    )


def random_cutter(rng: np.random.Generator) -> tuple[Any, Cutting, float]:
    """A tool, an uneven cutter and a speed at which a few waves pass in a revolution."""
    hertz = tuple(rng.uniform(400, 900, 2).tolist())
    tool = hertz, tuple(rng.uniform(0.015, 0.05, 2).tolist()), tuple(rng.uniform(0.5, 2.0, 2).tolist())
    teeth, kind = int(rng.integers(2, 5)), int(rng.integers(4))
    more: dict[str, Any] = {"diameter": float(rng.uniform(0.008, 0.02))}
    if kind != 1:
        pitch = 360 / teeth * (1 + rng.uniform(-0.25, 0.25, teeth))
        pitch = np.round(pitch * 360 / np.sum(pitch), 3)
        pitch[-1] = 360 - np.sum(pitch[:-1])
        more["pitch"] = tuple(pitch.tolist())
    if kind:
        more["helix"] = float(rng.uniform(15, 50))
    if kind == 3:
        more["helix"] = tuple((more["helix"] + rng.uniform(-3, 3, teeth)).tolist())
    if rng.random() < 0.25:
        more["process_damping"] = float(rng.uniform(5e3, 5e4))
    mode = str(rng.choice(["up", "down", "slot"]))
    arc = {} if mode == "slot" else {"immersion": float(rng.uniform(0.05, 0.9))}
    cutting = Cutting("milling", teeth=teeth, tangential=6e8, normal=2e8, mode=mode, **arc, **more)
    return tool, cutting, float(60 * max(hertz) / rng.uniform(1.5, 8.0))


@pytest.mark.slow
def test_a_hundred_random_cutters_are_classified_as_two_other_routes_do() -> None:
    rng = np.random.default_rng(20)
    cases, told = list[Case](), list[bool]()
    while len(cases) < 300:
        tool, cutting, speed = random_cutter(rng)
        model = ToolModel.from_modes(*tool, np.eye(2))
        chart = stability_lobes(model, cutting, [speed], "collocation")
        if not np.isfinite(chart.depth[0]) or chart.depth[0] > 40e-3:
            continue
        beside = stability_lobes(model, cutting, [speed], "multi-frequency").depth[0]
        assert beside == pytest.approx(chart.depth[0], rel=1e-4)
        for share in (0.988, 1.012, rng.uniform(0.4, 1.6)):
            depth = chart.depth[0] * share
            mu = float(largest_multipliers(model, cutting, np.array([speed]), np.array([depth]))[0, 0])
            if 0.98 < share < 1.02:
                assert (mu > 1) == (share > 1)
            cases.append(_case(tool, cutting, speed, float(depth)))
            told.append(mu > 1)
    coarse, fine = (growth_by_steps(cases, steps) for steps in (360, 720))
    by_steps = extrapolated(coarse, fine) > 1
    assert np.flatnonzero(by_steps != told).tolist() == []
    every = np.arange(100) * 3 + np.arange(100) % 3
    in_time = growth_in_time([cases[i] for i in every], 720) > 1
    assert every[in_time != np.array(told)[every]].tolist() == []
