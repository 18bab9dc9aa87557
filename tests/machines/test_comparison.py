"""Measured over predicted: one mode with noise, a record of the machine itself, and friction that the machine lacks."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from jointlib.frf import FRF
from machines import Cutting, read_machine, stability_lobes
from machines.compare.comparison import compared, depths, paired, share
from machines.compare.measured_peaks import Resonance, at_the_peaks, resonances
from machines.compare.whole_curves import frac, unit_smell
from machines.loop.noise.deviation import from_neighbours
from machines.loop.records import LevelFRF
from machines.report.comparison_section import comparison_rows, comparison_section
from machines.tool.at_rest import tip_at_rest

LIBRARY = Path(__file__).parents[2] / "machines" / "library"
F, ZETA, K = 400.0, 0.02, 2e7


def mode(frequency: np.ndarray) -> np.ndarray:
    r = frequency / F
    return 1 / (K * (1 - r**2 + 2j * ZETA * r))


def test_frac_is_one_but_for_a_factor_and_zero_for_what_is_orthogonal() -> None:
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(2, 50)) + 1j * rng.normal(size=(2, 50))
    assert frac(a, (2 - 3j) * a) == pytest.approx(1.0, rel=1e-12)
    assert frac(a, b - np.vdot(a, b) / np.vdot(a, a) * a) == pytest.approx(0.0, abs=1e-12)
    assert frac(a, b) == pytest.approx(frac(b, a), rel=1e-12)


def test_the_standard_errors_of_a_resonance_are_those_of_repeated_records() -> None:
    lines, rng = np.arange(300.0, 500.0, 1.0), np.random.default_rng(2)
    deviation = np.full(len(lines), 0.005 / (2 * K * ZETA))
    (true,) = resonances(lines, mode(lines))
    assert true.frequency == pytest.approx(F * np.sqrt(1 - 2 * ZETA**2), rel=1e-4)
    assert true.damping_ratio == pytest.approx(ZETA, rel=0.02)
    assert true.compliance == pytest.approx(1 / (2 * K * ZETA * np.sqrt(1 - ZETA**2)), rel=2e-3)
    off = []
    for _ in range(200):
        noise = deviation * (rng.normal(size=len(lines)) + 1j * rng.normal(size=len(lines))) / np.sqrt(2)
        (found,) = resonances(lines, mode(lines) + noise, deviation)
        off.append(
            [
                (found.frequency - true.frequency) / found.frequency_error,
                (found.damping_ratio - true.damping_ratio) / found.damping_error,
                (found.compliance - true.compliance) / found.compliance_error,
            ]
        )
    assert np.all(np.abs(np.std(off, axis=0) - 1) < 0.25)
    assert np.all(np.abs(np.mean(off, axis=0)) < 0.5)


def scatter(damping: float, step: float, relative: bool, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Differences of damping and compliance over their stated errors, noise of a hundredth known from neighbours alone.

    First with the deviation as gathered, then as raised at the peak, over repeated noise.
    """
    lines, rng = np.arange(200.0, 600.0, step), np.random.default_rng(seed)
    r = lines / F
    H = 1 / (K * (1 - r**2 + 2j * damping * r)) + 0.3 / K
    noise = 0.01 * (np.abs(H) if relative else np.full(len(H), np.max(np.abs(H))))
    (true,) = resonances(lines, H)
    off: tuple[list[list[float]], list[list[float]]] = ([], [])
    for _ in range(count):
        noisy = H + noise * (rng.normal(size=len(H)) + 1j * rng.normal(size=len(H))) / np.sqrt(2)
        gathered = from_neighbours(lines, noisy)
        record = LevelFRF("r", "x", "x", 1.0, lines, noisy, gathered, "neighbours", False, "")
        for kept, deviation in zip(off, (gathered, at_the_peaks(record)), strict=True):
            found = min(resonances(lines, noisy, deviation), key=lambda one: abs(one.frequency - F))
            kept.append(
                [
                    (found.damping_ratio - true.damping_ratio) / found.damping_error,
                    (found.compliance - true.compliance) / found.compliance_error,
                ]
            )
    return np.std(off[0], axis=0), np.std(off[1], axis=0)


@pytest.mark.slow
def test_errors_hold_where_noise_grows_with_the_response_and_only_neighbours_tell_it() -> None:
    """Gathered over sixty lines the noise is too small at the peak by a third; read there it is not."""
    before, after = scatter(0.02, 1.0, relative=True, count=120, seed=3)
    assert np.all(before > 1.25)
    assert np.all(np.abs(after - 1) < 0.22)


