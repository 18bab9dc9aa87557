"""Machines side by side: peaks as the forced response has them, none lost to a line, depths as the lobes have them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from machines import Machine, lobes_over_range, natural_modes, read_machine, response
from machines.compare.computed_peaks import Top, matched, tops_of
from machines.compare.machine_side import of_machine, receptances
from machines.compare.measured_peaks import Resonance
from machines.compare.side_by_side import as_told, differences
from machines.cutting.rest.chart_file import default_speeds
from machines.forced_response.tool_peaks import tool_peaks

LIBRARY = Path("machines/library")
MODE = """
[[component]]
name = "{name}"
kind = "modal"
dofs = ["x"]
frequency = [{frequency}]
damping_ratio = [{damping}]
modal_mass = [{mass}]
shapes = [[{shapes}]]
"""


def narrow_modes(here: Path, frequency: str) -> Machine:
    """Modes far narrower than lines over four kilohertz are apart, two of them close together."""
    head = '\nschema = "jointlib/machine/1"\nname = "m"\n'
    mode = MODE.format(
        name="cutter",
        frequency=frequency,
        damping="0.002, 0.003, 0.002",
        mass="20.0, 30.0, 2.0",
        shapes="1.0, 1.0, 1.0",
    )
    path = here / "narrow.toml"
    path.write_text(
        head + mode + '[tool]\nx = "cutter.x"\n[response]\nfrequency = ["15 Hz", "4 kHz"]\nforce = ["1 N"]\n'
    )
    return read_machine(path)


def test_narrow_peaks_are_those_of_the_modes(tmp_path: Path) -> None:
    machine = narrow_modes(tmp_path, "104.9, 106.3, 846.6")
    tops = receptances(machine)["tool x"].tops
    assert tops is not None
    assert [top.resonance.frequency for top in tops] == pytest.approx(natural_modes(machine).frequency, rel=1e-3)


@pytest.mark.parametrize("name", ["three_joints", "two_mode_tool"])
def test_peaks_are_those_of_the_forced_response_to_a_small_force(name: str) -> None:
    machine = read_machine(LIBRARY / f"{name}.toml")
    tops = receptances(machine)["tool x"].tops
    assert tops is not None
    told = tool_peaks(response(machine, 1e-3, drive=machine.tool["x"]))
    for key in ("frequency", "compliance"):
        ours = [getattr(top.resonance, key) for top in tops]
        assert ours == pytest.approx([getattr(peak, key) for peak in told], rel=1e-3)


def test_a_peak_moved_between_lines_is_moved_by_what_its_mode_is(tmp_path: Path) -> None:
    a, b = (of_machine(name, narrow_modes(tmp_path, f"{f}, 300.0, 846.6")) for name, f in (("a", 104.9), ("b", 105.6)))
    found = [d for d in differences(a, b) if not d.what.endswith("damping")]
    frequencies = [(d.first, d.other) for d in found if d.what.endswith("frequency")]
    assert frequencies == [pytest.approx((104.9, 105.6), rel=1e-4)]
    assert not any(np.isnan(d.first) or np.isnan(d.other) for d in found)


def top(frequency: float, compliance: float = 1.0, stands_out: bool = True) -> Top:
    return Top(Resonance(frequency, np.nan, compliance), stands_out)


def test_a_shoulder_is_what_a_peak_has_become() -> None:
    first = [top(113.0, 0.15, False), top(128.6, 0.13, False), top(258.6, 0.21)]
    other = [top(122.8, 0.15), top(129.5, 0.10, False), top(271.2, 0.18)]
    pairs = [tuple(None if r is None else r.frequency for r in pair) for pair in matched(first, other)]
    assert pairs == [(113.0, 122.8), (258.6, 271.2)]


def test_a_ripple_beside_a_peak_is_not_the_peak() -> None:
    pairs = matched([top(100.0)], [top(101.0, 0.01, False), top(110.0)])
    assert [(a and a.frequency, b and b.frequency) for a, b in pairs] == [(100.0, 110.0)]
    assert {pair.count(None) for pair in matched([top(100.0)], [top(200.0)])} == {1}


def test_the_top_of_one_mode_is_where_mechanics_put_it() -> None:
    zeta, natural = 0.01, 100.0

    def size(f: np.ndarray) -> np.ndarray:
        r = f / natural
        return 1 / np.abs(1 - r**2 + 2j * zeta * r)

    (found,) = tops_of(size, np.linspace(20.0, 300.0, 400))
    assert found.resonance.frequency == pytest.approx(natural * np.sqrt(1 - 2 * zeta**2), rel=1e-6)
    assert found.resonance.compliance == pytest.approx(1 / (2 * zeta * np.sqrt(1 - zeta**2)), rel=1e-6)


@pytest.mark.slow
def test_depths_are_those_of_the_lobes_over_the_range() -> None:
    machine = read_machine(LIBRARY / "two_mode_tool.toml")
    side = of_machine("a", machine)
    assert (side.remarks, side.limits is not None) == ((), True)
    lowest = lobes_over_range(machine, default_speeds(machine)).minimum_depth
    assert side.facts["lowest stable depth"].value == pytest.approx(lowest, rel=1e-3)


@pytest.mark.thorough
def test_time_that_was_up_is_said_beside_the_depth(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("machines.compare.machine_side._LEAST", 0.0)
    monkeypatch.setattr("machines.compare.machine_side._SHARE", 0.2)
    machine = read_machine(LIBRARY / "two_mode_tool.toml")
    heavier = read_machine(LIBRARY / "two_mode_tool.toml", {"component.cutter.modal_mass[0]": 0.6})
    a, b = of_machine("a", machine), of_machine("b", heavier)
    assert "time was up" in a.remarks[0]
    row = next(d for d in differences(a, b) if d.what.startswith("lowest"))
    assert row.what == "lowest stable depth, as far as it was looked for"
    assert len(as_told(row)[1].replace(".", "").lstrip("0")) <= 4
