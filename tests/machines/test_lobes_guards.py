"""What the lobe solvers refuse, and what they tell of data that end too early."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import CheckFailed, InputError
from jointlib.frf import FRF
from machines import lobes_at_amplitude, read_machine
from machines.cutting.amplitude.frozen_modes import multipliers
from machines.cutting.amplitude.unstable_depths import unstable_depths
from machines.cutting.loops.multipliers import largest_multipliers
from machines.deadline import OutOfTime, within
from machines.lobes import Cutting, stability_lobes
from machines.tool.tool_model import ToolModel

LIBRARY = Path(__file__).parents[2] / "machines" / "library"
TOOL = ToolModel.from_modes([922.0], [0.011], [0.03993], [[1.0]], ("x",))
HALF = Cutting("milling", teeth=2, tangential=6e8, normal=2e8, mode="down", immersion=0.5)
SLOT = Cutting("milling", teeth=2, tangential=6e8, normal=2e8, mode="slot")
LATHE = Cutting("turning", specific=1e9)


def record(low: float, high: float, quantity: int = 0, step: float = 0.5) -> FRF:
    """The tool on lines in Hz, differentiated so many times."""
    f = np.arange(low, high + step / 2, step)
    return FRF(f, (2j * np.pi * f[:, None, None]) ** quantity * TOOL(f), ("cutter.x",), ("cutter.x",))


@pytest.mark.parametrize(("end", "lost"), [(1500.0, 2.9), (3000.0, 0.13), (5000.0, 0.013)])
def test_the_error_of_a_band_that_ends_early_is_told_and_holds(end: float, lost: float) -> None:
    """Zero beyond the band costs 2.9, 0.13 and 0.013 % of the depth at 18 000 rpm; carried on as a mass, far less."""
    exact = float(stability_lobes(TOOL, HALF, 18000.0, "collocation").depth)
    found = stability_lobes(record(1.0, end), HALF, 18000.0)
    told = [w for w in found.warnings if "known from" in w]
    assert abs(float(found.depth) / exact - 1) < 0.5e-2 * lost
    assert abs(float(found.depth) / exact - 1) < max(1e-2 * lost, 1e-4)
    if lost > 0.02:
        share = float(told[0].split("up to ")[1].split(" %")[0])
        assert share == pytest.approx(lost, rel=0.1)


def test_a_band_that_starts_late_is_told_and_holds() -> None:
    exact = stability_lobes(TOOL, HALF, [9000.0, 18000.0], "collocation").depth
    found = stability_lobes(record(300.0, 6000.0), HALF, [9000.0, 18000.0])
    share = float(next(w for w in found.warnings if "known from" in w).split("up to ")[1].split(" %")[0])
    assert np.max(np.abs(found.depth / exact - 1)) < 1e-2 * share


@pytest.mark.parametrize(
    ("band", "said"),
    [
        ((1.0, 925.0), "ends at 925 Hz on a resonance"),
        ((920.0, 3000.0), "starts at 920 Hz on a resonance"),
        ((1.0, 600.0), "the receptance is that of a spring, so a mode above it may chatter first"),
    ],
)
def test_a_band_without_the_mode_is_refused(band: tuple[float, float], said: str) -> None:
    with pytest.raises(InputError, match=said):
        stability_lobes(record(*band), SLOT, [5000.0, 9000.0])


def test_lines_far_apart_are_told() -> None:
    warnings = stability_lobes(record(23.0, 3000.0, step=23.0), HALF, 9000.0).warnings
    assert any("half-power bandwidth" in sentence for sentence in warnings)


@pytest.mark.parametrize("cutting", [HALF, LATHE])
@pytest.mark.parametrize(
    ("frf", "said"),
    [
        (record(1.0, 4000.0, 2), "as an accelerance does; expected a receptance"),
        (record(1.0, 4000.0, 1), "look like a mobility"),
    ],
)
def test_data_of_another_quantity_are_named(frf: FRF, said: str, cutting: Cutting) -> None:
    with pytest.raises(InputError, match=said):
        stability_lobes(frf, cutting, 9000.0)


@pytest.mark.parametrize("cutting", [HALF, LATHE])
@pytest.mark.parametrize(
    ("changed", "said"),
    [
        (lambda G: G.conj(), r"e\^\(-jωt\); expected their complex conjugate"),
        (lambda G: -G, "sign reversed"),
        (lambda G: -G.conj(), "negative static stiffness"),
    ],
)
def test_data_of_a_wrong_sign_are_named(changed: Any, said: str, cutting: Cutting) -> None:
    frf = record(1.0, 4000.0)
    with pytest.raises(InputError, match=said):
        stability_lobes(FRF(frf.frequency, changed(frf.receptance), frf.outputs, frf.inputs), cutting, 9000.0)


def test_a_free_mass_has_no_negative_stiffness() -> None:
    f = np.arange(5.0, 500.0, 0.5)

    def held_by_nothing(f: Array) -> ComplexArray:
        w = 2 * np.pi * f
        one = 1 / (9.0 * ((2 * np.pi * 140) ** 2 - w**2 + 2j * 0.03 * w * 2 * np.pi * 140))
        return np.asarray((one - 1 / (40.0 * w**2))[:, None, None])

    assert np.isfinite(stability_lobes(held_by_nothing, LATHE, 3000.0, frequency=f).depth)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"tangential": 600.0}, r'if it is meant in N/mm², write 6e\+08 or "600.0 N/mm\^2"'),
        ({"immersion": 1.2}, "expected a/D of at most 1"),
        ({"teeth": 0}, "expected a whole number from 1"),
        ({"speed": (9000.0, 4000.0)}, "expected 0 < low < high"),
        ({"feed_direction": float("nan")}, "feed_direction is nan"),
        ({"feed_direction": 25}, 'feed_direction is 25 rad, .* in degrees it is "25 deg"'),
    ],
)
def test_a_cut_that_cannot_be_meant_gets_one_sentence(change: dict[str, Any], said: str) -> None:
    fields = {"process": "milling", "teeth": 2, "tangential": 6e8, "normal": 2e8, "mode": "down", "immersion": 0.5}
    with pytest.raises(InputError, match=said):
        Cutting(**{**fields, **change})
    with pytest.raises(InputError, match="far below any material"):
        Cutting("turning", specific=2000.0)


@pytest.mark.parametrize("key", ["lead_angle", "nose_radius"])
def test_what_is_not_covered_is_told_in_the_file(key: str, tmp_path: Path) -> None:
    path = tmp_path / "tool.toml"
    path.write_text((LIBRARY / "two_mode_tool.toml").read_text() + f'{key} = "30 deg"\n')
    with pytest.raises(InputError, match=f"{key} is not covered"):
        read_machine(path)


def test_the_feed_direction_stands_in_the_file(tmp_path: Path) -> None:
    path = tmp_path / "tool.toml"
    text = (LIBRARY / "two_mode_tool.toml").read_text()
    path.write_text(text + 'feed_direction = "90 deg"\n')
    machine = read_machine(path)
    assert (machine.cutting or {})["feed_direction"] == pytest.approx(np.pi / 2)
    across = lobes_at_amplitude(machine, [9000.0])
    swapped = text.replace("[603, 666]", "[666, 603]").replace("[0.039, 0.035]", "[0.035, 0.039]")
    mass = "0.38941927768610524, 0.3263683528776301"
    path.write_text(swapped.replace(mass, ", ".join(reversed(mass.split(", ")))))
    assert across.depth == pytest.approx(lobes_at_amplitude(read_machine(path), [9000.0]).depth, rel=1e-9)


def test_collocation_asks_for_modes() -> None:
    with pytest.raises(InputError, match="needs a tool with modes"):
        stability_lobes(record(1.0, 4000.0), HALF, 9000.0, "collocation")
    with pytest.raises(InputError, match="damping ratio of"):
        ToolModel.from_modes([922.0], [0.0], [0.04], [[1.0]], ("x",))
    with pytest.raises(InputError, match="zero-order: the process is turning"):
        stability_lobes(TOOL, LATHE, 9000.0, "zero-order")


def test_a_guard_that_fails_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """With nodes that are never enough the answer is no number at all."""
    from machines.cutting.loops import collocation
    from machines.cutting.loops import multipliers as charts
    from machines.cutting.rest import periodic

    whole = collocation.arc_map

    def poor(model: ToolModel, cutting: Cutting, speed: float | Array, more: int = 0, share: float = 1.0) -> object:
        return whole(model, cutting, speed, 6 + more // 4, 0.0)

    monkeypatch.setattr(charts, "arc_map", poor)
    monkeypatch.setattr(periodic, "arc_map", poor)
    for depth in (np.array([1e-3]), np.linspace(1e-5, 1e-3, 100)):
        with pytest.raises(CheckFailed, match="multipliers still change with the number of nodes"):
            largest_multipliers(TOOL, SLOT, np.array([5000.0]), depth)
    with pytest.raises(CheckFailed, match="depth still changes with the number of nodes"):
        stability_lobes(TOOL, SLOT, 5000.0, "collocation")


def test_too_few_harmonics_are_not_believed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Five harmonics miss the mode of the slot at 5000 rpm and give 2.58 mm for .409."""
    from machines.cutting.loops import harmonic_crossing

    monkeypatch.setattr(harmonic_crossing, "PAST", -4)
    found = stability_lobes(TOOL, SLOT, 5000.0, "multi-frequency")
    assert float(found.depth) * 1e3 == pytest.approx(0.4086278, rel=1e-6)


