"""Milling lobes that keep the tooth frequency: known figures, and three formulations against each other."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from repeats import repeats
from semi_discretization import extrapolated, largest_multiplier, mean_stiffness

from jointlib.arrays import Array
from jointlib.frf import FRF
from machines.cutting.loops.collocation import arc_map
from machines.cutting.loops.critical_depth import first_crossings, near
from machines.cutting.loops.loop_branches import Crossing
from machines.cutting.loops.multi_frequency import HarmonicLoop
from machines.cutting.loops.multipliers import largest_multipliers
from machines.lobes import Cutting, StabilityLobes, stability_lobes
from machines.tool.bounded_band import spectrum
from machines.tool.tool_model import ToolModel
from machines.tool.tool_point import tool_point

NATURAL, ZETA, MASS = 922.0, 0.011, 0.03993
SPEEDS = (5000.0, 10000.0, 18000.0)
DEPTHS = np.array([0.2e-3, 0.5e-3, 1.0e-3])


def common_tool(directions: int) -> ToolModel:
    """The 922 Hz tool common since Insperger and Stépán, in x or in x and y."""
    n = directions
    return ToolModel.from_modes([NATURAL] * n, [ZETA] * n, [MASS] * n, np.eye(n), ("x", "y")[:n])


def common_cut(mode: str, immersion: float | None = None) -> Cutting:
    return Cutting("milling", teeth=2, tangential=6e8, normal=2e8, mode=mode, immersion=immersion)


def two_mode_tool() -> ToolModel:
    natural, stiffness = np.array([603.0, 666.0]), np.array([5.59e6, 5.715e6])
    return ToolModel.from_modes(natural, [0.039, 0.035], stiffness / (2 * np.pi * natural) ** 2, np.eye(2))


def random_tool(seed: int) -> ToolModel:
    """Three modes in random directions, so with cross terms."""
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0, np.pi, 3)
    natural = rng.uniform(350, 1100, 3)
    mass = rng.uniform(4e6, 2e7, 3) / (2 * np.pi * natural) ** 2
    return ToolModel.from_modes(natural, rng.uniform(0.01, 0.05, 3), mass, np.array([np.cos(angle), np.sin(angle)]))


def random_cut(seed: int) -> tuple[Cutting, float]:
    rng = np.random.default_rng(1000 + seed)
    mode = ("up", "down")[seed % 2]
    cutting = Cutting(
        "milling",
        teeth=int(rng.integers(1, 5)),
        tangential=6e8,
        normal=float(rng.uniform(0.1, 0.6)) * 6e8,
        mode=mode,
        immersion=float(rng.uniform(0.1, 0.9)),
    )
    return cutting, float(rng.uniform(6000, 16000))


def harmonic(tool: ToolModel, cutting: Cutting, speed: float, harmonics: int) -> HarmonicLoop:
    point = tool_point(tool, tool.axes, tool.lines)
    axes = tuple("xy".index(axis) for axis in tool.axes)
    tooth = cutting.cuts_per_revolution * speed / 60
    return HarmonicLoop(spectrum(point, 1e5), cutting, axes, tooth, harmonics)


FRACTION = np.append(np.linspace(0.002, 0.498, 200), 0.5)


def lowest(tool: ToolModel, cutting: Cutting, speed: float, harmonics: int) -> Crossing:
    return first_crossings(harmonic(tool, cutting, speed, harmonics), FRACTION)[0]


@pytest.mark.parametrize(
    ("directions", "mode", "immersion", "expected"),
    [
        (1, "slot", None, (0.8197428, 1.0739756, 1.4064735)),
        (1, "down", 0.5, (0.6937248, 0.8123829, 1.0862082)),
        (1, "up", 0.5, (0.9157372, 1.3058590, 1.7580477)),
        (2, "slot", None, (2.1365915, 5.0977453, 10.9039006)),
    ],
)
def test_multipliers_at_5000_rpm(
    directions: int, mode: str, immersion: float | None, expected: tuple[float, ...]
) -> None:
    cutting = common_cut(mode, immersion)
    found = largest_multipliers(common_tool(directions), cutting, np.array([5000.0]), DEPTHS)[0]
    assert found == pytest.approx(np.array(expected), abs=1e-6)

    k = MASS * (2 * np.pi * NATURAL) ** 2
    c = 2 * ZETA * np.sqrt(k * MASS)
    one = np.eye(directions)
    arc = cutting.entry_angle, cutting.exit_angle
    coarse, fine = (
        largest_multiplier(
            MASS * one, c * one, k * one, mean_stiffness(n, 2, 6e8, 2e8, arc, directions), 5000.0, 2, DEPTHS
        )
        for n in (160, 320)
    )
    assert found == pytest.approx(extrapolated(coarse, fine), rel=3e-5)


FIGURES = [
    (1, "slot", None, (0.4086278, 0.3223790, 0.6895392), "HHH", (0.3437, 0.2090, 0.4008)),
    (1, "down", 0.5, (0.8472035, 2.104690, 1.619698), "HFH", (0.3845, 0.5, 0.4497)),
    (1, "down", 0.1, (1.296263, 2.518412, 0.8156572), "HFF", (0.3861, 0.5, 0.5)),
    (2, "slot", None, (0.04750654, 0.07141078, 0.04787222), "HHH", (0.4538, 0.2488, 0.4598)),
    (2, "down", 0.5, (0.1271062, 0.1810301, 0.1302299), "HHH", (0.4487, 0.2455, 0.4578)),
]


@pytest.mark.parametrize(("directions", "mode", "immersion", "depth", "kind", "fraction"), FIGURES)
@pytest.mark.parametrize(("method", "tolerance"), [("collocation", 1e-5), ("multi-frequency", 2e-5)])
def test_critical_depths_of_the_common_tool(
    directions: int,
    mode: str,
    immersion: float | None,
    depth: tuple[float, ...],
    kind: str,
    fraction: tuple[float, ...],
    method: str,
    tolerance: float,
) -> None:
    lobes = stability_lobes(common_tool(directions), common_cut(mode, immersion), SPEEDS, method)
    assert lobes.depth * 1e3 == pytest.approx(np.array(depth), rel=tolerance)
    assert lobes.kind.tolist() == [{"H": "hopf", "F": "flip"}[letter] for letter in kind]
    waves = lobes.chatter_frequency / (np.array(SPEEDS) / 30)
    assert np.abs(waves - np.rint(waves)) == pytest.approx(np.array(fraction), abs=6e-5)
    assert lobes.lobe.tolist() == np.floor(waves).tolist()
    # The tool answers most near its natural frequency, so that is where it chatters.
    assert np.all(np.abs(lobes.chatter_frequency / NATURAL - 1) < 0.11)


@pytest.mark.thorough
@pytest.mark.parametrize(("directions", "mode", "immersion", "depth", "kind", "fraction"), FIGURES)
def test_a_stated_number_of_harmonics_reaches_its_accuracy(
    directions: int, mode: str, immersion: float | None, depth: tuple[float, ...], kind: str, fraction: object
) -> None:
    """A slot needs no more than the modes; at partial immersion the tooth force jumps and P = 25 is good to 2·10⁻⁴."""
    tool, cutting = common_tool(directions), common_cut(mode, immersion)
    for speed, expected in zip(SPEEDS, depth, strict=True):
        found = lowest(tool, cutting, speed, 25)
        assert found.depth * 1e3 == pytest.approx(expected, rel=1e-6 if mode == "slot" else 2e-4)
        if mode != "slot":
            assert near(harmonic(tool, cutting, speed, 100), found).depth * 1e3 == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("method", ["collocation", "multi-frequency"])
@pytest.mark.parametrize(
    ("mode", "immersion", "depth"),
    [
        ("slot", None, (1.34341, 0.80495, 2.76449, 1.33676, 0.79826)),
        ("up", 0.5, (2.02847, 1.12348, 4.29113, 1.93250, 1.14249)),
    ],
)
def test_critical_depths_of_the_two_mode_tool(
    mode: str, immersion: float | None, depth: tuple[float, ...], method: str
) -> None:
    cutting = Cutting("milling", teeth=3, tangential=6e8, normal=0.07 * 6e8, mode=mode, immersion=immersion)
    lobes = stability_lobes(two_mode_tool(), cutting, [6000, 9000, 12000, 15000, 20000], method)
    assert lobes.depth * 1e3 == pytest.approx(np.array(depth), rel=1e-5)
    assert set(lobes.kind) == {"hopf"}


def test_a_lens_of_instability_is_not_jumped_over() -> None:
    """One direction, a/D = 0.1 down, 18 000 rpm: unstable from .816 to 3.12 mm, stable to 3.83, unstable above."""
    depth = np.array([0.80e-3, 0.83e-3, 3.0e-3, 3.2e-3, 3.7e-3, 3.9e-3])
    stable = largest_multipliers(common_tool(1), common_cut("down", 0.1), np.array([18000.0]), depth)[0] < 1
    assert stable.tolist() == [True, False, False, True, True, False]


@pytest.mark.parametrize("seed", repeats(range(6), lambda seed: seed == 0))
def test_harmonics_of_a_receptance_agree_with_modes_in_time(seed: int) -> None:
    tool = random_tool(seed)
    cutting, speed = random_cut(seed)
    exact = stability_lobes(tool, cutting, speed, "collocation")
    coarse = lowest(tool, cutting, speed, 25)
    assert coarse.depth == pytest.approx(float(exact.depth), rel=2e-4)
    middle, fine = (near(harmonic(tool, cutting, speed, P), coarse) for P in (50, 150))
    assert fine.depth == pytest.approx(float(exact.depth), rel=1e-5)
    assert abs(fine.depth / exact.depth - 1) <= abs(middle.depth / exact.depth - 1) + 1e-9
    settled = stability_lobes(tool, cutting, speed, "multi-frequency")
    assert float(settled.depth) == pytest.approx(float(exact.depth), rel=3e-5)
    assert (str(settled.kind), int(settled.lobe)) == (str(exact.kind), int(exact.lobe))
    assert float(settled.chatter_frequency) == pytest.approx(float(exact.chatter_frequency), rel=1e-4)


@pytest.mark.parametrize("seed", range(4))
def test_a_cut_is_stable_right_below_the_critical_depth_and_not_right_above(seed: int) -> None:
    tool = random_tool(10 + seed)
    cutting, speed = random_cut(10 + seed)
    depth = float(stability_lobes(tool, cutting, speed).depth)
    below = np.linspace(0.02, 0.9995, 60) * depth
    mu = largest_multipliers(tool, cutting, np.array([speed]), np.append(below, 1.0005 * depth))[0]
    assert np.all(mu[:-1] < 1)
    assert mu[-1] > 1


@pytest.mark.parametrize("seed", range(3))
def test_multipliers_of_a_random_tool_agree_with_semi_discretisation(seed: int) -> None:
    """Two uncoupled modes, as the matrices of the second route are written on the axes."""
    rng = np.random.default_rng(50 + seed)
    natural, zeta = rng.uniform(400, 900, 2), rng.uniform(0.02, 0.05, 2)
    mass = rng.uniform(4e6, 2e7, 2) / (2 * np.pi * natural) ** 2
    k, c = mass * (2 * np.pi * natural) ** 2, 2 * zeta * mass * 2 * np.pi * natural
    cutting = Cutting("milling", teeth=3 + seed, tangential=6e8, normal=2e8, mode="up", immersion=0.6)
    tool = ToolModel.from_modes(natural, zeta, mass, np.eye(2))
    depth = np.array([0.3, 0.9, 1.4]) * float(stability_lobes(tool, cutting, 8000.0).depth)
    arc = cutting.entry_angle, cutting.exit_angle
    coarse, fine = (
        largest_multiplier(
            np.diag(mass),
            np.diag(c),
            np.diag(k),
            mean_stiffness(n, cutting.cuts_per_revolution, 6e8, 2e8, arc, 2),
            8000.0,
            cutting.cuts_per_revolution,
            depth,
        )
        for n in (80, 160)
    )
    found = largest_multipliers(tool, cutting, np.array([8000.0]), depth)[0]
    assert found == pytest.approx(extrapolated(coarse, fine), rel=3e-5)


@cache
def isotropic(mode: str, method: str) -> StabilityLobes:
    cutting = Cutting("milling", teeth=3, tangential=6e8, normal=2e8, mode=mode, immersion=0.3)
    tool = ToolModel.from_modes([640.0] * 2, [0.03] * 2, [0.5] * 2, np.eye(2))
    return stability_lobes(tool, cutting, [4000.0, 7000.0, 11000.0], method)


@pytest.mark.parametrize("method", ["collocation", "multi-frequency"])
def test_isotropic_tool_does_not_tell_up_from_down(method: str) -> None:
    assert isotropic("up", method).depth == pytest.approx(isotropic("down", method).depth, rel=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_no_multiplier_is_one(seed: int) -> None:
    """A motion that repeats with the tooth leaves the chip as it is, so nothing feeds it, at any depth."""
    tool, (cutting, speed) = random_tool(20 + seed), random_cut(20 + seed)
    depth = np.linspace(0.01, 3, 60) * float(stability_lobes(tool, cutting, speed).depth)
    mu = arc_map(tool, cutting, speed, 14).multipliers(depth)
    assert np.min(np.abs(mu - 1)) > 1e-3
    assert np.max(np.abs(mu)) > 1


@pytest.mark.parametrize("angle", [30.0, 90.0, -135.0])
@pytest.mark.parametrize("method", ["collocation", "multi-frequency", "zero-order"])
def test_turning_the_feed_is_turning_the_tool_the_other_way(angle: float, method: str) -> None:
    theta = np.radians(angle)
    natural, zeta, mass = [603.0, 760.0], [0.039, 0.025], [0.39, 0.33]
    shapes = np.array([[1.0, 0.4], [0.2, 0.9]])
    R = np.array([[np.cos(theta), np.sin(theta)], [-np.sin(theta), np.cos(theta)]])
    keys = {"process": "milling", "teeth": 3, "tangential": 6e8, "normal": 2e8, "mode": "down", "immersion": 0.4}
    straight = Cutting(**keys)  # type: ignore[arg-type]
    oblique = Cutting(**keys, feed_direction=theta)  # type: ignore[arg-type]
    turned_tool = ToolModel.from_modes(natural, zeta, mass, R @ shapes)
    tool = ToolModel.from_modes(natural, zeta, mass, shapes)
    speeds = [5000.0, 9000.0]
    one, other = stability_lobes(tool, oblique, speeds, method), stability_lobes(turned_tool, straight, speeds, method)
    assert one.depth == pytest.approx(other.depth, rel=1e-7)
    assert one.depth != pytest.approx(stability_lobes(tool, straight, speeds, method).depth, rel=1e-2)


def test_turning_by_collocation_is_the_closed_form() -> None:
    tool = ToolModel.from_modes([100.0, 240.0], [0.03, 0.02], [25.0, 9.0], [[1.0, 0.6]], ("x",))
    cutting = Cutting("turning", specific=1e9)
    speeds = [2350.0, 3000.0, 5200.0]
    closed, modes = (stability_lobes(tool, cutting, speeds, method) for method in ("turning", "collocation"))
    assert modes.depth == pytest.approx(closed.depth, rel=1e-9)
    assert modes.chatter_frequency == pytest.approx(closed.chatter_frequency, rel=1e-7)
    assert modes.lobe.tolist() == closed.lobe.tolist()


def test_boring_is_turning_along_another_direction() -> None:
    f = np.arange(1.0, 1000.0, 1.0)
    model = ToolModel.from_modes([100.0, 240.0], [0.03, 0.02], [25.0, 9.0], np.eye(2))
    frf = FRF(f, model(f), ("bar.x", "bar.y"), ("bar.x", "bar.y"))
    bored = stability_lobes(frf, Cutting("boring", specific=1e9, feed_direction=np.pi / 2), [3000.0])
    alone = ToolModel.from_modes([240.0], [0.02], [9.0], [[1.0]], ("x",))
    assert bored.minimum_depth == pytest.approx(2 * 9.0 * (2 * np.pi * 240) ** 2 * 0.02 * 1.02 / 1e9, rel=1e-4)
    turned = stability_lobes(alone, Cutting("turning", specific=1e9), [3000.0])
    assert bored.depth == pytest.approx(turned.depth, rel=1e-4)


def spectral_radii(tool: ToolModel, cutting: Cutting, count: int) -> Array:
    return np.asarray(np.max(np.abs(arc_map(tool, cutting, 5000.0, count, 0.0).multipliers(DEPTHS)), axis=1))


def test_too_few_nodes_look_stable_and_are_never_believed() -> None:
    """Sixteen nodes for a slot at 5000 rpm: |μ| = .224, .320, .542 where .820, 1.074, 1.406 is true."""
    tool, cutting = common_tool(1), common_cut("slot")
    assert np.all(spectral_radii(tool, cutting, 16) < 0.6)
    found = largest_multipliers(tool, cutting, np.array([5000.0]), DEPTHS)[0]
    assert (found > 1).tolist() == [False, True, True]
