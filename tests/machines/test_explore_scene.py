"""What follows from a setting: the curves of the very machine that is saved, whoever asks and however often."""

from __future__ import annotations

import json
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lathe_file import lathe_file
from tools import package

from jointlib import Joint
from jointlib.errors import InputError
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import frozen_receptance, lobes_at_amplitude, read_machine
from machines.explore import Curves, Explorer
from machines.explore.figures import response_figure
from machines.model.joint_places import bundles
from machines.modes.mode_energy import mode_energies
from machines.modes.natural_modes import natural_modes
from machines.road.open_joints import with_joints

LIBRARY = Path(__file__).parents[2] / "machines" / "library"
PRELOAD, DAMPING = "connection.guide.joint.hertz_guide.preload", "connection.guide.joint.viscous.damping"
SETTINGS: list[dict[str, float]] = [
    {PRELOAD: 900.0, "cutting.immersion": 40.0},
    {PRELOAD: 400.0, "cutting.teeth": 3, "cutting.tangential": 1500.0, "amplitude": 4.0},
]


@pytest.fixture(scope="module")
def mill() -> Explorer:
    machine, _ = with_joints(read_machine(LIBRARY / "guide_mill.toml"))
    return Explorer(LIBRARY / "guide_mill.toml", joints={c.name: c.joint for c in machine.flexible if c.joint})


@pytest.fixture
def lathe(tmp_path: Path) -> Explorer:
    return Explorer(lathe_file(tmp_path))


def command(*words: str) -> Any:
    call = [sys.executable, "-c", "from jointlib.cli.main import main; main()", *words, "--json"]
    return json.loads(subprocess.run(call, capture_output=True, text=True, check=True).stdout)


def curves_equal(one: Curves, other: Curves) -> bool:
    same = all(np.array_equal(getattr(one, key), getattr(other, key)) for key in ("frequency", "depth", "amplitude"))
    return same and all(np.array_equal(one.receptance[axis], other.receptance[axis]) for axis in one.receptance)


def reads_as_said(explorer: Explorer, values: dict[str, float], folder: Path, speed: str, *words: str) -> None:
    saved, *_ = explorer.save(values, folder, "tried")
    said = command("lobes", str(saved), "--speed", speed, *words)
    read = explorer.at(values, float(speed))
    for key in ("depth", "chatter_frequency", "kind", "lobe"):
        assert np.ravel(said[key])[0] == getattr(read, key), key
    assert said["method"] == read.method
    assert np.isfinite(read.depth)


@pytest.mark.thorough
@pytest.mark.parametrize("values", SETTINGS)
def test_what_is_read_off_is_what_the_command_says_of_the_saved_machine(
    mill: Explorer, tmp_path: Path, values: dict[str, float]
) -> None:
    reads_as_said(mill, values, tmp_path, "6000", "--amplitude", f"{values.get('amplitude', 0.0)}um")


@pytest.mark.thorough
def test_what_is_read_off_a_linear_tool_is_what_the_command_says(tmp_path: Path) -> None:
    tool = Explorer(LIBRARY / "two_mode_tool.toml")
    reads_as_said(tool, {"cutting.immersion": 30.0, "cutting.teeth": 2}, tmp_path, "9000.5")


def test_curves_at_rest_are_those_of_the_saved_machine(mill: Explorer, tmp_path: Path) -> None:
    values = {PRELOAD: 300.0, DAMPING: 1500.0}
    saved, *_ = mill.save(values, tmp_path, "soft")
    curves = mill.curves(values)
    coupled = frozen_receptance(read_machine(saved), curves.frequency, 0.0).receptance
    largest = np.max(np.abs(coupled))
    for i, axis in enumerate(("x", "y")):
        assert np.allclose(curves.receptance[axis], coupled[:, i, i], rtol=0, atol=1e-9 * largest)
        assert np.array_equal(curves.receptance[axis], curves.receptance_at_rest[axis])


