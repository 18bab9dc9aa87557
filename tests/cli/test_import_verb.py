"""``jointlib import``: what it guesses and says, what corrects it, and what it refuses in a sentence."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from command_line import Done, files, jointlib
from nptdms import ChannelObject, TdmsWriter
from test_measurement_file import UFF58

from jointlib.errors import InputError
from jointlib.io.measurement_file import read_measurement, read_records

RATE = 2000.0
TIME = np.arange(400) / RATE
NOISE = np.random.default_rng(3).normal(size=(4, 400))


def saved(path: Path, names: str, *columns: np.ndarray, time: np.ndarray | None = TIME) -> Path:
    """Semicolons and decimal commas, the time first."""
    every = columns if time is None else (time, *columns)
    rows = [";".join(f"{v:.6f}".replace(".", ",") for v in row) for row in zip(*every, strict=True)]
    path.write_text("\n".join([names, *rows]) + "\n", "latin-1")
    return path


def imported(folder: Path, words: str, name: str = "m.measurement.toml") -> Done:
    return jointlib(f"import {words} -o {folder / name}")


@pytest.mark.parametrize(("heading", "per"), [("[mV]", 1e-3), ("[V]", 1.0), ("(uV)", 1e-6)])
def test_a_sensor_in_the_unit_of_its_heading_is_read_in_it(tmp_path: Path, heading: str, per: float) -> None:
    """2.25 mV/N beside numbers in mV are not a thousand times the force."""
    record = saved(tmp_path / "r.csv", f"Zeit [s];Kraft Hammer {heading};acc [g]", *NOISE[:2])
    words = f"{record} --kind impact --set channel.kraft_hammer.sensitivity='2.25 mV/N'"
    words += " --set channel.kraft_hammer.dof=tool.x --set channel.acc.dof=tool.x"
    imported(tmp_path, words)
    measurement = read_measurement(tmp_path / "m.measurement.toml")
    (found,) = read_records(measurement, measurement.records)
    np.testing.assert_allclose(found.channels["kraft_hammer"], np.round(NOISE[0], 6) * per / 2.25e-3)


def test_frequency_responses_with_a_column_of_the_force_have_its_levels(tmp_path: Path) -> None:
    """The shaker loses two fifths of 2 N and of 60 N on its way; one file says kilonewtons."""
    lines, sag = np.linspace(80.0, 120.0, 40), 1 - 0.4 * np.exp(-(np.linspace(-3, 3, 40) ** 2))
    H = 1 / (1 - (lines / 100) ** 2 + 0.05j)
    for name, unit, force in (("a", "N", 1.997 * sag), ("b", "kN", 0.05994 * sag)):
        head = f"Frequenz [Hz];Betrag [um/N];Phase [deg];force [{unit}]"
        saved(tmp_path / f"{name}.csv", head, lines, np.abs(H), np.degrees(np.angle(H)), force, time=None)
    done = imported(tmp_path, f"{tmp_path / 'a.csv'} {tmp_path / 'b.csv'}")
    assert "peak of the force" not in done.out + done.err
    measurement = read_measurement(tmp_path / "m.measurement.toml")
    assert [r.sweep.level for r in measurement.records if r.sweep] == ["2 N", "60 N"]
    for name in "ab":
        saved(tmp_path / f"{name}.csv", "f [Hz];Re [m/N];Im [m/N]", lines, H.real, H.imag, time=None)
    done = imported(tmp_path, f"{tmp_path / 'a.csv'} {tmp_path / 'b.csv'} --set record.b.force='8 N'", "n.toml")
    assert done.out.count("records with one force count as repeats") == 1, done
    assert "record.a.force" in done.out


def test_a_sensor_beside_a_column_that_is_in_newtons_is_refused(tmp_path: Path) -> None:
    record = saved(tmp_path / "r.csv", "Zeit [s];hammer [N];acc [g]", *NOISE[:2])
    words = f"{record} --kind impact --set channel.hammer.sensitivity='2.25 mV/N' --set channel.hammer.dof=tool.x"
    refused(
        tmp_path,
        words,
        "channel.hammer.sensitivity",
        "the column is in 'N', expected volts, a charge, a current, a torque or %",
    )


def refused(folder: Path, words: str, *said: str) -> None:
    before = files(folder)
    done = imported(folder, words)
    assert (done.status, done.out) == (2, ""), done
    assert len(done.err.splitlines()) == 1, done.err
    for each in said:
        assert each in done.err
    assert files(folder) == before


def test_every_guess_stands_in_the_file_and_on_the_screen(tmp_path: Path) -> None:
    record = saved(tmp_path / "r.csv", "Zeit [s];acc front [g];acc back;hammer [N]", *NOISE[:3])
    done = imported(tmp_path, f"{record} --kind rig --json")
    told = done.json
    assert {k: told[k] for k in ("kind", "sample_rate", "records")} == {
        "kind": "rig",
        "sample_rate": RATE,
        "records": ["r.csv"],
    }
    assert told["channels"] == [
        {"name": "acc_front", "column": "acc front [g]", "role": "a1", "quantity": "acceleration", "unit": "g"},
        {"name": "acc_back", "column": "acc back", "role": "a2", "quantity": "acceleration", "unit": "m/s^2"},
        {"name": "hammer", "column": "hammer [N]", "role": "P", "quantity": "force", "unit": "N"},
    ]
    text = (tmp_path / "m.measurement.toml").read_text("utf-8")
    guessed = [line for line in text.splitlines() if "# guess: " in line]
    assert len(guessed) == len(told["guesses"])
    for sentence in told["guesses"]:
        key, _, rest = sentence.partition(" = ")
        value, why = rest.partition(" is a guess: ")[0], rest.partition(" is a guess: ")[2].partition(";")[0]
        assert any(line.startswith(key.rpartition(".")[2]) and f"# guess: {why}" in line for line in guessed), sentence
        assert value
    assert (
        "channel.acc_back.unit = 'm/s^2' is a guess: the file says no unit; --set channel.acc_back.unit=g"
        in told["guesses"]
    )
    shown = imported(tmp_path, f"{record} --kind rig").out
    assert all(sentence in shown for sentence in told["guesses"])


def test_what_is_set_is_no_guess_any_more(tmp_path: Path) -> None:
    record = saved(tmp_path / "r.csv", "Zeit [s];acc front [g];acc back;hammer [V]", *NOISE[:3])
    words = f"{record} --kind rig --set bodies.block=0.942 --set bodies.rail='2200 g' --set driven=block"
    words += (
        " --set channel.acc_back.unit=g --set channel.acc_back.direction=-z --set channel.hammer.sensitivity='2.5 mV/N'"
    )
    words += " --set channel.acc_front.role=a1 --set channel.acc_back.role=a2 --set channel.hammer.role=P"
    words += " --set channel.acc_front.body=block --set channel.acc_back.body=rail --set record.r.condition=1"
    told = imported(tmp_path, f"{words} --json").json
    assert told["guesses"] == []
    measurement = read_measurement(tmp_path / "m.measurement.toml")
    assert {name: mass.value for name, mass in measurement.bodies.items()} == {"block": 0.942, "rail": 2.2}
    assert measurement.records[0].condition == "1"
    (found,) = read_records(measurement, measurement.records)
    np.testing.assert_allclose(found.channels["a1"], 9.80665 * np.round(NOISE[0], 6))
    np.testing.assert_allclose(found.channels["a2"], -9.80665 * np.round(NOISE[1], 6))
    np.testing.assert_allclose(found.channels["P"], 400 * np.round(NOISE[2], 6))


def test_a_folder_with_a_record_in_each_file_is_one_measurement(tmp_path: Path) -> None:
    folder = tmp_path / "runs"
    folder.mkdir()
    for k in (10, 9, 1):
        saved(folder / f"run_{k}.csv", "t [s];weg [mm];kraft [kN]", NOISE[0] + k, NOISE[1])
    (folder / "photo.jpg").write_bytes(b"\xff\xd8")
    (folder / ".hidden.csv").write_text("x")
    told = imported(tmp_path, f"{folder} --json").json
    assert told["records"] == ["runs/run_1.csv", "runs/run_9.csv", "runs/run_10.csv"]
    assert told["guesses"][0] == f"{folder}: left out, as no records: photo.jpg"
    measurement = read_measurement(tmp_path / "m.measurement.toml")
    records = read_records(measurement, measurement.records)
    assert [round(float(np.mean(r.channels["weg"])) * 1e3) for r in records] == [1, 9, 10]


def test_groups_of_a_tdms_file_that_hold_the_same_channels_are_records(tmp_path: Path) -> None:
    with TdmsWriter(tmp_path / "hits.tdms") as writer:
        for k, size in enumerate((300, 400)):
            for name, row, unit in (("Hammer", 0, "N"), ("Acc", 1, "m/s^2")):
                held = {"wf_increment": 1 / RATE, "unit_string": unit}
                writer.write_segment([ChannelObject(f"Hit {k}", name, NOISE[row][:size] + k, held)])
    words = f"{tmp_path / 'hits.tdms'} --kind shaker"
    told = imported(tmp_path, f"{words} --set 'record.Hit 1.condition=hard' --json").json
    assert "hits.tdms: its 2 groups Hit 0, Hit 1 hold the same channels and are taken as records" in told["guesses"]
    measurement = read_measurement(tmp_path / "m.measurement.toml")
    assert [r.condition for r in measurement.records] == [None, "hard"]
    first, second = read_records(measurement, measurement.records)
    assert (first.name, second.name) == ("hits.tdms[Hit 0]", "hits.tdms[Hit 1]")
    np.testing.assert_array_equal(first.channels["hammer"], NOISE[0][:300])
    np.testing.assert_array_equal(second.channels["acc"], NOISE[1] + 1)


def test_groups_of_a_tdms_file_with_different_channels_are_one_record(tmp_path: Path) -> None:
    with TdmsWriter(tmp_path / "r.tdms") as writer:
        for group, name, row, unit in (("left", "F", 0, "N"), ("left", "z", 1, "um"), ("right", "z", 2, "um")):
            held = {"wf_increment": 1 / RATE, "unit_string": unit}
            writer.write_segment([ChannelObject(group, name, NOISE[row], held)])
    told = imported(tmp_path, f"{tmp_path / 'r.tdms'} --json").json
    assert len(told["records"]) == 1
    assert [c["column"] for c in told["channels"]] == ["left/F", "left/z", "right/z"]


def test_a_column_that_counts_rows_is_no_channel(tmp_path: Path) -> None:
    names = "no;t [s];z [mm];F [N]"
    told = imported(tmp_path, f"{saved(tmp_path / 'r.csv', names, TIME, *NOISE[:2], time=np.arange(1.0, 401))} --json")
    assert [c["name"] for c in told.json["channels"]] == ["z", "f"]
    assert "column 'no' counts the rows and is left out" in told.json["guesses"]


def test_units_may_stand_above_the_names(tmp_path: Path) -> None:
    record = saved(tmp_path / "r.csv", "ms;kN;g\ntime;force;acc", NOISE[0], NOISE[1], time=1000 * TIME)
    told = imported(tmp_path, f"{record} --json").json
    assert told["sample_rate"] == RATE
    assert [c["unit"] for c in told["channels"]] == ["kN", "g"]


@pytest.mark.parametrize(
    ("names", "columns", "timed", "kind"),
    [
        ("z [mm];F [N]", (NOISE[0], NOISE[1]), False, "static"),
        ("t [s];z [mm];F [N]", (NOISE[0], NOISE[1]), True, "path"),
        ("t [s];a1 [g];a2 [g];P [N]", (NOISE[0], NOISE[1], NOISE[2]), True, "rig"),
        ("f [Hz];Re [m/N];Im [m/N]", (TIME + 1, NOISE[0], NOISE[1]), False, "frf"),
    ],
)
def test_the_kind_that_signals_tell(
    names: str, columns: tuple[np.ndarray, ...], timed: bool, kind: str, tmp_path: Path
) -> None:
    record = saved(tmp_path / "r.csv", names, *columns, time=TIME if timed else None)
    told = imported(tmp_path, f"{record} --json").json
    assert told["kind"] == kind
    assert read_measurement(tmp_path / "m.measurement.toml").kind == kind


@pytest.mark.parametrize(("heading", "quantity"), [("Steuerung [V]", "voltage"), ("Steuerung in mA", "current")])
def test_a_voltage_or_current_beside_force_and_motion_is_an_input(tmp_path: Path, heading: str, quantity: str) -> None:
    record = saved(tmp_path / "r.csv", f"t [s];Weg [mm];Kraft [kN];{heading}", *NOISE[:3])
    done = imported(tmp_path, str(record))
    assert f"channel.steuerung.input = true is a guess: parameters may follow a {quantity}" in done.out
    test = read_measurement(tmp_path / "m.measurement.toml")
    assert {c.name: c.is_input for c in test.channels} == {"weg": False, "kraft": False, "steuerung": True}
    assert test.channels[-1].quantity == quantity
    imported(tmp_path, f"{record} --set channel.steuerung.input=false", "n.measurement.toml")
    assert not any(c.is_input for c in read_measurement(tmp_path / "n.measurement.toml").channels)


def test_the_current_of_a_motor_is_a_force(tmp_path: Path) -> None:
    record = saved(tmp_path / "r.csv", "t [s];s in mm;Motorstrom in A", *NOISE[:2])
    refused(tmp_path, str(record), "'Motorstrom in A' is a current (--set channel.motorstrom.sensitivity='14.7 N/A'")
    imported(tmp_path, f"{record} --set channel.motorstrom.sensitivity='14.7 N/A'")
    test = read_measurement(tmp_path / "m.measurement.toml")
    (channel,) = test.of("force")
    assert (test.kind, channel.unit, channel.factor) == ("path", "A", 14.7)


def test_a_path_in_volts_has_no_input(tmp_path: Path) -> None:
    record = saved(tmp_path / "r.csv", "t [s];U1 [V];U2 [V]", *NOISE[:2])
    force = "--set channel.u1.quantity=force --set channel.u1.unit=V"
    travel = "--set channel.u2.quantity=displacement --set channel.u2.unit=V"
    imported(tmp_path, f"{record} {force} {travel}")
    assert not any(c.is_input for c in read_measurement(tmp_path / "m.measurement.toml").channels)


def test_taps_of_a_hammer_become_an_impact_test_that_can_be_estimated(tmp_path: Path) -> None:
    """Three hits on an oscillator of 5 kg at 180 Hz, 2 % damped, its acceleration by the difference of its motion."""
    step = 1 / 4096
    time = np.arange(12288) * step
    force = np.zeros_like(time)
    for first in (2048, 6144, 9421):
        force[first : first + 12] = 300 * np.sin(np.pi * np.arange(12) / 12)
    omega, damping = 2 * np.pi * 180, 0.02
    kernel = np.exp(-damping * omega * time) * np.sin(omega * np.sqrt(1 - damping**2) * time) / (5 * omega)
    motion = np.convolve(force, kernel)[: len(time)] * step
    acceleration = np.gradient(np.gradient(motion, step), step) / 9.80665
    rng = np.random.default_rng(1)
    noisy = force + 0.02 * rng.normal(size=len(time)), acceleration + 1e-3 * rng.normal(size=len(time))
    record = saved(tmp_path / "taps.csv", "Zeit [s];Hammer [N];acc tip y [g]", *noisy, time=time)
    told = imported(
        tmp_path, f"{record} --set channel.acc_tip_y.dof=tool.y --set channel.hammer.dof=tool.y --json"
    ).json
    assert (told["kind"], told["sample_rate"]) == ("impact", 4096.0)
    assert [said.partition(" = ")[0] for said in told["guesses"]] == ["kind"]
    tip = tmp_path / "tip.measurement.toml"
    done = jointlib(f"estimate {tmp_path / 'm.measurement.toml'} -o {tip} --json")
    assert done.status == 0, done
    (found,) = done.json["frfs"]
    assert (found["drive"], found["response"]) == ("tool.y", "tool.y")
    lines = np.loadtxt(next(tmp_path.glob("tip_*.csv")), delimiter=",", skiprows=1)
    assert lines[np.argmax(np.abs(lines[:, 1] + 1j * lines[:, 2]) * (lines[:, 0] > 100)), 0] == pytest.approx(
        180, abs=2
    )


def test_responses_of_a_universal_file_become_records(tmp_path: Path) -> None:
    import pyuff

    for node, way in ((3, 1), (7, -3)):
        data = {
            **UFF58,
            "func_type": 4,
            "ord_data_type": 6,
            "rsp_node": node,
            "rsp_dir": way,
            "ref_node": 3,
            "id1": "frf",
        }
        data |= {"x": 10.0 * np.arange(1, 41), "data": NOISE[0, :40] + 1j * NOISE[1, :40], "abscissa_inc": 10.0}
        data |= {"ordinate_spec_data_type": 8, "orddenom_spec_data_type": 13}
        pyuff.UFF(str(tmp_path / "r.uff")).write_sets([data], "add")
    told = imported(tmp_path, f"{tmp_path / 'r.uff'} --set record.r.force='5 N' --json").json
    assert (told["kind"], told["channels"], told["sample_rate"]) == ("frf", [], None)
    sweeps = [r.sweep for r in read_measurement(tmp_path / "m.measurement.toml").records]
    assert [(s.response_at, s.drive_at, s.response, s.force) for s in sweeps if s is not None] == [
        ("3+X", "3+X", "node3.x", 5.0),
        ("7-Z", "3+X", "node7.z", 5.0),
    ]


def test_a_unit_at_the_end_of_a_heading_is_a_guess_where_the_heading_speaks_of_it(tmp_path: Path) -> None:
    signals = {"t_s": TIME, "disp_in": NOISE[0], "force1_lb": NOISE[1], "vel_in_per_s": NOISE[2], "force_in": NOISE[3]}
    np.savez(tmp_path / "r.npz", **signals)
    told = imported(tmp_path, f"{tmp_path / 'r.npz'} --kind path --json").json
    assert told["sample_rate"] == RATE
    units = {c["column"]: (c["quantity"], c["unit"]) for c in told["channels"]}
    assert units["disp_in"] == ("displacement", "in")
    assert units["force1_lb"] == ("force", "lbf")
    assert units["vel_in_per_s"] == ("velocity", "m/s")
    assert units["force_in"] == ("force", "N")
    assert (
        "channel.disp_in.unit = 'in' is a guess: the heading ends in 'in'; --set channel.disp_in.unit=um"
        in told["guesses"]
    )
    assert any(
        said.startswith("channel.force_in.unit = 'N' is a guess: the file says no unit") for said in told["guesses"]
    )


def test_a_file_that_somebody_changed_is_not_replaced(tmp_path: Path) -> None:
    record = saved(tmp_path / "r.csv", "t [s];z [mm];F [N]", NOISE[0], NOISE[1])
    file = tmp_path / "m.measurement.toml"
    for _ in range(2):
        assert imported(tmp_path, str(record)).status == 0
    file.write_text(file.read_text("utf-8").replace('unit = "mm"', 'unit = "um"'), "utf-8")
    refused(tmp_path, str(record), "was changed since it was imported, expected the name of a new file")
    file.write_text("mine")
    refused(tmp_path, str(record), "exists already, expected the name of a new file")


def test_what_a_sensor_did_not_measure_is_told(tmp_path: Path) -> None:
    gap = NOISE[1].copy()
    gap[7] = np.nan
    record = saved(
        tmp_path / "r.csv", "t [s];z [mm];F [N];a [g];b [g];p [bar]", NOISE[0], NOISE[1], 0 * TIME, gap, NOISE[2]
    )
    told = imported(tmp_path, f"{record} --kind path --json").json
    assert [c["name"] for c in told["channels"]] == ["z", "f", "a"]
    assert told["guesses"] == [
        "column 'b [g]' has no number at sample 7 of r.csv and is left out",
        "column 'p [bar]' is in 'bar', which no channel is read in, and is left out",
        "channel 'a' is zero throughout in r.csv: a sensor that is not connected?",
    ]


def test_times_that_are_late_now_and_then_are_no_gap(tmp_path: Path) -> None:
    """A busy computer stamps every 60th row three steps late; the rows themselves are even."""
    late = TIME + np.where(np.arange(400) % 60 == 30, 1.5e-3, 0.0)
    record = saved(tmp_path / "r.csv", "t [s];z [mm];F [N]", NOISE[0], NOISE[1], time=np.maximum.accumulate(late))
    assert imported(tmp_path, f"{record} --kind path --set sample_rate=2000").status == 0


def test_a_declared_time_with_a_gap_is_refused_when_it_is_read(tmp_path: Path) -> None:
    kept = np.delete(np.arange(4000), [1500, 1501])
    np.savez(tmp_path / "r.npz", t=kept / RATE, z=np.sin(kept / 50), F=np.cos(kept / 50))
    file = tmp_path / "m.measurement.toml"
    file.write_text(
        'schema = "jointlib/measurement/1"\nkind = "path"\nsample_rate = 2000\nrecord = [ { file = "r.npz" } ]\n'
        'channel = [ { name = "z", quantity = "displacement", unit = "mm" }, { name = "F", quantity = "force", '
        'unit = "N" }, { name = "t", quantity = "time", unit = "s" } ]\n'
    )
    m = read_measurement(file)
    with pytest.raises(InputError, match="after sample 1500, where 2 samples are missing"):
        read_records(m, m.records)


def test_a_ringdown_takes_its_modal_mass(tmp_path: Path) -> None:
    record = saved(tmp_path / "r.csv", "t [s];z [mm]", NOISE[0])
    assert imported(tmp_path, f"{record} --kind ringdown --set modal_mass=1.8").status == 0
    carriage = read_measurement(tmp_path / "m.measurement.toml").carriage
    assert carriage is not None
    assert carriage.value == 1.8


def backwards(folder: Path) -> str:
    time = TIME.copy()
    time[200:] -= 0.05
    return str(saved(folder / "r.csv", "t [s];z [mm];F [N]", NOISE[0], NOISE[1], time=time))


def uneven(folder: Path) -> str:
    return str(saved(folder / "r.csv", "t [s];z [mm];F [N]", NOISE[0], NOISE[1], time=TIME**1.01))


def missing_samples(folder: Path) -> str:
    kept = np.delete(np.arange(400), np.arange(160, 170))
    record = saved(folder / "r.csv", "t [s];z [mm];F [N]", *NOISE[:2, kept], time=TIME[kept])
    return f"{record} --kind path --set sample_rate=2000"


def two_rates_in_files(folder: Path) -> str:
    one = saved(folder / "r1.csv", "t [s];z [mm];F [N]", NOISE[0], NOISE[1])
    return f"{one} {saved(folder / 'r2.csv', 't [s];z [mm];F [N]', NOISE[0], NOISE[1], time=2 * TIME)}"


def two_rates_in_a_file(folder: Path) -> str:
    with TdmsWriter(folder / "r.tdms") as writer:
        for name, step in (("z", 1), ("F", 4)):
            writer.write_segment([ChannelObject("g", name, NOISE[0][::step], {"wf_increment": step / RATE})])
    return str(folder / "r.tdms")


def two_rates_above_and_in_the_times(folder: Path) -> str:
    return str(saved(folder / "r.csv", "Abtastrate;5 kHz\nt [s];z [mm];F [N]", NOISE[0], NOISE[1]))


def other_columns(folder: Path) -> str:
    one = saved(folder / "r1.csv", "t [s];z [mm];F [N]", NOISE[0], NOISE[1])
    return f"{one} {saved(folder / 'r2.csv', 't [s];z [mm];Q [N]', NOISE[0], NOISE[1])}"


def no_rate(folder: Path) -> str:
    return f"{saved(folder / 'r.csv', 'a1 [g];a2 [g]', NOISE[0], NOISE[1], time=None)} --kind rig"


def table_of_cuts(folder: Path) -> str:
    (folder / "r.csv").write_text("Drehzahl [1/min];Tiefe [mm];f [Hz]\n6000;4,0;0\n6000;9,0;715,0\n7000;5,0;0\n")
    return f"{folder / 'r.csv'} --kind cuts"


def no_kind(folder: Path) -> str:
    return str(saved(folder / "r.csv", "t [s];T [°C]", NOISE[0]))


def a_gap(folder: Path) -> str:
    force = np.where(np.arange(400) == 7, np.nan, NOISE[0])
    return str(saved(folder / "r.csv", "t [s];F [N];a [m/s²]", force, NOISE[1]))


def a_gap_in_what_is_needed(folder: Path) -> str:
    force = np.where((np.arange(400) >= 7) & (np.arange(400) < 11), np.nan, NOISE[0])
    return str(saved(folder / "r.csv", "t [s];F [N];z [mm]", force, NOISE[1])) + " --kind path"


def no_unit_of_a_channel(folder: Path) -> str:
    return str(saved(folder / "r.csv", "t [s];strain [µm/m];a [m/s²]", NOISE[0], NOISE[1]))


def cut_off(folder: Path) -> str:
    two_rates_in_a_file(folder)
    path = folder / "r.tdms"
    path.write_bytes(path.read_bytes()[:-900])
    return str(path)


def another_format(folder: Path) -> str:
    two_rates_in_a_file(folder)
    (folder / "r.tdms").rename(folder / "r.csv")
    return str(folder / "r.csv")


def fewer_names(folder: Path) -> str:
    return str(saved(folder / "r.csv", "t [s];z [mm]", NOISE[0], NOISE[1]))


def empty_folder(folder: Path) -> str:
    (folder / "none").mkdir()
    return str(folder / "none")


def wrong_setting(folder: Path) -> str:
    return f"{saved(folder / 'r.csv', 't [s];z [mm];F [N]', NOISE[0], NOISE[1])} --set channel.z.unit=kg"


def no_setting(folder: Path) -> str:
    return f"{saved(folder / 'r.csv', 't [s];z [mm];F [N]', NOISE[0], NOISE[1])} --set unit"


BAD: list[tuple[Callable[[Path], str], tuple[str, ...]]] = [
    (backwards, ("the time in column 't [s]' goes backwards at sample 200",)),
    (uneven, ("the time in column 't [s]' is uneven (steps of", "--set sample_rate=… takes them as even")),
    (two_rates_in_files, ("r2.csv: two sample rates, 2000 Hz in r1.csv and 1000 Hz here",)),
    (two_rates_in_a_file, ("r.tdms: two sample rates, 2000 Hz by channel 'z' and 500 Hz by channel 'F'",)),
    (two_rates_above_and_in_the_times, ("two sample rates, 2000 Hz by column 't [s]' and 5000 Hz by line",)),
    (other_columns, ("r2.csv: no column 'F [N]', which r1.csv has",)),
    (no_rate, ("no column of times, no rate in the file, expected --set sample_rate=",)),
    (table_of_cuts, ("no rate in the file", "a table of cuts has headings as speed, depth, verdict")),
    (no_kind, ("t_2 (temperature) makes no measurement alone, expected --kind",)),
    (a_gap, ("a (acceleration) makes no measurement alone, as column 'F [N]' has no number at sample 7 of r.csv",)),
    (
        a_gap_in_what_is_needed,
        ("no force channel, a path", "column 'F [N]' has no number at sample 7 and 3 more of r.csv"),
    ),
    (missing_samples, ("jumps from 0.0795 to 0.085 s after sample 160, where 10 samples are missing", "cut it in two")),
    (no_unit_of_a_channel, ("as column 'strain [µm/m]' is in 'µm/m', which no channel is read in",)),
    (cut_off, ("r.tdms: ends in the middle of its data",)),
    (another_format, ("r.csv: is a TDMS file by its first bytes, expected text",)),
    (fewer_names, ("line 1 has 2 names and the rows below it 3 cells",)),
    (empty_folder, ("none: a folder without records",)),
    (wrong_setting, ("m.measurement.toml: [[channel]] 1 (z): unit: unit 'kg' does not fit, expected one like 'm'",)),
    (no_setting, ("--set: 'unit', expected KEY=VALUE as channel.acc_x.unit=g",)),
]


@pytest.mark.parametrize(("make", "said"), BAD, ids=[make.__name__ for make, _ in BAD])
def test_what_cannot_be_imported_is_answered_in_a_sentence(
    make: Callable[[Path], str], said: tuple[str, ...], tmp_path: Path
) -> None:
    refused(tmp_path, make(tmp_path), *said)


def test_the_file_reads_back_as_toml_with_its_hashes(tmp_path: Path) -> None:
    record = saved(tmp_path / "a b'ü.csv", 't [s];z "x" [mm];F [N]', NOISE[0], NOISE[1])
    done = jointlib(["import", str(record), "-o", str(tmp_path / "sub" / "m.measurement.toml")])
    assert done.status == 0, done
    table = tomllib.loads((tmp_path / "sub" / "m.measurement.toml").read_text("utf-8"))
    assert table["record"] == [{"file": "../a b'ü.csv"}]
    assert table["provenance"]["files"][0]["file"] == "a b'ü.csv"
    measurement = read_measurement(tmp_path / "sub" / "m.measurement.toml")
    assert len(read_records(measurement, measurement.records)[0]) == 400
