"""Cuts as a shop hears them: noise, a fan and the mains are no chatter, nor is run-out; chatter in them is found."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from scipy.io import wavfile

from jointlib import InputError, read_measurement
from jointlib.arrays import Array
from jointlib.cuts.heard import heard, told_by
from jointlib.cuts.judged import JudgedCut, heard_of, judged_cuts
from jointlib.cuts.sound import listen
from jointlib.cuts.steady import listen_to_cut
from machines import inspect

RATE = 8192
SPEEDS = (4210.0, 5530.0, 6870.0, 8090.0)
FAN = 387.3
TIME = np.arange(0, 1.5, 1 / RATE)


def cut(speed: float, teeth: int, **orders: float) -> Array:
    """The forced vibration of a cut, falling with the harmonic, and lines at further orders of the revolution."""
    lines = {k * teeth: 1 / k for k in range(1, 7)} | {float(k[1:]): size for k, size in orders.items()}
    return np.sum(
        [size * np.sin(2 * np.pi * order * speed / 60 * TIME + 0.7 * order) for order, size in lines.items()], axis=0
    )


def chatter(speed: float, teeth: int, frequency: float, size: float) -> Array:
    """Lines a whole number of tooth frequencies from that of chatter."""
    beside = teeth * speed / 60 * np.arange(-2, 3)
    return np.sum(
        [size / (1 + 3 * abs(k)) * np.sin(2 * np.pi * (frequency + f) * TIME + k) for k, f in enumerate(beside, -2)],
        axis=0,
    )


def shop(seed: int, noise: float = 1.0, fan: float = 0.2, mains: float = 0.1) -> Array:
    """Noise, a fan and the mains."""
    rng = np.random.default_rng(seed)
    hum = mains * (np.sin(2 * np.pi * 50.02 * TIME) + np.sin(2 * np.pi * 100.04 * TIME))
    return np.asarray(noise * rng.standard_normal(len(TIME)) + fan * np.sin(2 * np.pi * FAN * TIME + seed) + hum)


def campaign(
    folder: Path, records: Sequence[Array], speeds: Sequence[float] = SPEEDS, teeth: int = 4, more: str = ""
) -> tuple[JudgedCut, ...]:
    """What WAV files of cuts tell, each as loud as its recorder makes it."""
    text = f'schema = "jointlib/measurement/1"\nkind = "cuts"\n{more}[cutting]\nteeth = {teeth}\nmode = "slot"\n'
    text += '[[channel]]\nname = "channel 1"\nquantity = "sound"\n'
    for k, (x, speed) in enumerate(zip(records, speeds, strict=True)):
        wavfile.write(folder / f"{k}.wav", RATE, np.asarray(29000 * x / np.max(np.abs(x)), dtype=np.int16))
        text += f'[[cut]]\nspeed = {speed}\ndepth = "{k + 1} mm"\nfile = "{k}.wav"\n'
    (folder / "cuts.measurement.toml").write_text(text)
    return judged_cuts(read_measurement(folder / "cuts.measurement.toml"))


def test_noise_and_a_fan_are_no_chatter(tmp_path: Path) -> None:
    judged = campaign(tmp_path, [cut(s, 4) + shop(k, fan=0.5) for k, s in enumerate(SPEEDS)])
    assert [one.cut.verdict for one in judged] == ["stable"] * 4
    said = heard_of(judged)
    assert "The line at 387.3 Hz stands in 4 of 4 records, whatever the speed: left out as background." in said
    assert any("of the vibration is noise, which is no chatter" in each for each in said)
    assert set(said) <= set(inspect(tmp_path / "cuts.measurement.toml").lines)


def test_chatter_in_the_same_noise_is_found(tmp_path: Path) -> None:
    sung = (712.0, 731.0, 705.0, 748.0)
    judged = campaign(
        tmp_path,
        [cut(s, 4) + chatter(s, 4, f, 0.7) + shop(k) for k, (s, f) in enumerate(zip(SPEEDS, sung, strict=True))],
    )
    assert [one.cut.verdict for one in judged] == ["chatter"] * 4
    for one, frequency in zip(judged, sung, strict=True):
        assert one.cut.chatter_frequency == pytest.approx(frequency, abs=0.2)


def test_chatter_that_grows_out_of_a_line_of_the_shop_is_found(tmp_path: Path) -> None:
    records = [cut(s, 4) + shop(k) for k, s in enumerate(SPEEDS)]
    records[2] = records[2] + 2 * np.sin(2 * np.pi * FAN * TIME + 2)
    assert [one.cut.verdict for one in campaign(tmp_path, records)] == ["stable", "stable", "chatter", "stable"]


def test_a_record_without_a_cut_tells_what_the_shop_sings(tmp_path: Path) -> None:
    x = cut(SPEEDS[0], 4) + shop(1, noise=0.1, fan=0.8)
    (alone,) = campaign(tmp_path, [x], SPEEDS[:1])
    assert alone.cut.verdict == "chatter"
    np.savez(tmp_path / "quiet.npz", **{"channel 1": 29000 / 32768 / np.max(np.abs(x)) * shop(2, noise=0.1, fan=0.8)})
    file = tmp_path / "cuts.measurement.toml"
    file.write_text(
        file.read_text().replace('kind = "cuts"\n', f'kind = "cuts"\nsample_rate = {RATE}\n')
        + '[[record]]\nfile = "quiet.npz"\nrole = "quiet"\n'
    )
    (told,) = judged_cuts(read_measurement(file))
    assert told.cut.verdict == "stable"
    assert any("387.3 Hz also stands in the record without a cut" in said for said in told.background)
    file.write_text(file.read_text().replace('role = "quiet"', ""))
    with pytest.raises(InputError, match="expected 'quiet'"):
        read_measurement(file)


def test_the_mains_are_left_out_where_they_are_weak_and_not_called_chatter_where_they_are_strong() -> None:
    x = cut(SPEEDS[0], 4) + shop(3, noise=0.05, fan=0)
    weak = heard(x, RATE, SPEEDS[0], 4, "record")
    assert (weak.verdict, weak.chatter_frequency) == ("stable", None)
    assert any("Hz is the mains" in said for said in weak.said)
    strong = heard(x + np.sin(2 * np.pi * 50.02 * TIME), RATE, SPEEDS[0], 4, "record")
    assert strong.verdict == "unknown"
    assert any("a record of the spindle turning without cutting" in said for said in strong.said)


@pytest.mark.parametrize(("noise", "verdict"), [(2.0, "stable"), (5.0, "unknown")])
def test_what_is_nearly_all_noise_is_not_called_stable(noise: float, verdict: str) -> None:
    """Chatter without a period sounds so, below the lines of the teeth and above: a tool that jumps out of the cut."""
    wild = np.convolve(np.random.default_rng(5).standard_normal(len(TIME)), np.exp(-np.arange(60) / 12), "same")
    told = heard(cut(SPEEDS[1], 3) + noise * wild / np.std(wild), RATE, SPEEDS[1], 3, "record")
    assert told.verdict == verdict
    assert ("which is no chatter" in " ".join(told.said)) == (verdict == "stable")


def test_noise_that_shakes_a_mode_is_not_called_chatter_of_one_record() -> None:
    rng, shaken, pole = np.random.default_rng(4), np.zeros(len(TIME)), np.exp((-0.02 + 1j) * 2 * np.pi * 900 / RATE)
    for i, push in enumerate(rng.standard_normal(len(TIME))):
        shaken[i] = push + 2 * pole.real * shaken[i - 1] - abs(pole) ** 2 * shaken[i - 2] if i > 1 else 0.0
    x = cut(SPEEDS[1], 3) + shaken / np.std(shaken) + 0.01 * rng.standard_normal(len(TIME))
    told = heard(x, RATE, SPEEDS[1], 3, "record")
    assert told.verdict in ("unknown", "stable")
    assert told.chatter_frequency is None


@pytest.mark.parametrize("teeth", [3, 4])
def test_run_out_beyond_the_feed_is_no_chatter(teeth: int, tmp_path: Path) -> None:
    orders = {f"o{k}": (2.0 if k == 6 else 0.9) for k in range(1, 12) if k % teeth}
    judged = campaign(tmp_path, [cut(s, teeth, **orders) + shop(k, 0.1) for k, s in enumerate(SPEEDS)], teeth=teeth)
    assert [one.cut.verdict for one in judged] == ["stable"] * 4
    assert ("is run-out" in " ".join(heard_of(judged))) == (teeth == 4)


@pytest.mark.parametrize(
    ("run_out", "size", "verdict"),
    [
        (None, 2.0, "stable"),
        (None, 5.0, "unknown"),
        (1.0, 2.0, "stable"),
        (0.2, 2.0, "unknown"),
        (0.02, 2.0, "chatter"),
        (0.0, 0.2, "stable"),
    ],
)
def test_chatter_that_keeps_step_with_the_revolution_is_not_called_stable(
    run_out: float | None, size: float, verdict: str
) -> None:
    """Fourteen waves a revolution under three teeth, beside what run-out makes elsewhere."""
    sound = listen(cut(6000.0, 3, o14=size, o11=0.5 * size), RATE, 6000.0, 3, "here")
    told = told_by(sound, run_out=run_out)
    assert told.verdict == verdict
    assert ("keeps step" in " ".join(told.said)) == (verdict != "stable")
    assert told.chatter_frequency is None  # the spindle tells it, not the tool


@pytest.mark.parametrize("noise", [0.1, 1.0])
def test_chatter_on_a_harmonic_of_the_revolution_is_told_by_the_other_cuts(noise: float, tmp_path: Path) -> None:
    """Run-out of a twentieth of the teeth's lines in all of them; in noise nobody knows what it is."""
    records = [cut(s, 3, o1=0.05, o7=0.7 * (k == 2)) + shop(k, noise) for k, s in enumerate(SPEEDS)]
    judged = campaign(tmp_path, records, teeth=3)
    assert [one.cut.verdict for one in judged] == ["stable", "stable", "unknown", "stable"]


