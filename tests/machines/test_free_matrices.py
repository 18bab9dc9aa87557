"""Free parts given by matrices: their mass and centre, and nodes that do not move as the matrices do."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from jointlib.arrays import Array
from jointlib.cli.main import cli
from machines import Machine, read_machine
from machines.mistakes import in_file
from machines.model.masses import part_masses

PLACES = np.array([[0.0, 0, 0], [0.3, 0, 0], [0, 0.25, 0], [0.05, 0.05, 0.4], [0.2, 0.2, 0.2]])
MASSES = np.array([2.0, 3.0, 1.0, 4.0, 2.5])
NAMES = "abcde"


def lattice(ground: float = 0.0) -> tuple[Array, Array]:
    """Mass and stiffness of five masses with a spring between every two, (15, 15), in SI."""
    K = ground * np.eye(15)
    for i, j in combinations(range(5), 2):
        line = PLACES[j] - PLACES[i]
        row = np.zeros(15)
        row[3 * i : 3 * i + 3], row[3 * j : 3 * j + 3] = line, -line
        K += 2e8 * np.outer(row, row) / (line @ line)
    return np.diag(np.repeat(MASSES, 3)), K


def machine(folder: Path, *, shift: int = 0, at: Array = PLACES, more: str = "", ground: float = 0.0) -> Machine:
    """The part alone; its first node ``shift`` rows further, its nodes at these places."""
    M, K = lattice(ground)
    np.savez(folder / "part.npz", M=M, K=K)
    foot = 'joint = { law = [{ kind = "linear", stiffness = "90 N/um" }] }'
    text = f'schema = "jointlib/machine/1"\nname = "free"\n[[connection]]\nname = "foot"\n{foot}\n'
    text += 'between = ["part.a.x", "ground"]\n[[component]]\nname = "part"\nkind = "matrices"\n'
    text += 'mass = { file = "part.npz", name = "M" }\nstiffness = { file = "part.npz", name = "K" }\n'
    text += f"damping_ratio = 0.01\n{more}\n"
    for i, name in enumerate(NAMES[:4]):
        first = 3 * i + 1 + (shift if i == 3 else 0)
        text += f'[[component.node]]\nname = "{name}"\nrows = {{ x = {first}, y = {first + 1}, z = {first + 2} }}\n'
        text += f"at = {[float(x) for x in at[i]]}\n"
    (folder / "m.toml").write_text(text, "utf-8")
    return read_machine(folder / "m.toml")


def test_mass_and_centre_are_those_of_the_translations_without_strain(tmp_path: Path) -> None:
    (told,) = part_masses(machine(tmp_path))
    assert told.mass == pytest.approx(np.sum(MASSES))
    assert told.centre == pytest.approx(MASSES @ PLACES / np.sum(MASSES))


def test_inspect_tells_them(tmp_path: Path) -> None:
    machine(tmp_path)
    done = CliRunner().invoke(cli, ["inspect", str(tmp_path / "m.toml")], catch_exceptions=False)
    assert "component part: matrices, 12.5 kg at (0.128, 0.076, 0.168) m" in done.stdout


def test_millimetres_on_matrices_in_si_show_as_tonnes(tmp_path: Path) -> None:
    (told,) = part_masses(machine(tmp_path, more='units = "mm"'))
    assert told.mass == pytest.approx(1e3 * np.sum(MASSES))


def test_a_part_that_its_matrices_tie_to_the_ground_tells_no_mass(tmp_path: Path) -> None:
    (told,) = part_masses(machine(tmp_path, ground=1e5))
    assert told.mass is None


@pytest.mark.parametrize("ground", [0.0, 1.0, 1e5])
def test_nothing_is_said_of_nodes_that_are_right(ground: float, tmp_path: Path) -> None:
    assert in_file(machine(tmp_path, ground=ground)) == ()


def test_places_to_a_millimetre_are_right(tmp_path: Path) -> None:
    off = np.random.default_rng(3).uniform(-1e-3, 1e-3, PLACES.shape)
    assert in_file(machine(tmp_path, at=PLACES + off)) == ()


def test_rows_one_too_far_are_named(tmp_path: Path) -> None:
    (said,) = in_file(machine(tmp_path, shift=1))
    assert said.startswith("part: nothing holds it, but its matrices are strained where it")


def test_a_node_50_mm_off_is_named(tmp_path: Path) -> None:
    (said,) = in_file(machine(tmp_path, at=PLACES + np.outer(np.eye(5)[3], [0, 0, 0.05])))
    assert said.startswith("part: nothing holds it, but its matrices are strained where it turns about")
