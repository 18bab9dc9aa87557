"""Coefficients that a machine takes from a cutting file: their values, their errors, and what bands make of them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from jointlib.cutting_force.coefficients import Coefficients
from jointlib.cutting_force.cutting_file import write_cutting_file
from jointlib.errors import InputError
from jointlib.joint import Covariance
from machines import lobes_at_amplitude, read_machine
from machines.files.machine_writer import write_machine
from machines.lobes import lobe_band
from machines.study.settings import Setting
from machines.study.variants import Machines
from machines.uncertainty.drawn_machines import sampled_machines

MACHINE = """
schema = "jointlib/machine/1"
[[component]]
name = "cutter"
kind = "modal"
dofs = ["x", "y"]
frequency = [603, 666]
damping_ratio = [0.039, 0.035]
modal_mass = [0.3894, 0.3264]
shapes = [[1.0, 0.0], [0.0, 1.0]]
{errors}
[tool]
x = "cutter.x"
y = "cutter.y"
[cutting]
process = "milling"
file = "al.cutting.toml"
teeth = 3
mode = "up"
immersion = 0.5
speed = [4000, 20000]
"""
NAMES = ("tangential", "normal", "axial", "edge_tangential")
VALUES = {"tangential": 6e8, "normal": 4.2e7, "axial": 1e8, "edge_tangential": 1e4}


def written(folder: Path, errors: str = "", share: float = 0.05, process: str = "milling") -> Path:
    deviation = share * np.array([VALUES[n] for n in NAMES])
    covariance = Covariance(NAMES, np.diag(deviation**2)) if share else None
    write_cutting_file(folder / "al.cutting.toml", Coefficients(process, VALUES, covariance))
    (folder / "mill.toml").write_text(MACHINE.format(errors=errors))
    return folder / "mill.toml"


def test_the_file_gives_the_coefficients_that_the_table_does_not(tmp_path: Path) -> None:
    machine = read_machine(written(tmp_path))
    assert machine.cutting is not None
    assert (machine.cutting["tangential"], machine.cutting["edge_tangential"]) == (6e8, 1e4)
    assert "axial" not in machine.cutting
    assert machine.cutting["covariance"].names == ("tangential", "normal", "edge_tangential")
    own = read_machine(tmp_path / "mill.toml", {"cutting.tangential": 7e8})
    assert own.cutting is not None
    assert own.cutting["tangential"] == 7e8
    assert own.cutting["covariance"].names == ("normal", "edge_tangential")


def test_in_turning_the_force_along_the_chip_is_fed_back(tmp_path: Path) -> None:
    file = written(tmp_path, process="turning")
    text = file.read_text().replace("milling", "turning").replace("teeth = 3\n", "").replace('mode = "up"\n', "")
    file.write_text(text.replace("immersion = 0.5\n", ""))
    cutting = read_machine(file).cutting
    assert cutting is not None
    assert cutting["specific"] == 4.2e7
    assert cutting["covariance"].names == ("specific",)


@pytest.mark.parametrize("method", ["zero-order", "collocation"])
def test_a_band_of_the_cut_alone_is_that_of_the_coefficients(tmp_path: Path, method: str) -> None:
    machine = read_machine(written(tmp_path))
    count = 200 if method == "zero-order" else 12
    band = lobe_band(machine, [9000.0], count=count, method=method)
    cuts = [dict(one.cutting or {}) for one in sampled_machines(machine, count)[0]]
    exact = [lobes_at_amplitude(replace(machine, cutting=cut), [9000.0], method=method).depth[0] for cut in cuts[:12]]
    np.testing.assert_allclose(band.samples[:12, 0], exact, rtol=2e-3)
    # Forces that are 5 % larger make the limit 5 % smaller: K_t sets the scale where K_n is small.
    if method == "zero-order":
        assert np.std(np.log(band.samples)) == pytest.approx(0.05, rel=0.15)


def test_modes_with_standard_errors_are_drawn(tmp_path: Path) -> None:
    errors = "frequency_error = [12, 13]\ndamping_ratio_error = [0.004, 0.003]"
    machine = read_machine(written(tmp_path, errors, share=0.0))
    drawn = [one.components[0] for one in sampled_machines(machine, 400)[0]]
    frequency = np.array([one.frequency for one in drawn])  # type: ignore[attr-defined]
    np.testing.assert_allclose(frequency.mean(axis=0), [603, 666], atol=3)
    np.testing.assert_allclose(frequency.std(axis=0), [12, 13], rtol=0.1)
    assert np.std(lobe_band(machine, [9000.0], count=100, method="zero-order").samples) > 0


def test_a_machine_written_elsewhere_takes_its_cutting_file_along(tmp_path: Path) -> None:
    made = write_machine(written(tmp_path), {"cutting.immersion": 0.4}, tmp_path / "out" / "best.toml")
    back = read_machine(made[0])
    assert back.cutting is not None
    assert back.cutting["tangential"] == 6e8
    assert back.cutting["covariance"] is not None


def test_a_study_cuts_with_the_coefficients_of_its_samples(tmp_path: Path) -> None:
    file, samples = written(tmp_path), 8
    machines = sampled_machines(read_machine(file), samples, seed=3)[0]
    for sample in (0, 5):
        setting = Setting(file, (), (), (("cutting.immersion", 0.3),), sample)
        cut = Machines({}).cut(setting, samples, 3)
        drawn = dict(machines[sample].cutting or {})
        assert (cut.tangential, cut.normal, cut.immersion) == (drawn["tangential"], drawn["normal"], 0.3)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda t: t.replace("al.cutting.toml", "gone.cutting.toml"), "which does not exist"),
        (
            lambda t: t.replace('"milling"', '"turning"'),
            "coefficients of milling, expected those of turning",
        ),
        (lambda t: t.replace('"al.cutting.toml"', '"mill.toml"'), 'expected "jointlib/cutting/1"'),
    ],
)
def test_a_wrong_file_is_told_in_a_sentence(tmp_path: Path, change: object, said: str) -> None:
    file = written(tmp_path)
    file.write_text(change(file.read_text()))  # type: ignore[operator]
    with pytest.raises(InputError, match=said):
        read_machine(file)


def test_where_nothing_has_an_error_there_is_nothing_to_sample(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="nothing to sample"):
        lobe_band(read_machine(written(tmp_path, share=0.0)), [9000.0], count=40, method="zero-order")