@pytest.mark.parametrize(("shallower", "verdict"), [(0.2, "stable"), (0.1, "unknown"), (0.0, "chatter")])
def test_a_shallower_cut_at_the_same_speed_tells_run_out(shallower: float, verdict: str, tmp_path: Path) -> None:
    """Lines of run-out grow with the depth as those of the teeth do."""
    speeds, sizes = (SPEEDS[0], *SPEEDS), (shallower, 0.5, 0.2, 0.2, 0.2)
    records = [cut(s, 3, o7=size) + shop(k, 0.01, 0, 0) for k, (s, size) in enumerate(zip(speeds, sizes, strict=True))]
    judged = campaign(tmp_path, records, speeds, teeth=3)
    assert [one.cut.verdict for one in judged] == ["stable", verdict, "stable", "stable", "stable"]


def test_two_teeth_do_not_tell_run_out_from_a_flip_where_the_tool_runs_out(tmp_path: Path) -> None:
    records = [
        cut(s, 2, o3=size) + shop(k, 0.1) for k, (s, size) in enumerate(zip(SPEEDS, (3, 0.3, 0.4, 0.5), strict=True))
    ]
    first, *others = campaign(tmp_path, records, teeth=2)
    assert first.cut.verdict == "unknown"
    assert "run-out or a flip; a shallower cut at this speed would tell" in " ".join(first.remarks())
    assert [one.cut.verdict for one in others] == ["stable"] * 3


