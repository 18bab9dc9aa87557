"""Corrections: a fault put into simulated records by formula is undone on reading, and survives being written."""

from __future__ import annotations

import hashlib
import json
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from jointlib.cli.main import cli
from jointlib.corrections import faults, joined
from jointlib.errors import InputError
from jointlib.identification.force_samples import restoring_force
from jointlib.io.joint_file import write_joint
from jointlib.io.measurement_file import read_measurement, read_records
from jointlib.io.measurement_write import write_measurement
from jointlib.joint import Joint
from jointlib.laws.linear import Linear
from jointlib.loop.answer.report import TraceReport, Verdict
from jointlib.loop.close import write_trace
from jointlib.measurement import Correction, Measurement
from jointlib.modulation import Modulation
from jointlib.parameter import Role

Signal = NDArray[np.float64]
Channels = dict[str, Signal]

RATE, PERIOD, SETTLE, PERIODS = 10240.0, 1024, 1, 3
TIME = np.arange((SETTLE + PERIODS) * PERIOD + 100) / RATE
STEADY = slice(SETTLE * PERIOD, (SETTLE + PERIODS) * PERIOD)
LINES = 2 * np.pi * RATE / PERIOD * np.arange(20, 120)
MASSES = {"a1": 0.9, "a2": 1.1, "a3": 1.3}


def waves(seed: int, time: Signal = TIME, gain: NDArray[np.complex128] | float = 1.0) -> Signal:
    """A multisine at any instants, each line through a gain."""
    phase = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(LINES))
    return np.asarray(np.real(gain * np.exp(1j * (np.outer(time, LINES) + phase))) @ np.ones(len(LINES)))


A1, A2 = waves(1), waves(2)
TRUE: Channels = {"a1": A1, "a2": A2, "a3": A2, "P": 0.9 * A1 + 2.4 * A2}


def late(tau: float) -> Signal:
    return waves(2, TIME - tau)


def rocking() -> Signal:
    """Response of a mode of 520 Hz and 2 % damping to P, line by line."""
    w, zeta = 2 * np.pi * 520.0, 0.02
    H = -(LINES**2) / (w**2 - LINES**2 + 2j * zeta * w * LINES)
    return 0.9 * waves(1, gain=H) + 2.4 * waves(2, gain=H)


HUM = 3 * np.cos(2 * np.pi * 50.2 * TIME) - 2 * np.sin(2 * np.pi * 50.2 * TIME) + np.sin(6 * np.pi * 50.2 * TIME)
FAULTS: dict[str, tuple[str, Channels]] = {
    "gain": ('channel = "a2"\ngain = 0.05', {"a2": 1.05 * A2}),
    "delay": ('channel = "a2"\ndelay = "13.7 us"', {"a2": late(13.7e-6)}),
    "offset": ('channel = "P"\noffset = "4e-3 kN"', {"P": TRUE["P"] + 4}),
    "drift": (
        'channel = "a1"\noffset = 2.0\nslope = "3 m/s^3"\ncurvature = "5 mm/s^4"',
        {"a1": A1 + 2 + 3 * TIME + 5e-3 * TIME**2},
    ),
    "hum": (
        'channel = "P"\nfrequency = "50.2 Hz"\ncosine = 3\nsine = -2\ncosine3 = 0\nsine3 = 1',
        {"P": TRUE["P"] + HUM},
    ),
    "clipping": ('channel = "a2"\nlevel = "20 m/s^2"', {"a2": np.clip(A2, -20, 20)}),
    "sensor-nonlinearity": (
        'channel = "a1"\nquadratic = "1e-3 s^2/m"\ncubic = 1e-5',
        {"a1": A1 + 1e-3 * A1**2 + 1e-5 * A1**3},
    ),
    "rocking-mode": (
        'frequency = "0.52 kHz"\ndamping_ratio = "2 %"\non_a2 = 0.1\non_a3 = "-0.2 1/kg"',
        {"a2": A2 + 0.1 * rocking(), "a3": A2 - 0.2 * rocking()},
    ),
}

