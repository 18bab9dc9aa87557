"""Tables of test cuts as shops keep them become the cuts that stand in them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.io import wavfile

from jointlib import read_measurement
from jointlib.answers.import_records import brought_to
from jointlib.cuts.judged import judged_cuts
from jointlib.cuts.tried_cut import TriedCut
from jointlib.errors import InputError

CUTS = (
    (4200, 5.9e-3, "stable", None),
    (4200, 8.6e-3, "chatter", 1624.0),
    (5300, 3.5e-3, "marginal", 671.5),
    (12000, 6e-3, "stable", None),
)


def imported(folder: Path, text: str, *said: str, encoding: str = "utf-8") -> tuple[tuple[TriedCut, ...], list[str]]:
    (folder / "shop.csv").write_text(text, encoding)
    target = folder / "cuts.measurement.toml"
    found = brought_to(folder / "shop.csv", target, None, list(said))
    return read_measurement(target).cuts, found.draft.guesses


def german() -> str:
    words = {"stable": "i.O.", "chatter": "Rattern", "marginal": "leichtes Rattern"}
    head = "Fräser 12 mm;;;;;;\nVersuch;Drehzahl n [1/min];Zustellung ap [mm];ae [mm];Vorschub fz [mm/Zahn];Urteil;"
    rows = [
        f"{i};{n};{1e3 * b:.1f};3,0;0,06;{words[v]};{f or ''}".replace(".", ",").replace("i,O,", "i.O.")
        for i, (n, b, v, f) in enumerate(CUTS, 1)
    ]
    return "\n".join([head + "Ratterfrequenz [Hz]", *rows])


def french() -> str:
    words = {"stable": "stable", "chatter": "broutement", "marginal": "limite"}
    head = "Essai\tVitesse de broche (tr/min)\tProfondeur de passe ap (mm)\tEngagement radial ae (mm)\tVf (mm/min)\t"
    rows = [
        f"{i}\t{n}\t{1e3 * b:.1f}\t3\t{0.06 * 4 * n:.1f}\t{words[v]}\t{f or '-'}\tavalant".replace(".", ",")
        for i, (n, b, v, f) in enumerate(CUTS, 1)
    ]
    return "\n".join([head + "État\tFréquence de broutement (Hz)\tSens", *rows])


def american() -> str:
    words = {"stable": "no", "chatter": "yes", "marginal": "slight"}
    rows = [
        f'{i},"{n:,}",{b / 0.0254:.6f},25,{0.06 / 25.4:.9f},{words[v]},{f or ""}'
        for i, (n, b, v, f) in enumerate(CUTS, 1)
    ]
    return "\n".join(["Cut #,RPM,DOC (in),Radial immersion (%),IPT,Chatter?,Chatter freq (Hz)", *rows])


@pytest.mark.parametrize("dialect", [german, french, american])
def test_the_table_of_a_shop_holds_the_same_cuts_in_any_dialect(tmp_path: Path, dialect: object) -> None:
    assert callable(dialect)
    encoding = "latin-1" if dialect is german else "utf-8-sig"
    said = ("cutting.teeth=4", "cutting.mode=down", "cutting.diameter=12 mm", "simulated=true")
    cuts, _ = imported(tmp_path, dialect(), *said, encoding=encoding)
    assert [(c.speed, c.verdict, c.chatter_frequency, c.teeth, c.mode) for c in cuts] == [
        (n, v, f, 4, "down") for n, _, v, f in CUTS
    ]
    for cut, (_, depth, _, _) in zip(cuts, CUTS, strict=True):
        assert cut.depth == pytest.approx(depth, rel=1e-4)
        assert cut.immersion == pytest.approx(0.25)
        assert cut.feed == pytest.approx(0.06e-3, rel=1e-5)


def test_what_a_row_does_not_say_is_told(tmp_path: Path) -> None:
    text = (
        "sep=;\nSchnitt;n;b;f;rattert?;Frequenz;Wetter\n;1/min;mm;mm/U;;Hz;\n1;1.200;0,50;0,1;nein;300;schön\n"
        "2;1.200;1,00;0,1;ja;412;\n3;2.000;;0,1;ja;;\n4;2.000;0,80;0,1;;;\n5;600;2,00;0,1;vielleicht;;\n"
    )
    said = ("cutting.process=turning", "verdict.vielleicht=marginal")
    cuts, guesses = imported(tmp_path, text, *said)
    assert [(c.speed, c.depth, c.verdict, c.chatter_frequency) for c in cuts] == [
        (1200, 0.5e-3, "stable", None),
        (1200, 1e-3, "chatter", 412.0),
        (2000, 0.8e-3, "unknown", None),
        (600, 2e-3, "marginal", None),
    ]
    assert sorted(guesses) == [
        "columns left out: Wetter",
        "line 4: 300 Hz of a cut that is stable is left out",
        "line 6 without speed or depth: left out",
        "line 7 without a verdict: unknown, which tells nothing",
    ]


@pytest.mark.parametrize(
    ("text", "said", "told"),
    [
        ("n,ap,verdict\n1000,2,perhaps\n", ("cutting.teeth=2",), "'perhaps', expected stable .* --set verdict.perhaps"),
        ("n;ap;verdict\n1.000;2;ok\n", ("cutting.teeth=2",), r"'1.000', which is 1 .* or 1000 .* --set text.decimal"),
        ("n,ap,verdict\n1000,2,ok\n", (), "no column of teeth, expected --set cutting.teeth=4"),
        ("n,ap,ae,verdict\n1000,2,3,ok\n", ("cutting.teeth=2",), "'ae' is a width, expected the diameter"),
        ("n,ap [furlong],verdict,tool\n1000,2,ok,A\n9,2,ok,B\n", ("cutting.teeth=2",), "cuts of 2 tools"),
        ("n,ap,verdict\n1000,deep,ok\n", ("cutting.teeth=2",), "line 2: 'ap' is 'deep', expected a number"),
        ("n,ap,mode,verdict\n1000,2,sideways,ok\n", ("cutting.teeth=2",), "'sideways', expected down"),
        ("n,ap,file\n1000,2,none.wav\n", ("cutting.teeth=2",), "names the record .*none.wav, which does not exist"),
        ("n,ap,verdict\n", ("cutting.teeth=2",), "no row below the headings"),
        ("n,ap,verdict\n1000;2;ok\n", ("cutting.teeth=2",), "'n' is '1000;2;ok', expected a number"),
        ("n,ap,verdict,teeth\n1000,2,ok,2.5\n", (), "teeth is 2.5"),
        ("n,ap,verdict\n1000,2,ok\n", ("cutting.teeth=2", "cutting.tool=A"), "no column of tools"),
        ("speed (sfm),ap,verdict\n1000,2,ok\n", ("cutting.teeth=2",), "expected a spindle speed in rpm"),
        ("n,ap [furlong],verdict\n1000,2,ok\n", ("cutting.teeth=0",), "teeth is 0"),
    ],
)  # fmt: skip
def test_what_cannot_be_read_is_told_in_a_sentence(tmp_path: Path, text: str, said: tuple[str, ...], told: str) -> None:
    with pytest.raises(InputError, match=told):
        imported(tmp_path, text, *said)


def test_another_tool_of_the_table_is_left_alone(tmp_path: Path) -> None:
    text = "Tool,RPM,DOC (mm),Result\nEM12,9000,2,OK\nFM50,1500,1,OK\nEM12,9000,4,chatter\n"
    cuts, _ = imported(tmp_path, text, "cutting.teeth=2", "cutting.tool=EM12")
    assert [(cut.speed, cut.verdict) for cut in cuts] == [(9000, "stable"), (9000, "chatter")]


def test_a_frequency_on_a_harmonic_of_the_teeth_is_left_out_and_its_verdict_kept(tmp_path: Path) -> None:
    cuts, guesses = imported(tmp_path, "RPM,DOC (mm),Result,f [Hz]\n6000,2,chatter,800\n", "cutting.teeth=4")
    assert (cuts[0].verdict, cuts[0].chatter_frequency) == ("chatter", None)
    assert guesses == ["line 2: 800 Hz is harmonic 2 of the teeth, at which a stable cut vibrates too, and is left out"]


def test_records_that_a_table_names_tell_the_verdicts_that_it_lacks(tmp_path: Path) -> None:
    rate, t = 12800, np.arange(3 * 12800) / 12800
    noise = np.random.default_rng(1).normal(size=(2, len(t)))
    teeth = np.cos(2 * np.pi * 200 * t) + 0.4 * np.cos(2 * np.pi * 400 * t)
    for i, x in enumerate((teeth, teeth + 2 * np.cos(2 * np.pi * 713 * t))):
        wavfile.write(tmp_path / f"cut{i}.wav", rate, (4000 * (x + 0.02 * noise[i])).astype(np.int16))
    text = "Cut,RPM,DOC (mm),File\nA,6000,2,cut0.wav\nB,6000,5,cut1.wav\n"
    imported(tmp_path, text, "cutting.teeth=2", "channel.channel_1.quantity=sound")
    found = [one.cut for one in judged_cuts(read_measurement(tmp_path / "cuts.measurement.toml"))]
    assert [cut.verdict for cut in found] == ["stable", "chatter"]
    assert found[1].chatter_frequency == pytest.approx(713, abs=1)
