"""Coefficients from dynamometer records, simulated slice by slice in time by other code than the fit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from repeats import repeats

from jointlib import InputError, read_measurement
from jointlib.answers.identify import cutting_forces
from jointlib.cutting_force.cut import AXES, Cut
from jointlib.cutting_force.cutting_file import read_cutting_file, write_cutting_file
from jointlib.cutting_force.identify import identify_cutting
from jointlib.cutting_force.result import CuttingForces
from jointlib.cutting_force.run_out import uneven
from jointlib.cutting_force.tooth_force import COEFFICIENTS, harmonics
from jointlib.rig.dynamometer import EXAMPLE, Milled, Stand, milled, transfer, turned, write_forces

SHIPPED = Path(__file__).parents[2] / "machines" / "library" / "end_mill_forces"
RATE, SPEED, DEPTH, DIAMETER = 6400.0, 3000.0, 1e-3, 12e-3
NOISY = Stand(noise=0.01)
"""40 dB."""
THREE = (0.0, 6e-6, -3e-6)
CUTS: Mapping[str, dict[str, Any]] = {
    "slot": {},
    "half down": {"mode": "down", "immersion": 0.5, "arc": (90.0, 180.0)},
    "quarter up, straight edges": {"mode": "up", "immersion": 0.25, "arc": (0.0, 60.0), "helix": 0.0},
    "slot of four teeth": {"teeth": 4},
    "a dynamometer that resonates": {"stand": replace(NOISY, mode=(1500.0, 0.03))},
    "run-out of 8 um": {"runout": (4e-6, -4e-6)},
    "three uneven flutes up": {"mode": "up", "immersion": 0.5, "arc": (0.0, 90.0), "teeth": 3, "runout": THREE},
}


def recorded(
    folder: Path,
    seed: int,
    *,
    mode: str = "slot",
    immersion: float = 1.0,
    arc: tuple[float, float] = (0.0, 180.0),
    teeth: int = 2,
    helix: float = 30.0,
    stand: Stand = NOISY,
    runout: tuple[float, ...] = (),
    feeds: tuple[float, ...] = (0.04, 0.08, 0.12, 0.16),
    seconds: float = 0.5,
    channels: tuple[str, ...] = ("Fx", "Fy", "Fz"),
    transfers: bool = True,
    sign: float = 1.0,
    extra: str = "",
) -> Path:
    """A measurement of milled cuts, on a spindle that turns 0.4 % faster than its display says."""
    rng = np.random.default_rng(seed)
    text = f'schema = "jointlib/measurement/1"\nkind = "cutting-force"\nsample_rate = {RATE}\nband = [0, 2000]\n'
    text += f'[cutting]\nteeth = {teeth}\nmode = "{mode}"\ndiameter = {DIAMETER}\nhelix = {helix}\n'
    text += f"depth = {DEPTH}\nspeed = {SPEED}\n" + ("" if mode == "slot" else f"immersion = {immersion}\n") + extra
    for name in channels:
        text += f'[[channel]]\nname = "{name}"\nquantity = "force"\nunit = "N"\n'
        text += 'transfer = "dynamometer.csv"\n' if stand.mode and transfers else ""
    if stand.mode:
        f = np.arange(0.0, 3201.0, 10.0)
        H = transfer(stand, f)
        np.savetxt(folder / "dynamometer.csv", np.c_[f, H.real, H.imag], delimiter=",", header="f,re,im", comments="")
    for feed in feeds:
        cut = Milled(EXAMPLE, teeth, arc, 1.004 * SPEED, feed * 1e-3, DEPTH, DIAMETER, helix, runout)
        force = sign * milled(cut, RATE, seconds, stand, rng)
        named = dict(zip(("Fx", "Fy", "Fz"), force, strict=True))
        np.savez(folder / f"feed_{feed}.npz", **{name: named[name] for name in channels})
        text += f'[[record]]\nfile = "feed_{feed}.npz"\nfeed = "{feed} mm"\n'
    (folder / "forces.toml").write_text(text)
    return folder / "forces.toml"


def deviations(found: CuttingForces) -> np.ndarray[Any, Any]:
    """Error of each coefficient over the standard error that is told."""
    return np.array([(p.value - EXAMPLE[n]) / (p.standard_error or 0.0) for n, p in found.parameters.items()])


def test_mean_forces_of_a_slot_are_those_of_the_textbook() -> None:
    c, a, N = 1e-4, 2e-3, 3
    mean = harmonics(Cut("milling", 3000, a, c, teeth=N), np.zeros(1))[0].real
    slope, edge = N * a * c / 4, N * a / np.pi
    np.testing.assert_allclose(mean[0], [0, -slope, 0, 0, -edge, 0], atol=1e-18)
    np.testing.assert_allclose(mean[1], [slope, 0, 0, edge, 0, 0], atol=1e-18)
    np.testing.assert_allclose(mean[2], [0, 0, N * a * c / np.pi, 0, 0, N * a / 2], atol=1e-18)


@pytest.mark.parametrize("kind", CUTS)
def test_harmonics_are_those_of_the_force_stepped_in_time(kind: str) -> None:
    given = {"mode": "slot", "immersion": 1.0, "arc": (0.0, 180.0), "teeth": 2, "helix": 30.0, **CUTS[kind]}
    cut = Cut(
        "milling", SPEED, DEPTH, 1e-4, given["teeth"], given["mode"], given["immersion"], DIAMETER, given["helix"]
    )
    rate, revolutions = 12800.0, 4
    samples = round(revolutions * 60 / SPEED * rate)
    of_time = Milled(EXAMPLE, cut.teeth, given["arc"], SPEED, cut.feed, DEPTH, DIAMETER, cut.helix)
    force = milled(of_time, rate, 0.2, Stand(), np.random.default_rng(0))[:, 200 : 200 + samples]
    order = np.arange(1, 8)
    lines = np.fft.rfft(force, axis=1)[:, revolutions * cut.teeth * order] / samples
    model = harmonics(cut, order.astype(float)) @ np.array([EXAMPLE[n] for n in COEFFICIENTS])
    # The angle at which the record begins is free; sizes and the phases between the forces are not.
    scale = np.max(np.abs(model))
    np.testing.assert_allclose(np.abs(lines.T), np.abs(model), atol=3e-4 * scale)
    np.testing.assert_allclose(lines[0] * lines[1].conj(), model[:, 0] * model[:, 1].conj(), atol=1e-3 * scale**2)


@pytest.mark.slow
@pytest.mark.parametrize(
    "kind", repeats(CUTS, lambda kind: kind in ("half down", "a dynamometer that resonates", "run-out of 8 um"))
)
def test_coefficients_come_back_within_their_errors_at_40_db(kind: str, tmp_path: Path) -> None:
    found = identify_cutting(read_measurement(recorded(tmp_path, 3, **CUTS[kind])))
    assert found.method == "instantaneous"
    assert np.max(np.abs(deviations(found))) < 4
    assert all((p.standard_error or 1.0) < 0.01 * EXAMPLE[name] for name, p in found.parameters.items())
    assert found.misfit < 2
    assert found.rms < 0.02 * max(abs(one.measured) for one in found.means)


@pytest.mark.slow
@pytest.mark.parametrize("kind", CUTS)
def test_intervals_of_95_percent_hold_the_truth_at_least_nine_times_in_ten(kind: str, tmp_path: Path) -> None:
    inside = []
    for seed in range(20):
        found = identify_cutting(read_measurement(recorded(tmp_path, 100 + seed, **CUTS[kind])))
        inside.append(np.abs(deviations(found)) < 1.96)
    assert np.mean(inside) >= 0.9


@pytest.mark.thorough
def test_errors_are_as_large_as_the_scatter_of_repeated_tests(tmp_path: Path) -> None:
    short = {"seconds": 0.25, "feeds": (0.05, 0.15), "mode": "up", "immersion": 0.25, "arc": (0.0, 60.0), "helix": 0.0}
    z = [deviations(identify_cutting(read_measurement(recorded(tmp_path, seed, **short)))) for seed in range(12)]
    assert 0.6 < np.sqrt(np.mean(np.square(z))) < 1.5
    assert np.mean(np.abs(z) < 1.96) >= 0.85


@pytest.mark.thorough
def test_a_resonance_of_the_dynamometer_that_nobody_tells_is_noticed(tmp_path: Path) -> None:
    file = recorded(tmp_path, 1, stand=replace(NOISY, mode=(1500.0, 0.03)), transfers=False)
    found = identify_cutting(read_measurement(file))
    assert found.misfit > 4
    assert any("resonate" in said for said in found.messages)
    assert np.max(np.abs(deviations(found))) < 4  # errors are raised by what the records miss


def turned_records(folder: Path, drift: float = 0.0) -> Path:
    """A measurement of turned cuts whose zero drifts by so many N along each record."""
    rng = np.random.default_rng(5)
    text = 'schema = "jointlib/measurement/1"\nkind = "cutting-force"\nsample_rate = 2000\n'
    text += '[cutting]\nprocess = "turning"\nspeed = 1200\ndepth = "2 mm"\n'
    for name in AXES["turning"]:
        text += f'[[channel]]\nname = "{name}"\nquantity = "force"\n'
    for feed in (0.05, 0.1, 0.2):
        force = turned(EXAMPLE, feed * 1e-3, 2e-3, 2000.0, 1.0, NOISY, rng)
        force = force + drift * np.linspace(0, 1, force.shape[1])
        np.savez(folder / f"{feed}.npz", **dict(zip(AXES["turning"], force, strict=True)))
        text += f'[[record]]\nfile = "{feed}.npz"\nfeed = "{feed} mm"\n'
    (folder / "turned.toml").write_text(text)
    return folder / "turned.toml"


def test_turning_gives_all_six_by_a_straight_line(tmp_path: Path) -> None:
    found = cutting_forces(turned_records(tmp_path), output=tmp_path / "steel.cutting.toml")
    assert found.method == "average"
    assert np.max(np.abs(deviations(found))) < 4
    assert read_cutting_file(tmp_path / "steel.cutting.toml").process == "turning"
    assert not any("drifts" in said for said in found.messages)


def test_a_zero_that_drifts_is_told_and_counted_in_the_errors(tmp_path: Path) -> None:
    found = identify_cutting(read_measurement(turned_records(tmp_path, drift=20.0)))
    for name in AXES["turning"]:
        assert any(said.startswith(f"{name} drifts by up to 20") or f"{name} drifts by up to 19" in said
                   for said in found.messages)  # fmt: skip
    apart = deviations(found)
    edges = np.array([name.startswith("edge") for name in found.parameters])
    assert np.all(np.abs(apart) < 2)
    # half of 20 N over 2 mm is 5 N/mm of edge force
    wrong = np.array([p.value - EXAMPLE[name] for name, p in found.parameters.items()])
    np.testing.assert_allclose(wrong[edges], 5e3, rtol=0.2)


@pytest.mark.thorough
def test_two_forces_in_the_plane_tell_four_coefficients(tmp_path: Path) -> None:
    found = identify_cutting(read_measurement(recorded(tmp_path, 2, channels=("Fx", "Fy"))))
    assert set(found.parameters) == {"tangential", "normal", "edge_tangential", "edge_normal"}
    assert np.max(np.abs(deviations(found))) < 4


@pytest.mark.thorough
def test_the_force_on_the_workpiece_is_the_other_way_round(tmp_path: Path) -> None:
    found = identify_cutting(read_measurement(recorded(tmp_path, 4, sign=-1.0, extra='acts_on = "workpiece"\n')))
    assert np.max(np.abs(deviations(found))) < 4


def test_a_cutting_file_reads_back_bit_for_bit(tmp_path: Path) -> None:
    found = cutting_forces(SHIPPED / "forces.measurement.toml", output=tmp_path / "a.cutting.toml")
    back = read_cutting_file(tmp_path / "a.cutting.toml")
    write_cutting_file(tmp_path / "b.cutting.toml", back)
    assert (tmp_path / "a.cutting.toml").read_bytes() == (tmp_path / "b.cutting.toml").read_bytes()
    assert back.values == found.coefficients.values
    assert back.covariance is not None
    errors = [p.standard_error for p in found.parameters.values()]
    np.testing.assert_allclose(np.sqrt(np.diag(back.covariance.matrix)), errors)
    assert back.provenance["simulated"] is True


@pytest.mark.slow
def test_the_records_that_ship_are_those_of_the_generator(tmp_path: Path) -> None:
    write_forces(tmp_path)
    assert (tmp_path / "forces.measurement.toml").read_text() == (SHIPPED / "forces.measurement.toml").read_text()
    found = [identify_cutting(read_measurement(folder / "forces.measurement.toml")) for folder in (tmp_path, SHIPPED)]
    for name in EXAMPLE:
        assert found[0].parameters[name].value == pytest.approx(found[1].parameters[name].value, rel=1e-9)
    assert np.max(np.abs(deviations(found[1]))) < 3


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            lambda t: t.replace('feed = "0.08 mm"', 'feed = "0.04 mm"'),
            "one feed only (0.04 mm), expected records at three",
        ),
        (lambda t: t.replace('unit = "N"', 'unit = "lbf"', 1), "unit is 'lbf', expected N or kN"),
        (
            lambda t: t.replace('name = "Fx"', 'name = "F1"\ncolumn = "Fx"'),
            "channel F1, expected a force of milling among",
        ),
        (lambda t: t.replace('mode = "slot"', 'mode = "down"'), "immersion is missing, expected a/D"),
        (lambda t: t.replace("depth = 0.001", "depth = 0"), "depth is 0 m, expected more than 0"),
        (lambda t: t.replace("speed = 3000.0\n", ""), "speed is missing, expected it in [cutting] or in the record"),
        (lambda t: t.replace("[cutting]", '[cutting]\nacts_on = "spindle"'), "acts_on is 'spindle'"),
        (lambda t: t.replace("helix = 30.0", "helix = 90"), "helix is 90 degrees, expected from 0 to below 90"),
        (lambda t: t.replace("teeth = 2", 'teeth = 2\nprocess = "turning"'), "teeth belongs to milling"),
        (lambda t: t.replace("sample_rate = 6400.0\n", ""), "sample_rate is missing"),
        (lambda t: t.replace("[cutting]", '[cutting]\nacts_on = "workpiece"'), "comes out as -79"),
        (lambda t: t.replace("speed = 3000.0", "speed = 300"), "revolutions, expected at least 8"),
        (
            lambda t: t.replace('kind = "cutting-force"', 'kind = "static"'),
            "no place in a measurement of kind 'static'",
        ),
    ],
)
def test_what_cannot_be_used_is_told_in_a_sentence(change: Any, said: str, tmp_path: Path) -> None:
    file = recorded(tmp_path, 0, feeds=(0.04, 0.08), seconds=0.3)
    file.write_text(change(file.read_text()))
    with pytest.raises(InputError) as caught:
        cutting_forces(file, output=tmp_path / "out" / "x.cutting.toml")
    assert any(said in sentence for sentence in caught.value.sentences), caught.value.sentences
    assert not (tmp_path / "out").exists()


def test_flutes_that_do_not_stand_out_cut_alike() -> None:
    cut = Cut("milling", 3000, 1e-3, 1e-4, 3, "up", 0.5, 12e-3, 30.0)
    order = np.arange(9.0)
    found = uneven(cut, 3 * order, np.zeros(3))
    np.testing.assert_allclose(found, harmonics(cut, order), atol=1e-12 * np.max(np.abs(found)))
    np.testing.assert_allclose(uneven(cut, np.array([1.0, 2.0, 4.0]), np.zeros(3)), 0, atol=1e-18)


def test_a_flute_that_stands_far_back_leaves_its_chip_to_the_next() -> None:
    one, both = Cut("milling", 3000, 1e-3, 2e-4), Cut("milling", 3000, 1e-3, 1e-4, teeth=2)
    found = uneven(both, np.arange(5.0), np.array([5e-4, -5e-4]))
    np.testing.assert_allclose(found, harmonics(one, np.arange(5.0)), atol=1e-12 * np.max(np.abs(found)))


def test_run_out_is_found_flute_by_flute(tmp_path: Path) -> None:
    found = identify_cutting(read_measurement(recorded(tmp_path, 3, **CUTS["three uneven flutes up"])))
    out = np.array([one.value for one in found.run_out])
    told = np.array(THREE) - np.mean(THREE)
    turns = [np.roll(told, k) for k in range(3)]
    nearest = turns[int(np.argmin([np.max(np.abs(out - turn)) for turn in turns]))]
    assert np.max(np.abs(out - nearest)) < 0.02e-6
    assert all(0 < (one.standard_error or 0) < 0.01e-6 for one in found.run_out)
    assert np.max(np.abs(deviations(found))) < 4
    assert any(said.startswith("Run-out: the flutes stand out by") for said in found.messages)
    assert len(found.as_json()["run_out"]) == 3


@pytest.mark.slow
def test_teeth_that_differ_by_more_than_their_place_are_told(tmp_path: Path) -> None:
    file = recorded(tmp_path, 3, feeds=(0.05, 0.15), teeth=4)
    for feed in (0.05, 0.15):
        record = dict(np.load(tmp_path / f"feed_{feed}.npz"))
        turn = 2 * np.pi * 1.004 * SPEED / 60 * np.arange(len(record["Fx"])) / RATE
        record["Fy"] = record["Fy"] * (1 + 0.3 * np.cos(turn))  # one edge is worn
        np.savez(tmp_path / f"feed_{feed}.npz", **record)
    found = identify_cutting(read_measurement(file))
    assert not found.run_out
    assert any("differs from tooth to tooth by" in said for said in found.messages)


@pytest.mark.slow
def test_the_other_sense_of_milling_is_named(tmp_path: Path) -> None:
    file = recorded(tmp_path, 3, **CUTS["three uneven flutes up"])
    file.write_text(file.read_text().replace('mode = "up"', 'mode = "down"'))
    (said,) = [said for said in identify_cutting(read_measurement(file)).messages if "-milling" in said]
    assert said.startswith("As up-milling the records leave 0.08")
    assert said.endswith('is it mode = "up", or does an axis look the other way?')


def test_the_number_of_teeth_that_the_force_repeats_with_is_named(tmp_path: Path) -> None:
    file = recorded(tmp_path, 3, **CUTS["three uneven flutes up"])
    file.write_text(file.read_text().replace("teeth = 3", "teeth = 4"))
    with pytest.raises(InputError, match=r"forces.toml: the force repeats 3 times .*, not 4 times: is teeth 3"):
        identify_cutting(read_measurement(file))


@pytest.mark.slow
def test_kilonewtons_read_as_newtons_are_named(tmp_path: Path) -> None:
    file = recorded(tmp_path, 3)
    assert not any("metal" in said for said in identify_cutting(read_measurement(file)).messages)
    for path in tmp_path.glob("*.npz"):
        np.savez(path, **{name: 1e-3 * force for name, force in np.load(path).items()})
    (said,) = [said for said in identify_cutting(read_measurement(file)).messages if "metal" in said]
    assert said.startswith("tangential 0.796 N/mm² is not that of a metal, 300 to 6000; 1000 times that would be usual")


@pytest.mark.slow
def test_an_edge_that_pulls_is_named(tmp_path: Path) -> None:
    file = recorded(tmp_path, 3, **CUTS["half down"], extra='acts_on = "tool"\n')
    for path in tmp_path.glob("*.npz"):
        np.savez(path, **{name: force + 60 * (name == "Fx") for name, force in np.load(path).items()})
    assert any("pulls" in said for said in identify_cutting(read_measurement(file)).messages)


def test_the_result_shows_itself() -> None:
    found = identify_cutting(read_measurement(SHIPPED / "forces.measurement.toml"))
    axes = found.plot()
    assert axes.get_ylabel() == "mean force [N]"
    assert "tangential 79" in repr(found)
    assert list(found.columns()["coefficient"][0]) == list(COEFFICIENTS)
