"""What to measure, from the command line: what is written, what is said, what is refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command_line import LIBRARY, Done, examples, jointlib, with_library, wrote
from scipy.io import wavfile

from jointlib import read_joint, read_measurement
from jointlib.laws.hertz_guide import HertzGuide

RIG = LIBRARY / "guide_mill" / "rig.measurement.toml"
GUIDE = LIBRARY / "guide.joint.toml"
THREE = LIBRARY / "three_joints.toml"


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory) -> tuple[Done, Path]:
    """The example of the help, run once."""
    folder = with_library(tmp_path_factory.mktemp("planned") / "here")
    command = examples("plan")[0]
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        done = jointlib(command)
    assert done.status == 0, done.err
    return done, folder / "plan"


@pytest.mark.slow
def test_what_is_said_to_be_written_is_there(planned: tuple[Done, Path]) -> None:
    done, folder = planned
    assert {folder.parent / p for p in wrote(done)} == set(folder.iterdir())
    assert "Decides, simulated: quadratic-damping is named alone." in done.out
    assert "simulating quadratic-damping …" in done.err


@pytest.mark.slow
def test_the_numbers_agree_with_the_files_to_play(planned: tuple[Done, Path]) -> None:
    _, folder = planned
    told = json.loads((folder / "plan.json").read_text())
    test = told["campaign"]
    table = np.loadtxt(folder / "excitation.csv", delimiter=",", skiprows=1)
    assert len(table) == test["period"]
    assert table[1, 0] == pytest.approx(1 / test["sample_rate"], rel=1e-8)
    rms = np.sqrt(np.mean(table[:, 1:] ** 2, axis=0))
    np.testing.assert_allclose(rms, test["force_rms"] * np.array([*test["levels"], 0.8]), rtol=1e-6)
    lines = np.abs(np.fft.rfft(table[:, 1:], axis=0))
    f = np.fft.rfftfreq(test["period"], 1 / test["sample_rate"])
    inside = (f > test["band"][0] - 1) & (f < test["band"][1] + 1)
    np.testing.assert_allclose(lines[inside] / lines[inside][0], 1, rtol=1e-6)
    assert np.max(lines[~inside]) < 1e-6 * np.min(lines[inside])
    rate, played = wavfile.read(folder / "play_fit_1.wav")
    assert rate == test["sample_rate"]
    assert len(played) == (test["settle"] + test["periods"]) * test["period"]
    again = np.tile(table[:, 1], test["settle"] + test["periods"]) / told["wav_full_scale_N"]
    np.testing.assert_allclose(played, again, atol=1e-7)


@pytest.mark.thorough
def test_the_joint_stays_short_of_where_its_rows_lift_off(planned: tuple[Done, Path]) -> None:
    _, folder = planned
    told = json.loads((folder / "plan.json").read_text())
    guide = next(law for law in read_joint(GUIDE).laws if isinstance(law, HertzGuide))
    assert told["campaign"]["amplitude"] == pytest.approx(0.8 * guide.lift_off_displacement)


@pytest.mark.thorough
def test_the_file_to_fill_is_a_measurement_of_this_rig(planned: tuple[Done, Path]) -> None:
    _, folder = planned
    own, given = read_measurement(folder / "measurement.toml"), read_measurement(RIG)
    assert (own.bodies, own.channels, own.driven) == (given.bodies, given.channels, given.driven)
    roles = [r.role for r in own.records]
    assert (roles.count("sealed"), roles.count("quiet")) == (1, 1)
    done = jointlib(["inspect", str(folder / "measurement.toml")])
    assert done.status == 2
    assert f"{len(roles)} of {len(roles)} record files are missing, expected fit_1.csv, fit_2.csv" in done.err


@pytest.mark.slow
def test_the_same_words_give_the_same_bytes(planned: tuple[Done, Path], tmp_path: Path) -> None:
    _, folder = planned
    command = examples("plan")[0]
    other = with_library(tmp_path / "here")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(other)
        done = jointlib(f"{command} --json")
    assert done.complaints == []
    assert {"decides", "undecided", "files"} <= done.json.keys()
    for path in folder.iterdir():
        assert path.read_bytes() == (other / "plan" / path.name).read_bytes(), path.name


@pytest.fixture(scope="module")
def of_machine(tmp_path_factory: pytest.TempPathFactory) -> tuple[Done, Path]:
    """The example for a machine, run once."""
    folder = with_library(tmp_path_factory.mktemp("of_machine") / "here")
    command = examples("plan")[1]
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        done = jointlib(command)
    assert done.status == 0, done.err
    return done, folder / "tip_plan"


@pytest.mark.slow
def test_a_machine_is_told_where_to_push_and_how_hard(of_machine: tuple[Done, Path]) -> None:
    done, folder = of_machine
    assert {folder.parent / p for p in wrote(done)} == set(folder.iterdir())
    assert "bearing:refit is named alone." in done.out
    test = json.loads((folder / "plan.json").read_text())["campaign"]
    assert test["drive"] == "spindle.x"
    assert max(test["forces"]) == 20.0
    m = read_measurement(folder / "measurement.toml")
    assert sorted({r.sweep.force for r in m.records if r.sweep}) == pytest.approx(
        sorted([*test["forces"], test["sealed_force"]]), rel=1e-5
    )
    assert [r.role for r in m.records].count("sealed") == len(test["responses"])
    missing = jointlib(["inspect", str(folder / "measurement.toml")])
    assert missing.status == 2
    assert "4 of 4 record files are missing" in missing.err


@pytest.mark.slow
def test_the_stepped_sine_plays_every_line_when_the_schedule_says(of_machine: tuple[Done, Path]) -> None:
    _, folder = of_machine
    test = json.loads((folder / "plan.json").read_text())["campaign"]
    plays = np.loadtxt(folder / "schedule.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(plays[:, 0], test["frequency"], rtol=1e-8)
    rate, top = wavfile.read(folder / "play_20N.wav")
    assert np.abs(top).max() == pytest.approx(1.0, abs=1e-3)
    assert len(top) / rate == pytest.approx(plays[-1, 1] + plays[-1, 2], abs=1e-6)
    for f, begin, lasts in plays[::30]:
        first = round(begin * rate)
        t = np.arange(round(lasts * rate)) / rate
        wave = np.stack([np.cos(2 * np.pi * f * t), np.sin(2 * np.pi * f * t)])
        piece = top[first : first + len(t)]
        left = piece - np.linalg.lstsq(wave.T, piece)[0] @ wave
        assert np.std(left) < 1e-4


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (f"plan {GUIDE} --effects frictoin -o out", "--effects: unknown effect 'frictoin'"),
        (f"plan {GUIDE} --effects colomb -o out", "did you mean 'coulomb'?"),
        (f"plan {GUIDE} --effects stiffness-drift -o out", "changes along a record, which a plan does not simulate"),
        (f"plan {GUIDE} --noise 0.1 -o out", "--noise: '0.1' has no unit, expected one as 0.02m/s^2"),
        (f"plan {GUIDE} --noise=-0.1N -o out", "expected noise above 0"),
        (f"plan {GUIDE} --noise a9=1N -o out", "--noise: no channel 'a9', expected one of a1, a2, a3, P"),
        (f"plan {GUIDE} --noise a1=1N -o out", "--noise: 'a1=1N', expected a unit like m/s^2"),
        (f"plan {GUIDE} --noise 0dB -o out", "expected decibels below the signal above 0"),
        (f"plan {GUIDE} --effects gain delay frictoin -o out", "--effects: unknown effect 'frictoin'"),
        (f"plan --noise a1=0.1m/s^2 P=5m -o out {GUIDE}", "--noise: 'P=5m', expected a unit like N"),
        (f"plan {GUIDE} --size 200% -o out", "--size: '200%', expected 0.01% to 30%"),
        (f"plan {GUIDE} --rate 8kHz -o out", "expected six times as many samples"),
        (f"plan {GUIDE} --rig {GUIDE} -o out", 'expected "jointlib/measurement/1"'),
        (f"plan {GUIDE} --rig {LIBRARY}/guide_mill/static.measurement.toml -o out", "kind is 'static', expected a rig"),
        (f"plan {RIG} -o out", "a measurement, expected a joint or a machine"),
        (f"plan {LIBRARY}/mount.joint.toml -o out", "neither a validity nor a preload says how far it may be moved"),
        (
            f"plan {LIBRARY}/lathe.toml -o out",
            "joints are in question, expected at most 40: ask for those of some joints",
        ),
        ("plan drive.joint.toml -o out", "it has no stiffness at rest, expected one that holds a rig together"),
        ("plan nothing.toml -o out", "nothing.toml: no such file"),
        (f"plan {GUIDE} --force 5N -o out", "--force: given with a joint, expected with a machine alone"),
        (f"plan {THREE} --rig {RIG} -o out", "--rig: given with a machine, expected with a joint alone"),
        (f"plan {THREE} --effects quadratic -o out", "unknown effect 'quadratic' of a machine's joint"),
        (f"plan {THREE} --effects giude:coulomb -o out", "no joint 'giude', did you mean 'guide'?"),
        (f"plan {THREE} --noise 1N -o out", "--noise: '1N', expected a unit like m/N, or dB"),
    ],
)
def test_what_cannot_be_planned_is_refused_in_a_sentence(words: str, said: str, here: Path) -> None:
    drive = 'schema = "jointlib/joint/1"\nname = "drive"\n[[law]]\nkind = "viscous"\ndamping = 100\n'
    (here / "drive.joint.toml").write_text(drive)
    done = jointlib(words)
    assert (done.status, done.out) == (2, "")
    assert said in done.err
    assert len(done.err.strip().splitlines()) == 1
    assert not (here / "out").exists()


def test_a_folder_with_something_in_it_is_left_alone(here: Path) -> None:
    (here / "out").mkdir()
    (here / "out" / "mine.txt").write_text("kept")
    done = jointlib(f"plan {GUIDE} -o out")
    assert done.status == 2
    assert "the folder is not empty, expected a new one" in done.err
    assert [p.name for p in (here / "out").iterdir()] == ["mine.txt"]