RIG = """schema = "jointlib/measurement/1"
kind = "rig"
simulated = true
sample_rate = "10.24 kHz"
period = 1024
settle = 1
driven = "runner"
[bodies]
runner = 0.9
rail = 1.1
block = 1.3
[[channel]]
name = "a1"
quantity = "acceleration"
body = "runner"
[[channel]]
name = "a2"
quantity = "acceleration"
body = "rail"
[[channel]]
name = "a3"
quantity = "acceleration"
body = "block"
[[channel]]
name = "P"
quantity = "force"
[[record]]
file = "r1.npz"
[[record]]
file = "r2.npz"
role = "sealed"
"""
PATH = """schema = "jointlib/measurement/1"
kind = "path"
sample_rate = "10.24 kHz"
[[channel]]
name = "z"
quantity = "displacement"
[[channel]]
name = "F"
quantity = "force"
[[record]]
file = "p.npz"
start = "2 s"
"""


def rig(folder: Path, corrections: str = "", changed: Mapping[str, Signal] | None = None) -> Path:
    """A rig measurement whose two records hold the true channels but for those that are changed."""
    for name in ("r1.npz", "r2.npz"):
        np.savez(folder / name, **(TRUE | dict(changed or {})))
    path = folder / "rig.measurement.toml"
    path.write_text(RIG + corrections)
    return path


def correction(family: str, rest: str) -> str:
    return f'[[correction]]\nfamily = "{family}"\n{rest}\n'


def first(m: Measurement) -> Mapping[str, Signal]:
    return read_records(m, m.records[:1])[0].channels


@pytest.mark.parametrize("family", FAULTS)
def test_a_fault_in_a_record_is_undone_on_reading(family: str, tmp_path: Path) -> None:
    said, changed = FAULTS[family]
    found = first(read_measurement(rig(tmp_path, correction(family, said), changed)))
    for name, true in TRUE.items():
        error = np.max(np.abs(found[name] - true)[STEADY])
        before = np.max(np.abs({**TRUE, **changed}[name] - true)[STEADY])
        # Undoing a gain, a shift or a curve is exact up to rounding.
        assert error < 1e-9 * np.max(np.abs(true)), name
        assert before > 1e-3 * np.max(np.abs(true)) or name not in changed
        assert len(found[name]) == len(TIME)


def test_every_family_that_can_be_corrected_is_tried_here() -> None:
    assert set(faults("rig")) == {*FAULTS, "missing-mass", "suspension"}


def test_the_run_in_is_shifted_apart_so_that_the_steady_part_stays_exact(tmp_path: Path) -> None:
    rough = late(30e-6)
    rough[: PERIOD - 5] = 500.0
    found = first(read_measurement(rig(tmp_path, correction("delay", 'channel = "a2"\ndelay = 30e-6'), {"a2": rough})))
    np.testing.assert_allclose(found["a2"][STEADY], A2[STEADY], atol=1e-9 * np.max(A2))


def test_corrections_are_undone_in_the_order_of_the_file(tmp_path: Path) -> None:
    gain, offset = correction("gain", 'channel = "P"\ngain = 0.25'), correction("offset", 'channel = "P"\noffset = 10')
    x = TRUE["P"]
    np.testing.assert_allclose(first(read_measurement(rig(tmp_path, gain + offset)))["P"], x / 1.25 - 10, atol=1e-12)
    np.testing.assert_allclose(first(read_measurement(rig(tmp_path, offset + gain)))["P"], (x - 10) / 1.25, atol=1e-12)


def test_a_correction_of_one_record_leaves_the_others(tmp_path: Path) -> None:
    m = read_measurement(rig(tmp_path, correction("offset", 'channel = "P"\noffset = 10\nrecord = "r2.npz"')))
    one, two = read_records(m, m.records)
    np.testing.assert_array_equal(one.channels["P"], TRUE["P"])
    np.testing.assert_array_equal(two.channels["P"], TRUE["P"] - 10)