@pytest.mark.parametrize(("amplitude", "off"), [(0.0, 1e-9), (1.0, 2e-3), (10.0, 2e-3), (80.0, 4e-3)])
def test_the_preview_is_the_zero_order_chart_of_the_machine(mill: Explorer, amplitude: float, off: float) -> None:
    values = {"amplitude": amplitude, "cutting.immersion": 70.0}
    curves, moment = mill.curves(values), mill.moment(values)
    full = lobes_at_amplitude(moment.machine, curves.speed, moment.amplitude, "zero-order")
    assert curves.method == "zero-order"
    assert "preview" in curves.notes[0]
    assert np.max(np.abs(curves.depth / full.depth - 1)) < off


def test_the_preview_is_checked_where_one_would_cut_after_it(mill: Explorer) -> None:
    values = {"cutting.immersion": 20.0}
    best, curves = mill.summary(values).pocket, mill.curves(values)
    assert best is not None
    k = int(np.searchsorted(curves.speed, best.speed))
    exact = mill.at(values, best.speed)
    assert abs(curves.depth[k] / exact.depth - 1) > 0.1  # zero order is far off there
    shown, known = (f"{depth * 1e3:.3g} mm" for depth in (curves.depth[k], exact.depth))
    assert curves.notes[1] == f"At {best.speed:.0f} rpm the preview has {shown}, {exact.method} {known}."


def test_the_describing_function_is_the_first_harmonic_of_the_force_over_a_cycle(mill: Explorer) -> None:
    values = {PRELOAD: 800.0}
    curves = mill.curves(values)
    joint = mill.moment(values).machine.flexible[0].joint
    assert joint is not None
    theta = 2 * np.pi * np.arange(4096) / 4096
    omega = 2 * np.pi * curves.gain_frequency
    for k in (0, 60, 119):
        A = curves.amplitude[k]
        force = joint.force_along(A * np.cos(theta), -A * omega * np.sin(theta))
        assert curves.gains["guide"][k] == pytest.approx(2 * np.mean(force * np.exp(-1j * theta)) / A, rel=1e-9)


def test_the_guide_moves_as_far_as_the_machine_with_that_spring_and_damper_lets_it(mill: Explorer) -> None:
    values = {"amplitude": 6.0}
    curves = mill.curves(values)
    z, omega = curves.present["guide"], 2 * np.pi * curves.gain_frequency
    G = np.interp(z, curves.amplitude, curves.gains["guide"])
    frozen = mill.moment(values).machine.with_joint("guide", Joint((Linear(G.real), Viscous(G.imag / omega))))
    dofs = ("head.ux", "column.x", "cutter.tip")
    head, column, tip = frozen_receptance(frozen, curves.gain_frequency, 0.0, outputs=dofs).receptance[0, :, 0]
    assert z == pytest.approx(6e-6 * abs((head - column) / tip), rel=1e-4)
    assert z < curves.limit["guide"]


def test_a_setting_is_compared_by_what_it_yields_and_removes(mill: Explorer) -> None:
    soft, stiff = (mill.summary({PRELOAD: preload}) for preload in (200.0, 1800.0))
    assert soft.static_compliance > stiff.static_compliance
    machine = mill.moment({PRELOAD: 200.0}).machine
    slow = frozen_receptance(machine, 0.1, 0.0).receptance[0]
    assert soft.static_compliance == pytest.approx(np.max(np.abs(np.diag(slow))), rel=1e-5)
    assert soft.minimum_depth == np.min(mill.curves({PRELOAD: 200.0}).depth)
    assert stiff.pocket is not None
    assert stiff.pocket.removal_rate is not None


def test_turning_is_drawn_as_it_is_read_off(lathe: Explorer) -> None:
    for values in ({}, {"amplitude": 5.0, "cutting.specific": 1500.0}):
        curves = lathe.curves(values)
        for k in (10, 120, 199):
            assert curves.depth[k] == pytest.approx(lathe.at(values, float(curves.speed[k])).depth, rel=1e-3)
        assert curves.method == "turning"
    exact = lathe.curves({}, exact=True)
    assert exact.depth[10] == lathe.at({}, float(exact.speed[10])).depth


def test_rounding_is_no_change_since_a(lathe: Explorer) -> None:
    package("dash")
    from machines.explore.compare import Setting, differences

    curves = lathe.curves({})
    now = str(differences([], Setting({}, curves, 1e-8), Setting({}, curves, 1e-8 * (1 + 1e-14))))
    assert now.count("'same'") == now.count("Tr(") - 1 == 5