def test_a_spindle_too_slow_for_harmonics_is_told() -> None:
    with pytest.raises(CheckFailed, match="harmonics of a tooth frequency of 1 Hz would be needed, expected at most"):
        stability_lobes(TOOL, SLOT, 30.0, "multi-frequency")


@pytest.mark.parametrize(
    ("speed", "depth", "said"), [([0.0], [1e-3], "spindle speeds must"), ([9e3], [-1e-3], "depths must")]
)
def test_points_of_a_chart_must_be_positive(speed: list[float], depth: list[float], said: str) -> None:
    with pytest.raises(InputError, match=said):
        multipliers(read_machine(LIBRARY / "two_mode_tool.toml"), speed, depth)


def test_a_chart_at_rest_and_the_points_below_it_agree() -> None:
    machine = read_machine(LIBRARY / "two_mode_tool.toml")
    chart = lobes_at_amplitude(machine, [6000.0, 9000.0])
    assert chart.method == "collocation"
    for i, speed in enumerate(chart.speed):
        mu = multipliers(machine, speed, chart.depth[i] * np.array([0.999, 1.001]))
        assert (mu[0] > 1).tolist() == [False, True]


def test_stable_cuts_above_the_limits_are_looked_for_in_time() -> None:
    machine = read_machine(LIBRARY / "two_mode_tool.toml")
    chart = lobes_at_amplitude(machine, [6000.0])
    assert len(unstable_depths(machine, chart)[0].intervals)
    with within(-1.0), pytest.raises(OutOfTime):
        unstable_depths(machine, chart)


@pytest.mark.slow
def test_a_slow_spindle_gets_its_depth_by_default() -> None:
    """579 rad of the mode between two teeth: nearly a hundred harmonics, or collocation in pieces."""
    tool = ToolModel.from_modes([922.0, 922.0], [0.011, 0.011], [0.03993, 0.03993], np.eye(2))
    cut = Cutting("milling", teeth=2, tangential=6e8, normal=2e8, mode="down", immersion=0.1)
    chart = stability_lobes(tool, cut, [300.0])
    both = [stability_lobes(tool, cut, [300.0], method).depth[0] for method in ("multi-frequency", "collocation")]
    assert both[0] == pytest.approx(both[1], rel=1e-4)
    mu = largest_multipliers(tool, cut, np.array([300.0]), chart.depth * np.array([0.999, 1.001]))
    assert mu[0, 0] < 1 < mu[0, 1]
