"""Structural damping of parts that a machine holds."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from jointlib.errors import InputError
from machines import natural_modes, read_machine
from machines.mistakes import mistakes

LOSS = 0.002
POST = """
schema = "jointlib/machine/1"
[[component]]
name = "post"
kind = "beam"
axis = [0, 0, 1]
up = [1, 0, 0]
up_to = "3 kHz"
{held}
material = [{{ name = "steel", young = "210 GPa", poisson = 0.3, density = 7850, loss_factor = 0.002 }}]
segment = [{{ length = "1.75 m", width = "500 mm", height = "350 mm", wall = "20 mm" }}]
station = [{{ name = "foot", at = "0 mm" }}, {{ name = "middle", at = "0.9 m" }}, {{ name = "top", at = "end" }}]

[[connection]]
name = "foot"
between = ["post", "ground"]
at = [0, 0, 0]
{foot}

[tool]
x = "post.top.x"
"""
FLANGE = "rigid = true"
SPRING = 'direction = [1, 0, 0]\njoint = { law = [{ kind = "linear", stiffness = "1 N/um" }] }'


def post(folder: Path, held: str = "", foot: str = FLANGE) -> Path:
    path = folder / "post.toml"
    path.write_text(POST.format(held=held, foot=foot))
    return path


def test_a_held_part_has_its_loss_factor_in_every_mode(tmp_path: Path) -> None:
    modes = natural_modes(read_machine(post(tmp_path, 'held = ["foot"]')))
    np.testing.assert_allclose(modes.damping_ratio[:12], LOSS / 2, rtol=1e-6)  # light damping shifts no frequency


def test_without_it_slow_modes_have_less_and_it_is_said(tmp_path: Path) -> None:
    path = post(tmp_path)
    modes = natural_modes(read_machine(path))
    assert modes.damping_ratio[0] < LOSS / 20
    (said,) = [s for s in mistakes(read_machine(path)) if "loss factor" in s]
    # What is short follows from the strain energy, here all of it in the post: η/2 within the inertia of the foot.
    assert said.startswith(f"the mode at {modes.frequency[0]:.5g} Hz that the tool feels")
    assert "with the loss factors of its parts at that frequency 0.1 %" in said
    assert "bends post more slowly" in said
    assert not [s for s in mistakes(read_machine(post(tmp_path, 'held = ["foot"]'))) if "loss factor" in s]


def test_motions_of_the_whole_part_stay_undamped(tmp_path: Path) -> None:
    part = read_machine(post(tmp_path, 'held = ["foot"]', SPRING)).components[0]
    model = part.second_order()
    assert model is not None
    free = np.diag(model.stiffness) == 0
    assert np.count_nonzero(free) == 6
    assert not np.any(model.damping[free])
    assert not np.any(model.damping[:, free])
    assert np.min(np.linalg.eigvalsh(model.damping)) > -1e-9 * np.max(model.damping)


def test_several_stations_dissipate_what_their_static_shapes_strain(tmp_path: Path) -> None:
    """Low modes of the free part are strained by its stations: held at all, it loses nearly what it does when free.

    Nearly, as each mode is a static shape and some bending between stations, and each part has its own frequency.
    """
    model = read_machine(post(tmp_path, 'held = ["foot", "middle", "top"]')).components[0].second_order()
    assert model is not None
    natural = np.sqrt(np.diag(model.stiffness))
    low = (natural > 0) & (natural < 2 * np.pi * 1200)
    assert np.count_nonzero(low) == 4
    np.testing.assert_allclose(np.diag(model.damping)[low] / natural[low], LOSS, rtol=0.2)


def test_a_station_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"held has 'base', expected stations of the beam \(foot, middle, top\)"):
        read_machine(post(tmp_path, 'held = ["base"]'))