def test_a_machine_that_does_not_cut_still_answers_forces(tmp_path: Path) -> None:
    explorer = Explorer(LIBRARY / "two_mass.toml")
    curves = explorer.curves({"amplitude": 2.0})
    assert curves.depth.size == 0
    assert any("no lobes" in note for note in curves.notes)
    assert list(curves.gains) == ["guide"]
    assert not np.array_equal(curves.receptance["x"], curves.receptance_at_rest["x"])
    assert explorer.summary({}).minimum_depth is None
    with pytest.raises(InputError, match=r"no \[cutting\]"):
        explorer.at({}, 3000.0)


@pytest.mark.thorough
def test_users_at_once_get_what_each_would_get_alone(lathe: Explorer) -> None:
    key = "connection.guide.joint.linear.stiffness"
    settings = [{key: 300.0 + 10.0 * k, "amplitude": float(k % 3)} for k in range(12)]
    with ThreadPoolExecutor(6) as users:
        together = list(users.map(lathe.curves, settings))
    alone = Explorer(lathe.machine)
    assert all(curves_equal(a, alone.curves(values)) for a, values in zip(together, settings, strict=True))
    assert len({float(np.min(c.depth)) for c in together}) == 12


def test_the_order_of_the_values_and_what_is_as_in_the_file_change_nothing(lathe: Explorer) -> None:
    key = "connection.guide.joint.linear.stiffness"
    once = lathe.curves({key: 400.0, "amplitude": 3.0})
    assert lathe.curves({"amplitude": "3", "cutting.feed": 0.2, key: 400}) is once
    assert lathe.changes({control.key: control.value for control in lathe.controls}) == {}


def test_old_results_are_let_go(lathe: Explorer) -> None:
    first = lathe.curves({"cutting.specific": 500.0})
    for k in range(70):
        lathe.curves({"cutting.specific": 600.0 + k})
    assert lathe.curves({"cutting.specific": 500.0}) is not first


def test_unknown_controls_and_speeds_outside_the_chart_are_refused_in_words(lathe: Explorer) -> None:
    with pytest.raises(InputError, match=r"no control 'cutting\.specifik', .*'cutting\.specific'"):
        lathe.curves({"cutting.specifik": 1.0})
    for speed in (0, 1999.0, 1e9, float("nan"), "6000", None, True):
        with pytest.raises(InputError, match="expected 2000 to 9000 rpm"):
            lathe.at({}, speed)


def test_a_file_that_says_nothing_of_a_tool_is_refused(tmp_path: Path) -> None:
    text = (LIBRARY / "two_mode_tool.toml").read_text()
    start = text.index("[tool]")
    end = text.find("\n[", start)
    (tmp_path / "m.toml").write_text(text[:start] + text[end if end > 0 else len(text) :])
    with pytest.raises(InputError, match=r"no \[tool\]"):
        Explorer(tmp_path / "m.toml")


def test_the_describing_function_shown_first_is_of_the_joint_that_holds_the_leading_mode() -> None:
    lathe = Explorer(LIBRARY / "lathe.toml")
    curves = lathe.curves({})
    modes = natural_modes(lathe.base)
    leading = int(np.argmax(modes.tool_peak))
    strain = mode_energies(modes).strain[:, leading]
    groups = bundles(lathe.base.flexible)
    shares = {name: float(np.sum(strain[rows])) for name, rows in groups.items()}
    drawn = {name.partition(".")[0]: name for name in curves.gains}
    assert len(drawn) > 1
    best = max(drawn, key=lambda name: shares.get(name, 0.0))
    assert lathe.leading(curves) == drawn[best]
    turned = dict(reversed(list(curves.gains.items())))
    assert lathe.leading(replace(curves, gains=turned)) == drawn[best] != next(iter(turned))
    axis = response_figure(curves, None)["layout"]["xaxis"]
    wide = curves.frequency[-1] > 30 * curves.frequency[0]
    assert (axis.get("type") == "log") == wide