def test_a_missing_mass_weighs_once_in_the_joint_force(tmp_path: Path) -> None:
    plain = read_measurement(rig(tmp_path))
    force = restoring_force(plain, read_records(plain, plain.records[:1])[0]).f
    mended = read_measurement(rig(tmp_path, correction("missing-mass", 'body = "rail"\nmass = "240 g"')))
    assert mended.bodies["rail"].value == pytest.approx(1.34)
    heavier = restoring_force(mended, read_records(mended, mended.records[:1])[0]).f
    np.testing.assert_allclose(heavier, 1.1 * force, rtol=1e-9, atol=1e-9 * np.max(np.abs(force)))


def on_path(folder: Path, corrections: str, force: Signal) -> Signal:
    np.savez(folder / "p.npz", z=np.sin(3 * TIME), F=force)
    (folder / "path.toml").write_text(PATH + corrections)
    return np.asarray(first(read_measurement(folder / "path.toml"))["F"])


@pytest.mark.parametrize(
    ("family", "said", "fault"),
    [
        ("gain", 'channel = "F"\ngain = -0.2', lambda F: 0.8 * F),
        ("offset", 'channel = "F"\noffset = 7', lambda F: F + 7),
        ("drift", 'channel = "F"\nslope = 7\ncurvature = -2', lambda F: F + 7 * (2 + TIME) - 2 * (2 + TIME) ** 2),
        (
            "position-stiffness",
            'channel = "F"\nwavelength = "300 mm"\ncosine = 7\nsine = 1',
            lambda F: F + np.array([7, 1]) @ [f(2 * np.pi * np.sin(3 * TIME) / 0.3) for f in (np.cos, np.sin)],
        ),
    ],
)
def test_a_force_along_a_path_is_corrected(
    family: str, said: str, fault: Callable[[Signal], Signal], tmp_path: Path
) -> None:
    true = 50 * np.cos(3 * TIME)
    np.testing.assert_allclose(on_path(tmp_path, correction(family, said), fault(true)), true, atol=1e-10)


def test_a_lag_of_a_force_is_undone_away_from_the_ends(tmp_path: Path) -> None:
    found = on_path(tmp_path, correction("lag", 'channel = "F"\nlag = "130 us"'), waves(2, TIME - 130e-6))
    # What a shift does at the ends of a record dies out as one over the distance.
    inner = slice(1500, -1500)
    assert np.max(np.abs(found - A2)[inner]) < 2e-3 * np.max(np.abs(A2))


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        ('family = "gian"\nchannel = "a2"\ngain = 1', "family is 'gian', did you mean 'gain'?"),
        ('family = "cubic"\nchannel = "a2"', "family is 'cubic', expected one of clipping"),
        ('family = "lag"\nchannel = "P"\nlag = 1e-3', "family is 'lag', did you mean 'delay'?"),
        ('family = "gain"\nchannel = "a4"\ngain = 1', "channel is 'a4', did you mean 'a3'?"),
        ('family = "gain"\ngain = 1', "channel is missing, expected the channel that has the gain"),
        ('family = "gain"\nchannel = "a2"', "key 'gain' is missing"),
        ('family = "gain"\nchannel = "a2"\nbody = "rail"\ngain = 1', "unknown key 'body'"),
        ('family = "gain"\nchannel = "a2"\ngain = 1\nphase = 2', "unknown key 'phase', did you mean 'channel'?"),
        ('family = "gain"\nchannel = "a2"\ngain = "1 s"', "gain: unit 's' does not fit"),
        (
            'family = "gain"\nchannel = "a2"\ngain = -1',
            "undoing the [[correction]] gain of a2 leaves no finite numbers",
        ),
        ('family = "delay"\nchannel = "a2"\ndelay = "1 mm"', "delay: unit 'mm' does not fit, expected one like 's'"),
        ('family = "offset"\nchannel = "a2"\noffset = "1 N"', "unit 'N' does not fit, expected one like 'm/s^2'"),
        ('family = "missing-mass"\nbody = "rial"\nmass = 1', "body is 'rial', did you mean 'rail'?"),
        ('family = "missing-mass"\nbody = "rail"\nmass = -2', "'rail' of 1.1 kg and -2 kg more"),
        ('family = "gain"\nchannel = "a2"\ngain = 1\nrecord = "r3.npz"', "names record 'r3.npz', did you mean 'r"),
        (
            'family = "sensor-nonlinearity"\nchannel = "a2"\nquadratic = 1\ncubic = 0',
            "r1.npz: correction sensor-nonlin",
        ),
    ],
)
def test_a_wrong_correction_gets_one_sentence(said: str, expected: str, tmp_path: Path) -> None:
    path = rig(tmp_path, f"[[correction]]\n{said}\n")
    with pytest.raises(InputError) as refusal:
        first(read_measurement(path))
    assert expected in str(refusal.value)
    assert str(refusal.value).startswith(str(path))
    assert "\n" not in str(refusal.value)


