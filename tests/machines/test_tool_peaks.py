"""Peaks of the tool against modes that are known, and what a half-power width may be called damping for."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from machines import read_machine, response
from machines.forced_response.tool_peaks import tool_peaks
from machines.report.figures.receptance_figure import PLOTS
from machines.report.figures.response_figures import tool_figure
from machines.report.tool_peak_table import tool_peak_rows

LIBRARY = Path(__file__).parents[2] / "machines" / "library"


def test_a_mode_of_the_tool_has_its_frequency_damping_and_compliance() -> None:
    machine = read_machine(LIBRARY / "two_mode_tool.toml")
    cutter = machine.components[0]
    for i, dof in enumerate(machine.tool.values()):
        (peak,) = tool_peaks(response(machine, 10.0, [50.0, 2000.0], dof))
        f, zeta, mass = (float(getattr(cutter, name)[i]) for name in ("frequency", "damping_ratio", "modal_mass"))
        assert peak.frequency == pytest.approx(f * np.sqrt(1 - 2 * zeta**2), rel=5e-5)
        assert peak.damping_ratio == pytest.approx(zeta, rel=1e-3)
        size = 1 / (mass * (2 * np.pi * f) ** 2 * 2 * zeta * np.sqrt(1 - zeta**2))
        # Lines 3 Hz apart: 1/|H|² is a quartic, and the parabola leaves its third and fourth powers out.
        assert peak.compliance == pytest.approx(size, rel=1e-4)
        assert (peak.drive, peak.output, peak.connection) == (dof, dof, "")


def test_a_leaning_resonance_has_a_top_and_no_damping() -> None:
    """At 125 N the second resonance folds over: its top is where motion jumps, the half-power width tells nothing."""
    machine = read_machine(LIBRARY / "two_mass.toml")
    result = response(machine, [10.0, 125.0], [4800.0, 5200.0])
    linear, leaning = tool_peaks(result)
    assert linear.damping_ratio == pytest.approx(0.0114, rel=0.01)
    assert np.isnan(leaning.damping_ratio)
    on_branches = [
        float(np.max(np.abs(b.output[:, 0]))) / 125.0 for b in result.branches[1] if b.stability.value != "unstable"
    ]
    assert leaning.compliance == pytest.approx(max(on_branches), rel=1e-3)
    assert {linear.connection, leaning.connection} == {"guide"}
    assert leaning.error > linear.error


def test_overlapping_modes_have_no_half_power_width(tmp_path: Path) -> None:
    text = (LIBRARY / "two_mode_tool.toml").read_text()
    close = text.replace("603", "622").replace("shapes = [", "shapes = [[1.0, 1.0], [0.0, 1.0]] #")
    path = tmp_path / "close.toml"
    path.write_text(close)
    peaks = tool_peaks(response(read_machine(path), 10.0, [50.0, 2000.0], "cutter.x"))
    assert len(peaks) == 2
    assert all(np.isnan(peak.damping_ratio) for peak in peaks)


def test_close_modes_of_a_tool_without_joints_are_told_one_by_one(tmp_path: Path) -> None:
    """1.4 Hz apart under lines of 5 Hz: a peak each, as high as the sum of the modes is there."""
    path = tmp_path / "close.toml"
    path.write_text(
        'schema = "jointlib/machine/1"\n[[component]]\nname = "cutter"\nkind = "modal"\ndofs = ["x"]\n'
        "frequency = [104.9, 106.3, 846.6]\ndamping_ratio = [0.002, 0.003, 0.003]\nmodal_mass = [20.0, 25.0, 1.0]\n"
        'shapes = [[1.0, 1.0, 1.0]]\n[tool]\nx = "cutter.x"\n'
    )
    f, zeta = np.array([104.9, 106.3, 846.6]), np.array([0.002, 0.003, 0.003])
    stiffness = np.array([20.0, 25.0, 1.0]) * (2 * np.pi * f) ** 2
    peaks = tool_peaks(response(read_machine(path), 10.0, [20.0, 3000.0]))
    assert [round(peak.frequency) for peak in peaks] == [105, 106, 847]
    for peak in peaks:
        fine = peak.frequency * (1 + np.linspace(-2e-3, 2e-3, 4001))
        r = fine[:, None] / f
        top = np.max(np.abs(np.sum(1 / stiffness / (1 - r**2 + 2j * zeta * r), axis=1)))
        assert peak.compliance == pytest.approx(top, rel=5e-3)


def test_a_mass_without_a_mode_has_its_response(tmp_path: Path) -> None:
    path = tmp_path / "mass.toml"
    path.write_text(
        'schema = "jointlib/machine/1"\n[[component]]\nname = "cutter"\nkind = "lumped"\ndofs = ["x"]\n'
        'mass = [[2.0]]\n[tool]\nx = "cutter.x"\n'
    )
    (frf,) = response(read_machine(path), 10.0, [100.0, 900.0]).frfs
    inertia = -1 / (2.0 * (2 * np.pi * frf.frequency) ** 2)
    np.testing.assert_allclose(frf.receptance[:, 0, 0], inertia, rtol=1e-9)


def test_small_peaks_are_counted_and_not_listed() -> None:
    machine = read_machine(LIBRARY / "two_mass.toml")
    peaks = tool_peaks(response(machine, [10.0]))
    rows, left = tool_peak_rows(peaks, {"slide.x": "x"})
    assert ([row[0] for row in rows], left) == (["x", "x"], 0)
    tiny = [*peaks, type(peaks[0])(**(vars(peaks[0]) | {"compliance": 1e-3 * peaks[0].compliance}))]
    assert tool_peak_rows(tiny, {}) == (tool_peak_rows(peaks, {})[0], 1)


@pytest.mark.thorough
@pytest.mark.parametrize("plot", PLOTS)
def test_a_receptance_is_drawn_as_asked(plot: str) -> None:
    result = response(read_machine(LIBRARY / "two_mass.toml"), [10.0, 125.0], [4800.0, 5200.0])
    figure = tool_figure([result], plot, png=True)
    assert figure.svg.startswith("<svg")
    assert figure.png.startswith(b"\x89PNG")
    assert "broken lines" in figure.caption
    assert tool_figure([result], plot).svg == figure.svg