def test_a_deviation_that_the_file_tells_is_taken_as_it_is() -> None:
    lines = np.arange(300.0, 500.0, 1.0)
    told = np.full(len(lines), 1e-9)
    record = LevelFRF("r", "x", "x", 1.0, lines, mode(lines), told, "file", False, "")
    assert np.array_equal(at_the_peaks(record), told)


@pytest.mark.parametrize(("apart", "told"), [(0.0, True), (0.8, False), (40.0, True)])
def test_no_damping_is_told_of_a_peak_that_two_modes_share(apart: float, told: bool) -> None:
    """Two modes of 2 % damping, their frequencies 0.8 half-power widths apart: one peak has the width of both."""
    first, damping = 100.0, 0.02
    second = first * (1 + 2 * damping * apart)
    lines = np.linspace(60.0, 400.0, 4000)
    H = sum(1 / (f**2 - lines**2 + 2j * damping * f * lines) for f in (first, second))
    found = resonances(lines, np.asarray(H))
    one = max(found, key=lambda r: r.compliance)
    if told:
        assert one.damping_ratio == pytest.approx(damping, rel=0.02)
    else:
        assert np.isnan(one.damping_ratio)
        assert np.isfinite(one.frequency)


def test_resonances_are_paired_with_the_nearest_or_left_alone() -> None:
    a, b = [Resonance(f, 0.01, 1e-7) for f in (100.0, 300.0)], [Resonance(f, 0.01, 1e-7) for f in (104.0, 700.0)]
    found = [(p.measured and p.measured.frequency, p.predicted and p.predicted.frequency) for p in paired(a, b)]
    assert found == [(100.0, 104.0), (300.0, None), (None, 700.0)]


def record_of_the_tool(folder: Path, scale: float = 1.0) -> tuple[Path, Path]:
    """The two-mode tool and a noisy record of its x, ``scale`` times as compliant as it is."""
    machine = read_machine(LIBRARY / "two_mode_tool.toml")
    lines, rng = np.arange(60.0, 3000.0, 2.0), np.random.default_rng(3)
    H = scale * tip_at_rest(machine, lines)(lines)[:, 0, 0]
    H += 1e-3 * np.abs(H).max() * (rng.normal(size=len(lines)) + 1j * rng.normal(size=len(lines)))
    table = "".join(f"{f:.12g},{h.real:.12e},{h.imag:.12e}\n" for f, h in zip(lines, H, strict=True))
    (folder / "x.csv").write_text(f"frequency,real,imaginary\n{table}")
    test = folder / "x.measurement.toml"
    test.write_text(
        'schema = "jointlib/measurement/1"\nkind = "frf"\n[[record]]\nfile = "x.csv"\ndrive = "cutter.x"\n'
        'response = "cutter.x"\nquantity = "receptance"\nforce = "10 N"\n'
    )
    text = (LIBRARY / "two_mode_tool.toml").read_text()
    path = folder / "tool.toml"
    path.write_text(f'{text}\n[[compare]]\nmeasurement = "x.measurement.toml"\n')
    return path, test


def test_a_record_of_the_machine_itself_differs_in_nothing(tmp_path: Path) -> None:
    path, test = record_of_the_tool(tmp_path)
    machine = read_machine(path)
    assert machine.compare == (test,)
    (found,) = compared(machine, test)
    assert found.frac > 0.999
    (pair,) = found.pairs
    assert pair.differences() == {}
    assert "no difference above the uncertainty" in found.sentence()
    assert [row[4:] for row in comparison_rows([found])] == [("none", "none", "none")]


def test_a_tool_more_compliant_than_predicted_costs_depth_by_the_same_share(tmp_path: Path) -> None:
    """With one direction the limiting depth is −1/(2 K Re G): a compliance larger by a quarter takes a fifth."""
    path, test = record_of_the_tool(tmp_path, 1.25)
    machine = replace(
        read_machine(path), tool={"x": "cutter.x"}, cutting={"process": "turning", "specific": 1e9, "speed": [2e3, 4e3]}
    )
    found = compared(machine, test)
    assert found[0].pairs[0].differences()["compliance"] == pytest.approx(1 / 1.25 - 1, abs=0.01)
    depth = depths(machine, [c.record for c in found], np.linspace(2e3, 4e3, 30))
    assert depth is not None
    assert depth.replaced == ("xx",)
    assert depth.predicted / depth.measured == pytest.approx(1.25, rel=0.02)
    assert "the prediction is off by +2" in depth.sentence()
    section = comparison_section(found, depth.sentence())
    assert section.text[0] == depth.sentence()
    assert section.figures[0].svg.startswith("<svg")


