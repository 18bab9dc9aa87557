"""Measured components: conversions to rounding, what the record tells of itself, and no value out of nowhere."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import pyuff
from scipy.io import savemat

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import FrequencyMismatch, InputError
from jointlib.frf import Quantity
from jointlib.joint import Joint
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import Connection, Lumped, Machine, Modal, frozen_receptance, linear_check, read_machine, response
from machines.components.interpolation import curve, gaps, left_out
from machines.components.measured import Measured

LINES = np.linspace(50.0, 1500.0, 581)
COLUMN = Modal(
    "c",
    ("x", "y"),
    np.array([310.0, 700.0, 1150.0]),
    np.array([0.02, 0.015, 0.03]),
    np.array([[0.3, -0.2, 0.25], [0.1, 0.3, 0.2]]),
)


def truth(lines: Array = LINES) -> ComplexArray:
    return COLUMN.receptance(2 * np.pi * lines)


@pytest.mark.parametrize("quantity", Quantity)
def test_every_quantity_is_the_same_receptance_to_rounding(quantity: Quantity) -> None:
    H, variance = truth(), 1e-3 * np.abs(truth()) ** 2
    per = quantity.per_receptance(LINES)[:, None, None]
    part = Measured("c", ("x", "y"), LINES, H * per, quantity, variance * np.abs(per) ** 2)
    assert np.max(np.abs(part.receptance(2 * np.pi * LINES) - H) / np.abs(H)) < 1e-15
    assert part.frf.variance is not None
    assert np.max(np.abs(part.frf.variance - variance) / variance) < 1e-14
    assert np.max(np.abs(part.frf.receptance * per - part.value) / np.abs(part.value)) < 1e-15
    assert f"measured {quantity.word}" in part.remarks()[0]
    assert "with its variance" in part.remarks()[0]


def test_velocity_leads_displacement() -> None:
    assert Quantity.MOBILITY.per_receptance(1 / (2 * np.pi)) == pytest.approx(1j)
    assert Quantity.ACCELERANCE.per_receptance(1 / (2 * np.pi)) == pytest.approx(-1)


@pytest.mark.parametrize("method", ["rational", "spline"])
def test_interpolation_goes_through_every_line(method: str) -> None:
    found = curve(LINES, truth(), method)[0](LINES)
    assert np.linalg.norm(found - truth()) < 1e-12 * np.linalg.norm(truth())


def test_rational_pieces_follow_a_single_resonance_exactly() -> None:
    """r/(ω − p) + c + dω is a quadratic over a linear polynomial: lines far apart do not matter."""
    f = np.array([80.0, 95.0, 103.0, 110.0, 140.0, 150.0])
    shape = lambda x: (2 - 1j) / (x - (100 + 1.5j)) + 0.3 - 0.002j * x  # noqa: E731
    between = np.linspace(80, 150, 200)
    found = curve(f, shape(f)[:, None], "rational")[0](between)[:, 0]
    assert np.max(np.abs(found - shape(between))) < 1e-10


@pytest.mark.parametrize("method", ["rational", "spline"])
def test_error_told_is_an_upper_bound_of_the_error_made(method: str) -> None:
    part = Measured("c", ("x", "y"), LINES, truth(), interpolation=method)
    between = (LINES[1:] + LINES[:-1]) / 2
    made = np.linalg.norm(part.receptance(2 * np.pi * between) - truth(between)) / np.linalg.norm(truth(between))
    told = left_out(LINES, part._accelerance, method).norm
    assert made < told < 100 * made + 1e-6
    assert f"by {method} interpolation" in " ".join(part.remarks())
    assert told < {"rational": 1e-4, "spline": 0.05}[method]


def test_noise_makes_no_poles_between_the_lines() -> None:
    rng = np.random.default_rng(1)
    noisy = rng.normal(size=(400, 1)) + 1j * rng.normal(size=(400, 1))
    f = np.linspace(10, 409, 400)
    at, cubics = curve(f, noisy, "rational")
    assert cubics > 0
    assert np.max(np.abs(at(np.linspace(10, 409, 20001)))) < 100


def test_nothing_is_interpolated_or_extrapolated_unasked() -> None:
    part = Measured("c", ("x", "y"), LINES, truth())
    assert part.receptance(2 * np.pi * LINES[[3, 7]]).shape == (2, 2, 2)
    with pytest.raises(FrequencyMismatch, match=r'53\.1 Hz, which is no measured line; say interpolation = "rational"'):
        part.receptance(2 * np.pi * np.array([50.0, 53.1]))
    part = Measured("c", ("x", "y"), LINES, truth(), interpolation="rational")
    with pytest.raises(FrequencyMismatch, match="asked for 49 to 60 Hz, measured from 50 to 1500 Hz"):
        part.receptance(2 * np.pi * np.array([49.0, 60.0]))


def test_record_that_is_not_reciprocal_or_not_passive_is_named_with_its_frequencies() -> None:
    H = truth().copy()
    assert len(Measured("c", ("x", "y"), LINES, H).remarks()) == 1
    H[100:103, 0, 1] *= 1.2
    H[200, 1, 1] = H[200, 1, 1].conj()
    said = " ".join(Measured("c", ("x", "y"), LINES, H).remarks())
    assert "y from x and back are not reciprocal at 300 to 305 Hz" in said
    assert "driving point y yields energy (real part of its mobility below 0, Im H > 0) at 550 Hz" in said
    # What three standard deviations explain is no fault.
    variance = np.abs(H) ** 2
    assert len(Measured("c", ("x", "y"), LINES, H, variance=variance).remarks()) == 1


def test_record_that_no_passive_machine_can_have_is_refused() -> None:
    with pytest.raises(InputError, match=r"driving point x yields energy over the band .* conjugate = true"):
        Measured("c", ("x", "y"), LINES, truth().conj())
    with pytest.raises(InputError, match="driving point y yields energy"):
        Measured("c", ("x", "y"), LINES, truth() * np.array([[1, 1], [1, -1]]))
    for factor, share in ((-1, "2"), (1e3, "1"), (0.4, "0.6")):
        with pytest.raises(InputError, match=f"y from x and back differ by {share} of their norm"):
            Measured("c", ("x", "y"), LINES, truth() * np.array([[1, factor], [1, 1]]))
    # Noise is no fault of that kind, nor is a wrong line.
    rng = np.random.default_rng(2)
    noise = rng.normal(size=(2, *truth().shape)) * 0.2 * np.abs(truth())
    Measured("c", ("x", "y"), LINES, truth() + noise[0] + 1j * noise[1])


@pytest.mark.parametrize("method", ["rational", "spline"])
def test_nothing_is_put_into_a_gap_of_the_record(method: str) -> None:
    keep = (LINES < 400.0) | (LINES > 450.0)
    part = Measured("c", ("x", "y"), LINES[keep], truth()[keep], interpolation=method)
    part.receptance(2 * np.pi * np.array([396.0, 397.5, 452.5, 453.0]))
    with pytest.raises(FrequencyMismatch, match=r"asked for 420 Hz, but no line lies between 397\.5 and 452\.5 Hz"):
        part.receptance(2 * np.pi * np.array([300.0, 420.0]))
    # Lines may grow apart, as they do by octaves, or change their step once.
    for lines in (np.geomspace(50, 1500, 90), np.concatenate([LINES[:40:10], LINES[40:80], LINES[80:200:10]])):
        assert not gaps(lines)


def test_machine_with_a_measured_part_answers_like_one_with_its_model() -> None:
    slide = Lumped("s", ("x",), np.array([[20.0]]), np.array([[100.0]]), np.array([[2e7]]))
    link = Connection("j", ("c.x", "s.x"), Joint((Linear(3e7), Viscous(400.0))))
    measured = Measured("c", ("x", "y"), LINES, truth(), interpolation="rational")
    answers = [
        response(Machine((part, slide), (link,)), 10.0, [60.0, 1400.0], drive="c.y", outputs=["s.x"])
        for part in (COLUMN, measured)
    ]
    for a, b in zip(answers[0].peaks, answers[1].peaks, strict=True):
        assert b.frequency == pytest.approx(a.frequency, rel=1e-6)
        assert b.amplitude == pytest.approx(a.amplitude, rel=1e-4)
    with pytest.raises(InputError, match="component 'c' has no equations of motion, only an FRF"):
        linear_check(Machine((measured, slide), (link,)))


def test_coupling_on_measured_lines_equals_that_of_the_model() -> None:
    slide = Lumped("s", ("x",), np.array([[20.0]]), np.array([[100.0]]), np.array([[2e7]]))
    link = Connection("j", ("c.x", "s.x"), Joint((Linear(3e7), Viscous(400.0))))
    parts = (COLUMN, Measured("c", ("x", "y"), LINES, truth()))
    a, b = (
        frozen_receptance(
            Machine((p, slide), (link,), tool={"x": "c.y"}), LINES, 0.0, outputs=["c.x", "s.x"]
        ).receptance
        for p in parts
    )
    assert np.linalg.norm(a - b) < 1e-12 * np.linalg.norm(a)


GOOD = """
schema = "jointlib/machine/1"
[[component]]
name = "column"
kind = "frf"
dofs = ["x", "y"]
quantity = "accelerance"
interpolation = "rational"
[[component.record]]
file = "xx.csv"
response = "x"
drive = "x"
[[component.record]]
file = "yx.csv"
response = "y"
drive = "x"
[[component.record]]
file = "yy.csv"
response = "y"
drive = "y"
[tool]
x = "column.x"
"""


def uff(path: Path, values: dict[tuple[int, int, int, int], ComplexArray], **changed: Any) -> None:
    file = pyuff.UFF(str(path))
    if "length" in changed:
        file.write_sets(
            {
                "type": 164,
                "units_code": 5,
                "units_description": "mm (milli newton)",
                "temp_mode": 1,
                "length": changed.pop("length"),
                "force": 1000.0,
                "temp": 1.0,
                "temp_offset": 273.15,
            },
            "add",
        )
    for (node, direction, ref, ref_direction), value in values.items():
        data = {
            "type": 58,
            "binary": 0,
            "func_type": 4,
            "ver_num": 0,
            "load_case_id": 0,
            "rsp_ent_name": "NONE",
            "rsp_node": node,
            "rsp_dir": direction,
            "ref_ent_name": "NONE",
            "ref_node": ref,
            "ref_dir": ref_direction,
            "id1": "frf",
            "id2": "NONE",
            "id3": "NONE",
            "id4": "NONE",
            "id5": "NONE",
            "ord_data_type": 6,
            "num_pts": len(LINES),
            "abscissa_spacing": 1,
            "abscissa_min": LINES[0],
            "abscissa_inc": LINES[1] - LINES[0],
            "z_axis_value": 0,
            "abscissa_spec_data_type": 18,
            "abscissa_len_unit_exp": 0,
            "abscissa_force_unit_exp": 0,
            "abscissa_temp_unit_exp": 0,
            "abscissa_axis_lab": "Frequency",
            "abscissa_axis_units_lab": "Hz",
            "ordinate_spec_data_type": 12,
            "ordinate_len_unit_exp": 0,
            "ordinate_force_unit_exp": 0,
            "ordinate_temp_unit_exp": 0,
            "ordinate_axis_lab": "Acceleration",
            "ordinate_axis_units_lab": "m/s^2",
            "orddenom_spec_data_type": 13,
            "orddenom_len_unit_exp": 0,
            "orddenom_force_unit_exp": 0,
            "orddenom_temp_unit_exp": 0,
            "orddenom_axis_lab": "Force",
            "orddenom_axis_units_lab": "N",
            "z_axis_spec_data_type": 0,
            "z_axis_len_unit_exp": 0,
            "z_axis_force_unit_exp": 0,
            "z_axis_temp_unit_exp": 0,
            "z_axis_axis_lab": "NONE",
            "z_axis_axis_units_lab": "NONE",
            "x": LINES,
            "data": value,
        }
        file.write_sets({**data, **changed}, "add")


def accelerance() -> ComplexArray:
    return truth() * Quantity.ACCELERANCE.per_receptance(LINES)[:, None, None]


def files(folder: Path, conjugate: bool = False) -> None:
    a, var = accelerance().conj() if conjugate else accelerance(), 1e-4 * np.abs(accelerance()) ** 2
    for word, (i, j) in {"xx": (0, 0), "yx": (1, 0), "yy": (1, 1)}.items():
        table = np.column_stack([LINES, a[:, i, j].real, a[:, i, j].imag, var[:, i, j]])
        np.savetxt(folder / f"{word}.csv", table, delimiter=",", header="f,Re,Im,variance", comments="", fmt="%.17g")
    short = np.column_stack([LINES[:9], a[:9, 1, 1].real, a[:9, 1, 1].imag])
    np.savetxt(folder / "short.csv", short, delimiter=",", header="f,Re,Im", comments="", fmt="%.17g")
    np.savetxt(folder / "wide.csv", np.zeros((4, 5)), delimiter=",", header="a,b,c,d,e", comments="")
    np.savez(folder / "all.npz", frequency=LINES, accelerance=a, variance=var)
    savemat(folder / "all.mat", {"frequency": LINES, "H": a})
    np.savez(folder / "nan.npz", frequency=LINES, accelerance=a * np.nan)
    uff(folder / "all.uff", {(12, 1, 12, 1): a[:, 0, 0], (7, -3, 12, 1): -a[:, 1, 0], (7, -3, 7, 3): -a[:, 1, 1]})
    uff(folder / "mm.uff", {(12, 1, 12, 1): a[:, 0, 0] * 1e-3 * 1e3}, length=1000.0)
    uff(folder / "strain.uff", {(12, 1, 12, 1): a[:, 0, 0]}, ordinate_spec_data_type=3)
    (folder / "broken.uff").write_text("    -1\n    58\nnothing\n    -1\n")


def read(folder: Path, text: str) -> Measured:
    files(folder)
    (folder / "m.toml").write_text(text)
    (part,) = read_machine(folder / "m.toml").components
    assert isinstance(part, Measured)
    return part


def test_csv_records_are_read_with_their_variance(tmp_path: Path) -> None:
    part = read(tmp_path, GOOD)
    assert np.linalg.norm(part.frf.receptance - truth()) < 1e-14 * np.linalg.norm(truth())
    assert part.frf.variance is not None
    assert part.frf.variance == pytest.approx(1e-4 * np.abs(truth()) ** 2)
    assert part.quantity is Quantity.ACCELERANCE
    assert "not measured and taken from the way back: x from y." in " ".join(part.remarks())


HEAD = GOOD[: GOOD.index("[[component.record]]")]
TAIL = GOOD[GOOD.index("[tool]") :]


@pytest.mark.parametrize("file", ["all.npz", "all.mat"])
def test_whole_matrix_is_read_from_arrays(tmp_path: Path, file: str) -> None:
    part = read(tmp_path, f'{HEAD}[[component.record]]\nfile = "{file}"\n{TAIL}')
    assert np.linalg.norm(part.frf.receptance - truth()) < 1e-14 * np.linalg.norm(truth())


def test_universal_file_is_read_by_node_and_direction(tmp_path: Path) -> None:
    """The file holds responses along −Z of node 7; asked for +Z they change sign."""
    records = "".join(
        f'[[component.record]]\nfile = "all.uff"\nresponse = "{a}"\ndrive = "{b}"\n'
        f'response_at = "{p}"\ndrive_at = "{q}"\n'
        for a, b, p, q in (("x", "x", "12X", "12+X"), ("y", "x", "7+Z", "12+X"), ("y", "y", "7-Z", "7-Z"))
    )
    part = read(tmp_path, HEAD.replace('quantity = "accelerance"\n', "") + records + TAIL)
    assert part.quantity is Quantity.ACCELERANCE
    assert np.linalg.norm(part.frf.receptance - truth()) < 1e-9 * np.linalg.norm(truth())
    assert "the file states no units, taken as SI." in " ".join(part.remarks())


def test_units_of_a_universal_file_are_converted_and_told(tmp_path: Path) -> None:
    """In mm and mN the value of m/s² per N is the same number: 1e3 mm over 1e3 mN."""
    text = (
        HEAD.replace('"x", "y"', '"x"') + '[[component.record]]\nfile = "mm.uff"\nresponse = "x"\ndrive = "x"\n' + TAIL
    )
    part = read(tmp_path, text)
    assert np.linalg.norm(part.frf.receptance[:, 0, 0] - truth()[:, 0, 0]) < 1e-9 * np.linalg.norm(truth()[:, 0, 0])
    assert "mm (milli newton)" in " ".join(part.remarks())


def test_unit_and_conjugate_are_applied(tmp_path: Path) -> None:
    part = read(tmp_path, GOOD.replace('drive = "x"\n', 'drive = "x"\nunit = "g_0/N"\n', 1))
    assert part.frf.receptance[:, 0, 0] == pytest.approx(9.80665 * truth()[:, 0, 0])
    files(tmp_path, conjugate=True)
    with pytest.raises(InputError, match="conjugate = true"):
        read_machine(tmp_path / "m.toml")
    (tmp_path / "m.toml").write_text(GOOD.replace('interpolation = "rational"', "conjugate = true"))
    (part,) = read_machine(tmp_path / "m.toml").components
    assert isinstance(part, Measured)
    assert part.frf.receptance == pytest.approx(truth())


XX = 'file = "xx.csv"\nresponse = "x"\ndrive = "x"'
BAD = [
    ('quantity = "accelerance"', 'quantity = "acceleration"', "did you mean 'accelerance'"),
    ('quantity = "accelerance"\n', "", "does not say what it holds"),
    ('interpolation = "rational"', 'interpolation = "linear"', "interpolation is 'linear'"),
    ('file = "xx.csv"', 'file = "lost.csv"', "no such file"),
    ('file = "xx.csv"', 'file = "wide.csv"', "has 5 columns"),
    ('file = "xx.csv"', 'file = "m.toml"', "no reader for '.toml'"),
    (XX, 'file = "all.npz"', "is there already"),
    ('file = "xx.csv"', 'file = "all.npz"', "holds a matrix for all dofs"),
    (XX, 'file = "nan.npz"', "accelerance at 1, 1, 1 is nan"),
    ('file = "xx.csv"', 'file = "all.uff"', r"holds 12\+X from 12\+X, 7-Z from 12\+X"),
    (XX, XX.replace("xx.csv", "all.uff") + '\nresponse_at = "8X"\ndrive_at = "12X"', "holds no responses at 8X"),
    (XX, XX.replace("xx.csv", "all.uff") + '\nresponse_at = "top"\ndrive_at = "12X"', "'top', expected a node"),
    (XX, XX.replace("xx.csv", "all.uff") + '\nresponse_at = "8X"', "response_at and drive_at together"),
    ('file = "xx.csv"', 'file = "strain.uff"', "ordinate type 3"),
    ('file = "xx.csv"', 'file = "broken.uff"', "universal file|holds no frequency response"),
    (XX, XX + '\nquantity = "mobility"\nunit = "m/s^2/N"', "unit"),
    (XX, XX.replace('"x"', '"z"', 1), "expected one of x, y"),
    (XX, 'file = "xx.csv"', "response and drive are missing"),
    (XX, XX.replace("xx.csv", "short.csv"), "other lines than the first"),
    ('response = "y"\ndrive = "x"', 'response = "y"\ndrive = "y"', "is there already"),
    ('dofs = ["x", "y"]', 'dofs = ["x", "y", "z"]', "no record of .*z"),
]


@pytest.mark.parametrize(("old", "new", "words"), BAD)
def test_what_is_wrong_is_said_in_one_sentence(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in GOOD
    with pytest.raises(InputError, match=words) as caught:
        read(tmp_path, GOOD.replace(old, new, 1))
    assert str(caught.value).partition(":")[0].endswith("m.toml")
    assert "\n" not in str(caught.value)
