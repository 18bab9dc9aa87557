"""From measured lines to a component and to the depth of cut; and back from the component to the lines."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from jointlib import InputError
from jointlib.modal_fit.fit import fit_modes
from jointlib.modal_fit.responses import Responses
from machines import read_machine, stability_lobes
from machines.answers.told.measured_modes import beyond
from machines.components.measured import Measured
from machines.components.modal import Modal
from machines.components.state_space import StateSpace
from machines.cutting.process.cutting import Cutting
from machines.files.component_file import read_component
from machines.measured_modes.measured_responses import read_responses
from machines.measured_modes.modal_component import component_of, write_component
from machines.tool.tool_model import ToolModel

CUT = Cutting("milling", teeth=2, tangential=6e8, normal=2e8, mode="down", immersion=0.5)
SPEEDS = np.linspace(5000.0, 20000.0, 16)
FREQUENCY = np.array([520.0, 640.0, 1100.0])
RATIO = np.array([0.03, 0.025, 0.02])
SHAPES = np.array([[1.2, 0.3, 1.5], [-0.2, 1.4, 0.6]])
PAIRS = ((0, 0), (1, 0), (0, 1), (1, 1))


def lines(decibels: float, seed: int = 0, step: float = 2.0) -> Responses:
    """Both directions of a tool point, noise so many decibels below the rms of each response."""
    rng = np.random.default_rng(seed)
    f = np.arange(200.0, 1800.0, step)
    s, w = 2j * np.pi * f[:, None], 2 * np.pi * FREQUENCY
    H = np.array([np.sum(SHAPES[o] * SHAPES[i] / (s**2 + 2 * RATIO * w * s + w**2), axis=1) for o, i in PAIRS])
    sigma = np.sqrt(np.mean(np.abs(H) ** 2, axis=1, keepdims=True)) * 10 ** (-decibels / 20) * np.ones(H.shape)
    noise = sigma * (rng.normal(size=H.shape) + 1j * rng.normal(size=H.shape)) / np.sqrt(2)
    return Responses(f, H + noise, sigma, PAIRS, ("x", "y"))


@pytest.mark.parametrize("decibels", [pytest.param(30, marks=pytest.mark.thorough), 50])
def test_the_depths_of_fitted_modes_are_those_of_the_true_ones(decibels: float) -> None:
    found = fit_modes(lines(decibels))
    part = component_of(found, "tool")
    assert isinstance(part, Modal)
    assert len(part.frequency) == 3
    fitted = ToolModel.from_modes(part.frequency, part.damping_ratio, part.modal_mass, part.shapes)
    true = ToolModel.from_modes(FREQUENCY, RATIO, np.ones(3), SHAPES)
    depth, expected = (stability_lobes(model, CUT, SPEEDS, "collocation").depth for model in (fitted, true))
    np.testing.assert_allclose(depth, expected, rtol=0.03)


def write_lines(folder: Path, responses: Responses, more: str = "") -> Path:
    """The responses as CSV files and a measurement that names them."""
    records = ""
    for k, (o, i) in enumerate(responses.pairs):
        rows = zip(responses.frequency, responses.value[k], responses.deviation[k], strict=True)
        text = "".join(
            f"{f!r},{H.real!r},{H.imag!r},{d!r}\n" for f, H, d in ((float(f), H, float(d)) for f, H, d in rows)
        )
        text = text.replace("np.float64(", "").replace(")", "")
        (folder / f"h{k}.csv").write_text("frequency,real,imaginary,deviation\n" + text)
        names = [f"tool.{responses.dofs[n]}" for n in (o, i)]
        records += f'[[record]]\nfile = "h{k}.csv"\nresponse = "{names[0]}"\ndrive = "{names[1]}"\n'
        records += f'quantity = "receptance"\nforce = 10\n{more}'
    (folder / "tip.measurement.toml").write_text(f'schema = "jointlib/measurement/1"\nkind = "frf"\n{records}')
    return folder / "tip.measurement.toml"


MACHINE = """
schema = "jointlib/machine/1"
[[component]]
name = "tool"
{}
[tool]
x = "tool.x"
y = "tool.y"
"""


def test_a_component_file_reads_back_as_what_was_fitted(tmp_path: Path) -> None:
    read = read_responses([write_lines(tmp_path, lines(50))])
    assert (read.dofs, read.pairs) == (("x", "y"), PAIRS)
    np.testing.assert_allclose(read.value, lines(50).value, rtol=1e-15)
    found = fit_modes(read)
    (file,) = write_component(tmp_path / "tool.component.toml", found, [tmp_path / "tip.measurement.toml"])
    (tmp_path / "machine.toml").write_text(MACHINE.format('file = "tool.component.toml"'))
    (part,) = read_machine(tmp_path / "machine.toml").components
    omega = 2 * np.pi * read.frequency
    H = part.receptance(omega)
    np.testing.assert_array_equal(H, component_of(found, "tool").receptance(omega))
    for k, (o, i) in enumerate(PAIRS):
        np.testing.assert_allclose(H[:, o, i], found.fitted[k], atol=1e-12 * np.max(np.abs(found.fitted)))
    assert read_component(file, "tool").kind == "modal"


@pytest.mark.thorough
def test_lines_of_the_component_give_the_same_modes_again() -> None:
    """FRF to modes to FRF to modes: without noise nothing changes any more."""
    first = fit_modes(lines(40))
    part = component_of(first, "tool")
    H = part.receptance(2 * np.pi * first.responses.frequency)
    value = np.array([H[:, o, i] for o, i in PAIRS])
    sigma = np.full(value.shape, 1e-6 * np.max(np.abs(value)))
    again = fit_modes(Responses(first.responses.frequency, value, sigma, PAIRS, ("x", "y")))
    np.testing.assert_allclose(again.frequency, first.frequency, rtol=1e-8)
    np.testing.assert_allclose(again.damping_ratio, first.damping_ratio, rtol=1e-6)


@pytest.mark.thorough
def test_complex_shapes_become_states(tmp_path: Path) -> None:
    M, K, C = np.eye(2), np.array([[2.2, -1.1], [-1.1, 2.0]]) * 4e6, np.diag([200.0, 4.0])
    f = np.arange(100.0, 800.0, 0.5)
    s = 2j * np.pi * f
    H = np.linalg.inv(s[:, None, None] ** 2 * M + s[:, None, None] * C + K)
    value = np.array([H[:, 0, 0], H[:, 1, 0]])
    found = fit_modes(
        Responses(f, value, np.full(value.shape, 1e-4 * np.max(np.abs(value))), ((0, 0), (1, 0)), ("a", "b"))
    )
    written = write_component(tmp_path / "part.component.toml", found)
    assert [path.name for path in written] == ["part.component.toml", "part.npz"]
    part = read_component(written[0], "part")
    assert isinstance(part, StateSpace)
    again = part.receptance(2 * np.pi * f)
    for entry, whole in ((again[:, 0, 0], value[0]), (again[:, 1, 0], value[1]), (again[:, 0, 1], value[1])):
        assert np.linalg.norm(entry - whole) < 1e-3 * np.linalg.norm(whole)


def test_a_measured_component_takes_its_lines_from_a_measurement(tmp_path: Path) -> None:
    write_lines(tmp_path, lines(50))
    text = 'kind = "frf"\ndofs = ["x", "y"]\nmeasurement = "tip.measurement.toml"'
    (tmp_path / "machine.toml").write_text(MACHINE.format(text))
    (part,) = read_machine(tmp_path / "machine.toml").components
    assert isinstance(part, Measured)
    assert part.variance is not None
    for k, (o, i) in enumerate(PAIRS):
        np.testing.assert_allclose(part.value[:, o, i], lines(50).value[k], rtol=1e-12)
        np.testing.assert_allclose(part.variance[:, o, i], lines(50).deviation[k] ** 2, rtol=1e-12)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('file = "no.component.toml"', "file refers to"),
        ('file = "tip.measurement.toml"', 'expected "jointlib/component/1"'),
        ('file = "good.component.toml"\nkind = "modal"', "kind stands beside the file of a component"),
        ('file = "good.component.toml"\nmass = 3', "unknown key 'mass'"),
        ('file = "bad.component.toml"', "key 'shapes' is missing"),
    ],
)
def test_a_faulty_component_file_is_told(tmp_path: Path, text: str, said: str) -> None:
    write_lines(tmp_path, lines(50, step=20.0))
    good = 'schema = "jointlib/component/1"\nkind = "modal"\ndofs = ["x", "y"]\nfrequency = [500]\n'
    good += "damping_ratio = [0.02]\n"
    (tmp_path / "bad.component.toml").write_text(good)
    (tmp_path / "good.component.toml").write_text(good + "shapes = [[1.0], [0.0]]\n")
    (tmp_path / "machine.toml").write_text(MACHINE.format(text))
    with pytest.raises(InputError) as caught:
        read_machine(tmp_path / "machine.toml")
    assert said in str(caught.value)


def test_several_levels_are_asked_for_one(tmp_path: Path) -> None:
    file = write_lines(tmp_path, lines(50, step=20.0))
    text = file.read_text()
    file.write_text(text + text.split("[[record]]")[1].join(["[[record]]", ""]).replace("force = 10", "force = 50"))
    with pytest.raises(InputError, match="at several levels, 10 N, 50 N"):
        read_responses([file])
    assert len(read_responses([file], condition="10 N").pairs) == 4
    with pytest.raises(InputError, match="'60 N' is none of"):
        read_responses([file], condition="60 N")


def test_what_has_no_driving_point_is_no_component(tmp_path: Path) -> None:
    whole = lines(50, step=4.0)
    only = Responses(whole.frequency, whole.value[1:2], whole.deviation[1:2], ((1, 0),), ("x", "y"))
    found = fit_modes(only)
    np.testing.assert_allclose(found.frequency, FREQUENCY, rtol=5e-3)
    with pytest.raises(InputError, match="no driving point among the responses"):
        write_component(tmp_path / "tool.component.toml", found)
    assert not list(tmp_path.iterdir())


def test_of_computed_responses_nobody_says_that_they_were_measured_wrongly() -> None:
    fitted: Any = SimpleNamespace(scatter=9.0, shape_fit=None, responses=SimpleNamespace(frequency=np.array([1.0])))
    (measured,), (computed,) = beyond(fitted), beyond(fitted, computed=True)
    assert measured.startswith("the modes miss 3 times")
    assert "responses do not belong together" in measured
    assert computed.startswith("the modes miss 3 times")
    assert "responses" not in computed