def test_a_flip_of_a_tool_that_runs_true_is_found(tmp_path: Path) -> None:
    for teeth in (2, 4):
        sizes = (3.0, 0.0, 0.0, 0.0)
        records = [
            cut(s, teeth, **{f"o{3 * teeth // 2}": size}) + shop(k, 0.1)
            for k, (s, size) in enumerate(zip(SPEEDS, sizes, strict=True))
        ]
        first, *others = campaign(tmp_path, records, teeth=teeth)
        assert first.heard is not None
        assert (first.cut.verdict, first.heard.kind) == ("chatter", "flip")
        assert [one.cut.verdict for one in others] == ["stable"] * 3
    of_three = heard(cut(5000, 3, **{"o7.5": 2.0}) + shop(1, 0.1, 0, 0), RATE, 5000, 3, "record")
    assert (of_three.verdict, of_three.kind) == ("chatter", "flip")


@pytest.mark.parametrize("seconds", [1.5, 12.0])
def test_a_spindle_that_does_not_keep_its_speed_is_no_chatter(seconds: float) -> None:
    t = np.arange(0, seconds, 1 / RATE)
    turned = 92.1 * (t + 0.001 / (2 * np.pi * 0.7) * np.sin(2 * np.pi * 0.7 * t))
    x = np.sum([np.sin(2 * np.pi * 4 * k * turned + k) / k for k in range(1, 8)], axis=0)
    rng = np.random.default_rng(8)
    assert heard(x + 0.05 * rng.standard_normal(len(t)), RATE, 5530, 4, "record").verdict == "stable"
    sung = x + 0.6 * np.sin(2 * np.pi * (709 * t + 0.3 * np.sin(2 * np.pi * t)))
    told = heard(sung + 0.05 * rng.standard_normal(len(t)), RATE, 5530, 4, "record")
    assert (told.verdict, told.kind) == ("chatter", "hopf")


