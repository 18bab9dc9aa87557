"""Frequency responses of a machine at several forces: what is read is what was measured, and its noise is found."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import pyuff
from scipy.io import savemat

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.frf import Quantity
from jointlib.io.measurement_file import read_measurement
from machines import Lumped, Machine, Modal
from machines.loop.noise.deviation import from_neighbours, from_repeats, local_errors
from machines.loop.records import LevelFRF, read_frfs, said_of
from machines.loop.sparse_lines import sparse_lines

LINES = np.linspace(50.0, 800.0, 180)
CLOSE = np.linspace(50.0, 800.0, 376)
"""Four in the narrowest half-power bandwidth, 7.2 Hz."""
FRAME = Modal(
    "frame",
    ("x", "y"),
    np.array([120.0, 260.0, 300.0, 600.0]),
    np.array([0.03, 0.015, 0.03, 0.02]),
    np.array([[0.22, 0.35, -0.18, 0.26], [0.2, -0.3, 0.1, 0.2]]),
)
MACHINE = Machine((FRAME, Lumped("slide", ("x",), np.eye(1))), tool={"x": "frame.x"})


def truth(response: int = 0, lines: Array = LINES) -> ComplexArray:
    return FRAME.receptance(2 * np.pi * lines)[:, response, 0]


def noise(rng: np.random.Generator, n: int) -> ComplexArray:
    return np.asarray((rng.standard_normal(n) + 1j * rng.standard_normal(n)) / np.sqrt(2))


def csv(path: Path, f: Array, H: ComplexArray, **more: Array) -> None:
    header = ",".join(["f", "re", "im", *more])
    np.savetxt(path, np.column_stack([f, H.real, H.imag, *more.values()]), delimiter=",", header=header, comments="")


def record(file: str, **keys: str | float | bool) -> str:
    words = {"drive": "frame.x", "response": "frame.x", "quantity": "receptance", "force": 10.0, "file": file, **keys}
    said = [f"{key} = {str(v).lower() if isinstance(v, bool) else repr(v)}" for key, v in words.items() if v != ""]
    return "[[record]]\n" + "\n".join(said).replace("'", '"') + "\n"


def read(folder: Path, *records: str) -> tuple[LevelFRF, ...]:
    path = folder / "test.measurement.toml"
    path.write_text('schema = "jointlib/measurement/1"\nkind = "frf"\n' + "".join(records))
    return read_frfs(read_measurement(path), MACHINE)


@pytest.mark.parametrize("quantity", Quantity)
@pytest.mark.parametrize("suffix", ["csv", "npz", "mat"])
def test_every_quantity_and_file_gives_the_receptance(tmp_path: Path, quantity: Quantity, suffix: str) -> None:
    per, deviation = quantity.per_receptance(LINES), 0.01 * np.abs(truth())
    value, spread = truth() * per, deviation * np.abs(per)
    if suffix == "csv":
        csv(tmp_path / "a.csv", LINES, value, deviation=spread)
    else:
        arrays = {"frequency": LINES, quantity.word: value, "variance": spread**2}
        (savemat if suffix == "mat" else _npz)(str(tmp_path / f"a.{suffix}"), arrays)
    (found,) = read(tmp_path, record(f"a.{suffix}", quantity=quantity.word, force="20 N"))
    np.testing.assert_allclose(found.receptance, truth(), rtol=1e-12)
    np.testing.assert_allclose(found.deviation, deviation, rtol=1e-12)
    assert (found.drive, found.response, found.force, found.deviation_from) == ("frame.x", "frame.x", 20.0, "file")
    assert not found.sealed
    assert len(found.sha256) == 64


def _npz(path: str, arrays: dict[str, Array]) -> None:
    np.savez(path, **arrays)


def universal(path: Path, places: dict[tuple[int, int], ComplexArray]) -> None:
    for (response, drive), value in places.items():
        pyuff.UFF(str(path)).write_sets(
            pyuff.prepare_58(
                func_type=4,
                rsp_node=abs(response),
                rsp_dir=1 if response > 0 else -1,
                ref_node=abs(drive),
                ref_dir=1 if drive > 0 else -1,
                data=value,
                x=LINES,
                id1="frf",
                rsp_ent_name="NONE",
                ref_ent_name="NONE",
                abscissa_spacing=0,
                ordinate_spec_data_type=8,
                orddenom_spec_data_type=13,
                abscissa_spec_data_type=18,
            ),
            "add",
        )


def test_a_universal_file_gives_the_function_that_is_asked_for_with_the_sign_of_its_directions(tmp_path: Path) -> None:
    universal(tmp_path / "a.uff", {(1, 1): truth(0), (-2, 1): -truth(1)})
    tip = record("a.uff", quantity="", response_at="1+X", drive_at="1+X")
    side = record("a.uff", quantity="", response="frame.y", response_at="2+X", drive_at="1+X")
    a, b = read(tmp_path, tip, side)
    np.testing.assert_allclose(a.receptance, truth(0), rtol=1e-6)
    np.testing.assert_allclose(b.receptance, truth(1), rtol=1e-6)
    assert a.name != b.name
    with pytest.raises(InputError, match=r"holds no responses at 3\+X to a force at 1\+X"):
        read(tmp_path, record("a.uff", quantity="", response_at="3+X", drive_at="1+X"))
    with pytest.raises(InputError, match="expected response_at and drive_at"):
        read(tmp_path, record("a.uff", quantity=""))


@pytest.mark.parametrize("growth", [0.0, 1.0])
@pytest.mark.parametrize("count", [120, 180, 300])
def test_noise_is_found_from_the_neighbours_at_and_away_from_resonances(growth: float, count: int) -> None:
    lines, rng = np.linspace(50.0, 800.0, count), np.random.default_rng(11)
    H = truth(0, lines)
    shape = np.abs(H) ** growth
    sigma = 0.01 * np.sqrt(np.mean(np.abs(H) ** 2)) * shape / np.sqrt(np.mean(shape**2))
    ratios = np.array([from_neighbours(lines, H + sigma * noise(rng, count)) / sigma for _ in range(30)])
    at = np.min(np.abs(lines[:, None] - FRAME.frequency), axis=1) < 6.0
    for part in (at, ~at):
        assert np.mean(ratios[:, part]) == pytest.approx(1.0, abs=0.1)
        assert np.std(ratios[:, part]) < 0.2
    assert np.mean(np.abs(ratios - 1) < 0.2) > 0.85


@pytest.mark.parametrize(("of_force", "of_motion"), [(0.004, 0.002), (0.0, 0.01), (0.01, 0.0)])
def test_noise_from_the_neighbours_leaves_a_chi_square_of_one_also_where_it_has_two_sources(
    of_force: float, of_motion: float
) -> None:
    """Noise in proportion to |H| over a floor, thirty times the median at the top; smooth stretches between peaks."""
    peaks, rng = np.array([130.0, 372.0, 645.0]), np.random.default_rng(3)
    near = [f * (1 + 2e-5 * f * np.linspace(-12, 12, 73)) for f in peaks]
    lines = np.unique(np.concatenate([np.linspace(80.0, 700.0, 120), *near]))
    r = lines[:, None] / peaks
    H = (np.array([1.0, 0.2, 0.3]) / (1 - r**2 + 4e-5j * peaks * r)).sum(axis=1)
    sigma = np.hypot(of_force * np.abs(H), of_motion * np.median(np.abs(H)))
    top = np.argsort(np.abs(H))[-20:]
    chi2, ratios = [], []
    for _ in range(12):
        error = sigma * noise(rng, len(H))
        found = from_neighbours(lines, H + error)
        chi2.append(np.mean(np.abs(error / found) ** 2))
        ratios.append(np.mean(found[top] / sigma[top]))
    assert np.mean(chi2) == pytest.approx(1.05, abs=0.06)
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.1)


def test_the_local_fit_holds_two_resonances_exactly() -> None:
    # A ratio of polynomials of order 2 in f near f0 is what one pole pair with a residual leaves of a receptance.
    f = np.linspace(100.0, 140.0, 40)
    H = (1.0 + 0.3j + 0.01 * f) / (1 + 0.05j * (f - 120.0) - 0.01 * (f - 123.0) ** 2)
    error, smooth = local_errors(f, H)
    assert np.max(np.abs(error)) < 1e-8 * np.max(np.abs(H))
    np.testing.assert_allclose(smooth, H, rtol=1e-7)


def test_a_jump_of_the_response_is_no_noise() -> None:
    rng, H = np.random.default_rng(2), truth()
    sigma = 0.01 * np.sqrt(np.mean(np.abs(H) ** 2))
    jumped = np.where(LINES < 126.0, H, 0.6 * H)
    found = from_neighbours(LINES, jumped + sigma * noise(rng, len(H)))
    assert np.max(found) < 1.5 * sigma


def test_records_that_repeat_tell_the_noise(tmp_path: Path) -> None:
    rng, H = np.random.default_rng(5), truth()
    sigma = 0.01 * np.abs(H)
    for i in range(3):
        csv(tmp_path / f"r{i}.csv", LINES, H + sigma * noise(rng, len(H)))
    csv(tmp_path / "more.csv", LINES, 0.9 * H + sigma * noise(rng, len(H)))
    several = [record(f"r{i}.csv") for i in range(3)]
    found = read(tmp_path, *several, record("more.csv", force=30.0))
    assert [f.deviation_from for f in found] == ["repeats"] * 3 + ["neighbours"]
    for f in found[:3]:
        np.testing.assert_allclose(f.deviation / sigma, 1.0, atol=0.25)
        assert np.mean(f.deviation / sigma) == pytest.approx(1.0, abs=0.1)


def test_two_repeats_give_the_spread_of_one_record_not_of_their_mean() -> None:
    rng = np.random.default_rng(8)
    pairs = [[noise(rng, 200), noise(rng, 200)] for _ in range(40)]
    assert np.mean([from_repeats([1 + 0.1 * a for a in p]) for p in pairs]) == pytest.approx(0.1, rel=0.05)


def test_records_of_one_force_cannot_show_amplitude_dependence(tmp_path: Path) -> None:
    csv(tmp_path / "a.csv", CLOSE, truth(lines=CLOSE))
    assert "cannot be seen" in said_of(read(tmp_path, record("a.csv")))[-1]
    csv(tmp_path / "b.csv", CLOSE, truth(lines=CLOSE))
    assert said_of(read(tmp_path, record("a.csv"), record("b.csv", force=20.0))) == ()


def test_a_gap_in_the_lines_and_a_line_at_zero_are_told(tmp_path: Path) -> None:
    kept = (CLOSE < 350) | (CLOSE > 500)
    csv(tmp_path / "a.csv", CLOSE[kept], truth(lines=CLOSE)[kept])
    ((found,),) = (read(tmp_path, record("a.csv")),)
    assert found.remarks == ("a.csv: the lines jump from 348 to 502 Hz; what lies between is not known.",)
    csv(tmp_path / "a.csv", np.concatenate([[0.0], CLOSE]), np.concatenate([[1.0], truth(lines=CLOSE)]))
    (found,) = read(tmp_path, record("a.csv"))
    assert found.remarks == ("a.csv: the line at 0 Hz is left out.",)
    assert len(found.frequency) == len(CLOSE)


@pytest.mark.parametrize("step", [3.0, 5.0, 8.0, 16.0])
def test_a_peak_with_too_few_lines_is_told_with_its_bandwidth(tmp_path: Path, step: float) -> None:
    """2ζf of the two large modes is 7.2 and 7.8 Hz: two lines of 3 Hz stand in it, and not two of 5 Hz."""
    for offset in np.linspace(0, step, 5):
        lines = np.arange(40 + offset, 700, step)
        for response in (0, 1):
            H = truth(response, lines)
            csv(tmp_path / "a.csv", lines, H + 0.01 * np.abs(H) * noise(np.random.default_rng(3), len(lines)))
            (found,) = read(tmp_path, record("a.csv", response=f"frame.{'xy'[response]}"))
            said = [r for r in found.remarks if "half-power bandwidth" in r]
            assert bool(said) == (step > 3.0)
            for sentence in said:
                told = re.search(r"([\d.]+) lines stand in the half-power bandwidth of ([\d.]+) Hz", sentence)
                assert told is not None
                width = float(told[2])
                # Other modes bend 1/H where lines are far apart.
                assert width == pytest.approx(7.5, rel=0.15 if step < 10 else 0.4)
                assert float(told[1]) == pytest.approx(width / step, rel=0.06)


def test_a_jump_of_a_bent_peak_is_not_taken_for_a_narrow_one() -> None:
    """A cubic spring bends the peak; where the upper branch ends the response drops from one line to the next."""
    A, k3, f0, zeta = np.linspace(1e-3, 1.0, 200001), 0.3, 100.0, 0.02
    shift = 1 + 0.75 * k3 * A**2
    w = np.sqrt(shift - 2 * zeta**2 - np.sqrt((shift - 2 * zeta**2) ** 2 - shift**2 + (0.04 / A) ** 2 + 0j))
    rising = (np.abs(w.imag) < 1e-9) & (0.04 / (2 * zeta) >= A)
    lines = np.arange(60.0, 150.0, 0.5)
    amplitude = np.interp(lines / f0, w.real[rising], A[rising], right=0.0)
    below = 0.04 / np.hypot((lines / f0) ** 2 - 1, 2 * zeta * lines / f0)
    amplitude = np.where(amplitude > 0, amplitude, below)
    r = lines / f0
    H = amplitude * np.exp(-1j * np.arctan2(2 * zeta * r, 1 + 0.75 * k3 * amplitude**2 - r**2))
    assert np.max(np.abs(np.diff(np.abs(H)))) > 0.5
    assert sparse_lines(lines, H) == []


def test_the_same_file_name_in_two_folders_gives_two_names(tmp_path: Path) -> None:
    for force in (10, 20):
        (tmp_path / f"{force}N").mkdir()
        csv(tmp_path / f"{force}N" / "tip.csv", LINES, truth())
    found = read(tmp_path, *(record(f"{force}N/tip.csv", force=float(force)) for force in (10, 20)))
    assert [f.name for f in found] == ["10N/tip.csv", "20N/tip.csv"]


def test_conjugate_files_are_refused_until_it_is_said(tmp_path: Path) -> None:
    csv(tmp_path / "a.csv", LINES, truth().conj())
    with pytest.raises(InputError, match=r"Im H > 0 at the driving point frame.x.*conjugate = true"):
        read(tmp_path, record("a.csv"))
    (found,) = read(tmp_path, record("a.csv", conjugate=True))
    np.testing.assert_allclose(found.receptance, truth())


def test_energy_out_of_a_driving_point_is_refused_on_many_lines_and_told_on_few(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    H = truth(lines=CLOSE) + 1e-3 * np.abs(truth(lines=CLOSE)) * noise(rng, len(CLOSE))
    csv(tmp_path / "a.csv", CLOSE, np.where(CLOSE > 500, H.conj(), H))
    with pytest.raises(InputError, match="yields energy"):
        read(tmp_path, record("a.csv"))
    csv(tmp_path / "a.csv", CLOSE, np.where(np.abs(CLOSE - 600) < 5, H.conj(), H))
    (found,) = read(tmp_path, record("a.csv"))
    assert "yields energy" in found.remarks[0]
    csv(tmp_path / "a.csv", CLOSE, truth(1, CLOSE).conj())
    assert read(tmp_path, record("a.csv", response="frame.y"))[0].remarks == ()


@pytest.mark.thorough
def test_noise_alone_does_not_make_a_driving_point_active(tmp_path: Path) -> None:
    H = truth(lines=CLOSE)
    sigma = 0.03 * np.sqrt(np.mean(np.abs(H) ** 2))
    for seed in range(20):
        csv(tmp_path / "a.csv", CLOSE, H + sigma * noise(np.random.default_rng(seed), len(H)))
        assert read(tmp_path, record("a.csv"))[0].remarks == ()


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"drive": "frame.z"}, r"record a.csv: .*drive.*no degree of freedom 'frame.z', did you mean"),
        ({"response": "fram.x"}, r"no degree of freedom 'fram.x', did you mean 'frame.x'"),
        ({"force": 0.0}, "force is 0 N, expected the peak of the force, more than 0"),
        ({"force": ""}, "key 'force' is missing"),
        ({"force": "10 mm"}, "force"),
        ({"quantity": "dynamic stiffness"}, "quantity is 'dynamic stiffness', expected one of"),
        ({"quantity": ""}, "does not say what it holds, expected quantity = receptance, mobility or accelerance"),
        ({"role": "quiet"}, "role is 'quiet'"),
        ({"rows": 3.0}, "unknown key 'rows'"),
        ({"unit": "kg"}, "unit"),
        ({"file": "b.csv"}, "no such file"),
    ],
)
def test_a_wrong_record_is_refused_in_one_sentence(tmp_path: Path, keys: dict[str, str | float], said: str) -> None:
    csv(tmp_path / "a.csv", LINES, truth())
    with pytest.raises(InputError, match=said) as refused:
        read(tmp_path, record("a.csv", **keys) if "file" not in keys else record(str(keys["file"])))
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("lines", "H", "said"),
    [
        (LINES[::-1], truth(), "ascending"),
        (np.where(LINES > 400, LINES - 100, LINES), truth(), "ascending"),
        (LINES, np.where(LINES > 400, np.nan, truth()), "not finite"),
        (LINES[:10], truth()[:10], "10 lines above 0 Hz do not tell their noise, expected at least 16"),
        (LINES, 0 * truth(), "the response is zero on every line"),
    ],
)
def test_lines_that_cannot_be_are_refused(tmp_path: Path, lines: Array, H: ComplexArray, said: str) -> None:
    csv(tmp_path / "a.csv", lines, H)
    with pytest.raises(InputError, match=said):
        read(tmp_path, record("a.csv"))


def test_a_copy_of_a_record_is_no_repeat(tmp_path: Path) -> None:
    for name in "ab":
        csv(tmp_path / f"{name}.csv", LINES, truth())
    with pytest.raises(InputError, match=r"records a.csv and b.csv hold the same values"):
        read(tmp_path, record("a.csv"), record("b.csv"))


def test_channels_and_other_kinds_have_no_place(tmp_path: Path) -> None:
    csv(tmp_path / "a.csv", LINES, truth())
    with pytest.raises(InputError, match=r"\[\[channel\]\] has no place in a measurement of kind 'frf'"):
        read(tmp_path, '[[channel]]\nname = "a"\nquantity = "force"\nunit = "N"\n', record("a.csv"))
    path = tmp_path / "s.measurement.toml"
    path.write_text('schema = "jointlib/measurement/1"\nkind = "static"\n[[record]]\nfile = "a.csv"\n' + CHANNELS)
    with pytest.raises(InputError, match="kind is 'static', a machine is traced on records of 'frf'"):
        read_frfs(read_measurement(path), MACHINE)


CHANNELS = """[[channel]]
name = "f"
quantity = "force"
[[channel]]
name = "re"
quantity = "displacement"
"""