def test_what_acts_in_time_needs_a_sample_rate(tmp_path: Path) -> None:
    np.savez(tmp_path / "s.npz", z=TIME, F=TIME)
    text = PATH.replace('"path"', '"static"').replace('sample_rate = "10.24 kHz"', "").replace("p.npz", "s.npz")
    text = text.replace('start = "2 s"\n', "")
    (tmp_path / "s.toml").write_text(text + correction("delay", 'channel = "F"\ndelay = 1e-3'))
    with pytest.raises(InputError, match="delay acts in time, expected a sample_rate"):
        read_measurement(tmp_path / "s.toml")


AWKWARD = 1.0 / 3e5
FOUND = (
    Correction("gain", "a2", None, {"gain": 0.1 + 1e-17 + AWKWARD}),
    Correction("missing-mass", None, "block", {"mass": AWKWARD}),
    Correction("hum", "P", None, dict.fromkeys(("frequency", "cosine", "sine", "cosine3", "sine3"), AWKWARD), "r1.npz"),
)


def test_a_mended_file_reads_back_bit_for_bit_from_another_folder(tmp_path: Path) -> None:
    source = rig(tmp_path)
    path = tmp_path / "deep" / "out" / "measurement.toml"
    write_measurement(path, read_measurement(source), FOUND)
    found = read_measurement(path)
    assert found.corrections == FOUND
    assert found.bodies["block"].value == 1.3 + AWKWARD
    assert found.channels == read_measurement(source).channels
    assert [r.role for r in found.records] == ["fit", "sealed"]
    table = tomllib.loads(path.read_text())
    assert [r["file"] for r in table["record"]] == ["../../r1.npz", "../../r2.npz"]
    hashes = {row["file"]: row["sha256"] for row in table["provenance"]["files"]}
    assert hashes["rig.measurement.toml"] == hashlib.sha256(source.read_bytes()).hexdigest()
    assert hashes["r2.npz"] == hashlib.sha256((tmp_path / "r2.npz").read_bytes()).hexdigest()
    one, two = read_records(found, found.records)
    np.testing.assert_allclose(one.channels["a2"], A2 / (1 + FOUND[0].parameters["gain"]), rtol=1e-15)
    assert np.any(one.channels["P"] != two.channels["P"])


def test_a_chain_of_traces_does_not_pile_up_one_correction(tmp_path: Path) -> None:
    path = rig(tmp_path)
    for number in range(3):
        write_measurement(
            tmp_path / f"{number}.toml", read_measurement(path), [Correction("gain", "a2", None, {"gain": 0.1})]
        )
        path = tmp_path / f"{number}.toml"
    (last,) = read_measurement(path).corrections
    assert last.parameters["gain"] == pytest.approx(1.1**3 - 1, rel=1e-14)
    np.testing.assert_allclose(first(read_measurement(path))["a2"], A2 / 1.1**3, rtol=1e-13)