def test_irregular_chatter_is_told_where_other_cuts_are_silent(tmp_path: Path) -> None:
    rng, envelope = np.random.default_rng(5), np.cumsum(np.random.default_rng(6).standard_normal(len(TIME)))
    wild = 2 * np.sin(2 * np.pi * 1400 * TIME + 0.25 * envelope)
    records = [cut(s, 4) + 0.003 * rng.standard_normal(len(TIME)) for s in SPEEDS]
    records[1] = records[1] + wild
    judged = campaign(tmp_path, records)
    assert [one.cut.verdict for one in judged] == ["stable", "chatter", "stable", "stable"]
    assert "is irregular, most of it about 1" in " ".join(heard_of(judged))


def test_a_wav_file_tells_its_rate_and_another_one_is_refused(tmp_path: Path) -> None:
    records = [cut(s, 4) + shop(k, 0.1) for k, s in enumerate(SPEEDS)]
    assert campaign(tmp_path, records)[0].heard == campaign(tmp_path, records, more=f"sample_rate = {RATE}\n")[0].heard
    with pytest.raises(InputError, match="recorded at 8192 Hz, sample_rate says 10000 Hz"):
        campaign(tmp_path, records, more="sample_rate = 10000\n")


def test_silence_before_and_after_a_cut_is_left_out(tmp_path: Path) -> None:
    quiet = 0.002 * np.random.default_rng(1).standard_normal((2, len(TIME) // 2))
    records = [np.concatenate([quiet[0], cut(s, 4) + shop(k, noise=0.1), quiet[1]]) for k, s in enumerate(SPEEDS)]
    judged = campaign(tmp_path, records)
    assert [one.cut.verdict for one in judged] == ["stable"] * 4
    (said,) = [said for said in heard_of(judged) if "at 4210 rpm" in said and "silent but from" in said]
    first, last = (float(word) for word in said.removesuffix(" s, of which it tells").split()[-3::2])
    assert 0.75 < first < 0.85
    assert 2.15 < last <= 2.25


def test_a_spindle_that_runs_up_is_no_chatter() -> None:
    """From six to ten tenths of its speed in the first third of the record; the other way round chatter has begun."""
    ramp = np.minimum(0.6 + 0.4 * TIME / 0.5, 1.0)
    turned = np.cumsum(ramp) / RATE * 6870 / 60
    x = np.sum([np.sin(2 * np.pi * 4 * k * turned) / k for k in range(1, 7)], axis=0)
    found = listen_to_cut(x, RATE, 6870.0, 4, "a")
    assert "the spindle ran up" in found.useless
    assert told_by(found).verdict == "unknown"
    late = cut(6870.0, 4) + np.where(TIME > 0.5, chatter(6870.0, 4, 712.0, 1.0), 0.0)
    found = listen_to_cut(late, RATE, 6870.0, 4, "a")
    assert found.useless == ""
    assert told_by(found).verdict == "chatter"


@pytest.mark.parametrize("off", [-0.05, 0.03, 0.08])
def test_another_speed_than_that_of_the_file_is_told(off: float) -> None:
    found = listen_to_cut(cut(5530.0, 3) + 0.1 * shop(2), RATE, 5530.0 * (1 + off), 3, "a")
    assert "its lines are those of a spindle at 5530 rpm" in found.useless
    assert told_by(found).verdict == "unknown"
    sings = chatter(5530.0, 3, 652.0, 3.0) + 0.2 * cut(5530.0, 3) + 0.1 * shop(2)
    assert listen_to_cut(sings, RATE, 5530.0, 3, "a").useless == ""