@pytest.mark.slow
def test_depths_are_the_lowest_between_the_speeds_too(tmp_path: Path) -> None:
    # Where a flank rubs, each lobe is another and speeds apart miss the lowest by more than a prediction is off.
    path, test = record_of_the_tool(tmp_path)
    turned = {"process": "turning", "specific": 1e9, "diameter": 0.05, "process_damping": 3e4, "speed": [400.0, 4000.0]}
    machine = replace(read_machine(path), tool={"x": "cutter.x"}, cutting=turned)
    noisy = compared(read_machine(path), test)[0].record
    H = tip_at_rest(machine, noisy.frequency)(noisy.frequency)[:, 0, 0]
    speeds = np.linspace(400.0, 4000.0, 40)
    found = depths(machine, [replace(noisy, receptance=H)], speeds)
    assert found is not None
    assert found.predicted == pytest.approx(found.measured, rel=1e-9)
    tool = FRF(noisy.frequency, H[:, None, None], ("cutter.x",), ("cutter.x",))
    coarse, fine = (
        float(np.min(stability_lobes(tool, Cutting(**turned), some, axes=("x",)).depth))
        for some in (speeds, np.linspace(400.0, 4000.0, 2000))
    )
    assert found.predicted == pytest.approx(fine, rel=1e-3)
    assert coarse > 1.005 * found.predicted


def test_friction_that_the_machine_lacks_shows_at_small_forces() -> None:
    machine = read_machine(LIBRARY / "three_joints.toml")
    found = compared(machine, LIBRARY / "three_joints" / "tip.measurement.toml")
    assert [c.record.force for c in found] == [1.0, 3.0, 8.0, 15.0, 20.0]
    alike = [c.frac for c in found]
    assert alike == sorted(alike)
    first = [c.pairs[0].differences() for c in found]
    assert all(d["damping_ratio"] < 0 < d["compliance"] for d in first)
    assert first[0]["compliance"] > 5 * first[-1]["compliance"]
    assert any("not there" in row for row in comparison_rows(found))


def test_records_at_the_tool_are_those_at_its_degree_of_freedom(tmp_path: Path) -> None:
    """``tool.x``, as an imported record names the place, is what [tool] says of x."""
    machine = read_machine(LIBRARY / "three_joints.toml")
    shipped = LIBRARY / "three_joints" / "tip.measurement.toml"
    text = shipped.read_text().replace(f'"{machine.tool["x"]}"', '"tool.x"').replace("tip_", f"{shipped.parent}/tip_")
    assert text.count('"tool.x"') == 10
    (tmp_path / "tip.measurement.toml").write_text(text)
    found, known = compared(machine, tmp_path / "tip.measurement.toml"), compared(machine, shipped)
    assert [c.pairs for c in found] == [c.pairs for c in known]
    assert found[0].record.drive == machine.tool["x"]


@pytest.mark.parametrize(
    ("factor", "said"),
    [(1e3, "1000 times as large"), (-1e-3, "1000 times smaller and of reversed sign"), (1.05e3, "1000 times as large"),
     (9.81, "9.80665 times as large"), (-1.2, "the opposite sign"), (1.3, ""), (30.0, "")],
)  # fmt: skip
def test_a_record_whose_size_is_that_of_another_unit_is_named(factor: float, said: str) -> None:
    lines = np.arange(300.0, 500.0, 1.0)
    found = unit_smell(factor * mode(lines), mode(lines))
    assert said in found
    assert bool(found) == bool(said)


def test_differences_are_told_without_powers_of_ten() -> None:
    assert [share(x) for x in (-0.999, -0.5, 0.12, 999.0, 1.3)] == [
        "0.001 times",
        "-50 %",
        "+12 %",
        "1000 times",
        "2.3 times",
    ]


def test_a_record_a_thousand_times_too_small_is_told_as_a_unit(tmp_path: Path) -> None:
    path, test = record_of_the_tool(tmp_path, 1e-3)
    (found,) = compared(read_machine(path), test)
    assert found.frac > 0.99
    assert "e+0" not in found.sentence()
    assert any("1000 times smaller: that smells of a unit" in warning for warning in found.warnings)