def gain(value: float, channel: str = "a2", record: str | None = None) -> Correction:
    return Correction("gain", channel, None, {"gain": value}, record)


def offset(value: float) -> Correction:
    return Correction("offset", "a2", None, {"offset": value})


def hum(frequency: float) -> Correction:
    names = ("frequency", "cosine", "sine", "cosine3", "sine3")
    return Correction("hum", "P", None, dict(zip(names, (frequency, 1.0, 2.0, 3.0, 4.0), strict=True)), "r1.npz")


@pytest.mark.parametrize(
    ("known", "further", "count"),
    [
        ((gain(0.1),), (gain(0.2),), 1),
        ((gain(0.1), gain(0.1, "P")), (gain(0.2),), 2),
        ((gain(0.1), offset(3.0)), (gain(0.2),), 3),
        ((offset(3.0), gain(0.1)), (gain(0.2),), 2),
        ((gain(0.1),), (gain(0.2, record="r1.npz"),), 2),
        ((hum(50.0),), (hum(50.0),), 1),
        ((hum(50.0),), (hum(50.1),), 2),
        ((gain(0.1), hum(50.0)), (gain(0.3), hum(50.0)), 2),
    ],
)
def test_joined_corrections_undo_what_they_undo_one_by_one(
    known: tuple[Correction, ...], further: tuple[Correction, ...], count: int, tmp_path: Path
) -> None:
    source = read_measurement(rig(tmp_path))
    together = joined("rig", known, further)
    assert len(together) == count
    found = [first(Measurement(**{**vars(source), "corrections": c})) for c in (together, (*known, *further))]
    for name in TRUE:
        np.testing.assert_allclose(found[0][name], found[1][name], rtol=1e-12, atol=1e-12)


def ripple(cosine: float) -> Correction:
    return Correction("position-stiffness", "F", None, {"wavelength": 0.3, "cosine": cosine, "sine": -1.0})


def lag(seconds: float) -> Correction:
    return Correction("lag", "F", None, {"lag": seconds})


def sag(slope: float) -> Correction:
    return Correction("drift", "F", None, {"slope": slope, "curvature": 2.0})


@pytest.mark.parametrize(
    ("known", "further", "count"),
    [
        ((lag(1e-4),), (lag(3e-4),), 1),
        ((sag(3.0),), (sag(4.0),), 1),
        ((ripple(3.0),), (ripple(4.0),), 1),
        ((ripple(3.0), gain(0.1, "z")), (ripple(4.0),), 3),
        ((gain(0.1, "z"), ripple(3.0)), (gain(0.2, "z"),), 3),
        ((gain(0.1, "z"), ripple(3.0)), (ripple(4.0),), 2),
        ((lag(1e-4), ripple(3.0)), (lag(3e-4),), 3),
    ],
)
def test_joined_corrections_of_a_path_undo_what_they_undo_one_by_one(
    known: tuple[Correction, ...], further: tuple[Correction, ...], count: int, tmp_path: Path
) -> None:
    """A ripple is undone at the position as it stands then: it does not change places with a gain of that."""
    force = np.asarray(50 * np.exp(-(((TIME - TIME.mean()) / 0.02) ** 2)))
    on_path(tmp_path, "", force)
    source = read_measurement(tmp_path / "path.toml")
    together = joined("path", known, further)
    assert len(together) == count
    found = [first(Measurement(**{**vars(source), "corrections": c})) for c in (together, (*known, *further))]
    for name in ("z", "F"):
        np.testing.assert_allclose(found[0][name], found[1][name], rtol=1e-9, atol=1e-9)


def test_a_declaration_written_by_hand_is_never_replaced(tmp_path: Path) -> None:
    path = rig(tmp_path)
    before = path.read_bytes()
    with pytest.raises(InputError, match="would be replaced by its mended self, expected another output folder"):
        write_measurement(path, read_measurement(path), FOUND)
    assert path.read_bytes() == before
    mended = tmp_path / "measurement.toml"
    write_measurement(mended, read_measurement(path), FOUND[:1])
    write_measurement(mended, read_measurement(mended), FOUND[1:])
    assert read_measurement(mended).corrections == FOUND


def report(measurement: Measurement, corrections: tuple[Correction, ...]) -> TraceReport:
    """A report that holds nothing but what is written beside it."""
    joint = Joint((Linear(6e8),))
    tables = [
        "error_before",
        "error_after",
        "data",
        "noise_floor",
        "localisation",
        "reduction",
        "resimulation",
        "unexplained",
        "repro",
    ]
    lists = ("candidates", "rivals", "chain", "secondary", "not_decidable", "warnings")
    empty: dict[str, object] = {**{name: {} for name in tables}, **dict.fromkeys(lists, ())}
    return TraceReport(
        route="periodic",
        verdict=Verdict.IDENTIFIED,
        sentence="",
        baseline=joint,
        mended=joint,
        chosen=None,
        next_experiment="",
        corrections=corrections,
        measurement=measurement,
        **empty,  # type: ignore[arg-type]
    )


def test_a_trace_writes_a_mended_measurement_only_where_faults_are_named(tmp_path: Path) -> None:
    source = read_measurement(rig(tmp_path))
    out = tmp_path / "out"
    none = write_trace(report(source, ()), out)
    assert [p.name for p in none] == ["trace.json", "joint.toml", "trace.npz"]
    assert not (out / "measurement.toml").exists()
    written = write_trace(report(source, FOUND), out)
    assert out / "measurement.toml" in written
    assert read_measurement(out / "measurement.toml").corrections == FOUND
    said = json.loads((out / "trace.json").read_text())["corrections"]
    assert [(c["family"], c["channel"] or c["body"], c["record"]) for c in said] == [
        ("gain", "a2", None),
        ("missing-mass", "block", None),
        ("hum", "P", "r1.npz"),
    ]
    assert said[1]["parameters"] == {"mass": AWKWARD}
    # A trace of the mended file into the same folder that finds nothing more leaves it as it is.
    before = (out / "measurement.toml").read_bytes()
    write_trace(report(read_measurement(out / "measurement.toml"), ()), out)
    assert (out / "measurement.toml").read_bytes() == before


def test_nothing_is_written_where_the_declaration_itself_would_be_replaced(tmp_path: Path) -> None:
    own = rig(tmp_path).rename(tmp_path / "measurement.toml")
    before = own.read_bytes()
    with pytest.raises(InputError, match="expected another output folder"):
        write_trace(report(read_measurement(own), FOUND), tmp_path)
    assert own.read_bytes() == before
    assert not (tmp_path / "trace.json").exists()


def test_inspect_says_corrections_and_modulations_in_words(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_measurement(tmp_path / "m.toml", read_measurement(rig(tmp_path)), [gain(0.25), hum(50.0)])
    warm = Modulation(Role.STIFFNESS, "temperature", 293.0, ((293.0, 1.0), (313.0, 0.9)))
    write_joint(tmp_path / "j.toml", Joint((Linear(6e8),), modulations=(warm,)))
    for name in ("m.toml", "j.toml"):
        cli.main(["inspect", str(tmp_path / name)], standalone_mode=False)
    said = capsys.readouterr().out.splitlines()
    assert "corrected on reading: gain of a2, gain = 0.25 in SI" in said
    assert any(line.startswith("corrected on reading: hum of P in r1.npz, frequency = 50,") for line in said)
    assert "stiffness depends on temperature: factor 0.9 to 1, 1 at 293 K" in said
