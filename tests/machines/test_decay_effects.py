"""Effects in free decays that were integrated here: slip of many contacts is slip, two effects are told on the page."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from jointlib.arrays import Array
from machines.answers.trace import trace

RATE, OMEGA, RATIO, MASS = 4096.0, 2 * np.pi * 62.0, 0.003, 1.8
STIFFNESS = MASS * OMEGA**2
LARGEST = 8e-4
"""m, of the highest level."""


def decay(
    level: float,
    slip: Array,
    share: float,
    uneven: float = 0.0,
    drag: float = 0.0,
    displaced: float = 0.0,
    friction: float = 0.0,
) -> Array:
    """Displacement in m of M z̈ + c ż + d ż|ż| + e z² ż + F tanh(ż/v) + (1 − s) k z + u z³ + Σ kᵢ clip(z − sᵢ, ±slip)
    = 0, by central steps; v is 0.3 % of the largest speed.

    The sliders share ``share`` of the stiffness alike and slip at the distances ``slip`` in m.
    """
    inner, slow = 8, 3e-3 * LARGEST * OMEGA
    h = 1 / (RATE * inner)
    z, v, s = level, 0.0, np.zeros(len(slip))
    each = share * STIFFNESS / max(len(slip), 1)
    out = np.empty(8192)
    for i in range(len(out)):
        out[i] = z
        for _ in range(inner):
            z += 0.5 * h * v
            s = np.clip(s, z - slip, z + slip)
            force = (1 - share) * STIFFNESS * z + uneven * z**3 + each * float(np.sum(z - s))
            damped = 2 * RATIO * MASS * OMEGA + drag * abs(v) + displaced * z**2
            a = -(force + damped * v + friction * np.tanh(v / slow)) / MASS
            v += h * a
            z += 0.5 * h * v
    return out


def written(folder: Path, records: list[Array]) -> tuple[Path, Path]:
    """A measurement of decays with noise of 60 dB, and the linear joint that holds the mode."""
    rng = np.random.default_rng(5)
    text = f'schema = "jointlib/measurement/1"\nkind = "ringdown"\nsample_rate = {RATE}\nmodal_mass = {MASS}\n'
    text += '[[channel]]\nname = "z"\nquantity = "displacement"\nunit = "m"\n'
    for i, z in enumerate(records):
        np.savez(folder / f"{i}.npz", z=z + 1e-3 * np.max(np.abs(z)) * rng.standard_normal(len(z)) / np.sqrt(2))
        text += f'[[record]]\nfile = "{i}.npz"\ncondition = "level {i}"\n'
    (folder / "decays.measurement.toml").write_text(text)
    (folder / "mode.joint.toml").write_text(
        'schema = "jointlib/joint/1"\nname = "mode"\n'
        f'[[law]]\nkind = "linear"\nstiffness = {STIFFNESS}\n'
        f'[[law]]\nkind = "viscous"\ndamping = {2 * RATIO * MASS * OMEGA}\n'
    )
    return folder / "decays.measurement.toml", folder / "mode.joint.toml"


def traced(folder: Path, records: list[Array]) -> dict[str, object]:
    measurement, joint = written(folder, records)
    trace(measurement, joint=joint, output=folder / "out")
    assert (folder / "out" / "report.html").is_file()
    found = json.loads((folder / "out" / "trace.json").read_text("utf-8"))
    assert isinstance(found, dict)
    return found


@pytest.mark.thorough
def test_slip_of_many_contacts_is_not_named_a_contact_that_opens(tmp_path: Path) -> None:
    slip = np.geomspace(3e-5, 6e-4, 20)
    found = traced(tmp_path, [decay(level, slip, 0.08) for level in (8e-4, 4e-4, 2e-4)])
    assert found["verdict"] == "identified"
    chosen = found["chosen"]
    assert isinstance(chosen, dict)
    assert chosen["family"] == "hysteresis"
    assert found["composition"] == []


@pytest.mark.slow
def test_two_effects_of_a_decay_stand_on_its_page(tmp_path: Path) -> None:
    none = np.zeros(0)
    stiff, drag = 0.2 * STIFFNESS / 8e-4**2, 4 * RATIO * MASS * OMEGA / (8e-4 * OMEGA)
    found = traced(tmp_path, [decay(level, none, 0.0, stiff, drag) for level in (8e-4, 4e-4, 2e-4)])
    composition = found["composition"]
    assert isinstance(composition, list)
    assert {c["family"] for c in composition} == {"cubic", "quadratic-damping"}
    assert all(0.05 < c["adds"] <= 1 for c in composition)
    assert composition[0]["rivals"] == []


@pytest.mark.slow
def test_damping_by_the_square_of_displacement_gets_no_names(tmp_path: Path) -> None:
    """Drag and dry friction bend nearly as it does; a power of the amplitude with no more numbers as it does."""
    displaced = 4 * 1.5 * 2 * RATIO * MASS * OMEGA / LARGEST**2
    found = traced(tmp_path, [decay(n * LARGEST, np.zeros(0), 0.0, displaced=displaced) for n in (1, 0.5, 0.25)])
    assert found["verdict"] == "partial"
    said = re.search(r"changes with the amplitude to the power (\S+) leaves (\S+) %", str(found["sentence"]))
    assert said is not None
    assert float(said[1]) == pytest.approx(2.0, abs=0.1)
    assert float(said[2]) < 100 / 3


@pytest.mark.slow
def test_drag_and_dry_friction_keep_their_names(tmp_path: Path) -> None:
    c = 2 * RATIO * MASS * OMEGA
    drag, friction = 5 * c * 3 * np.pi / 8 / (LARGEST * OMEGA), 0.06 * c * LARGEST * OMEGA * np.pi / 4
    levels = [decay(n * LARGEST, np.zeros(0), 0.0, drag=drag, friction=friction) for n in (1, 0.5, 0.25)]
    found = traced(tmp_path, levels)
    assert found["verdict"] in ("identified", "ambiguous")
    composition, rivals = found["composition"], found["rivals"]
    assert isinstance(composition, list)
    assert isinstance(rivals, list)
    named = {one["family"] for one in (*composition, *rivals)}
    assert "quadratic-damping" in named
    assert named & {"coulomb", "stribeck"}  # the second is the first with a bump, which may be flat
    assert "power-of-amplitude" not in named


@pytest.mark.slow
def test_much_dry_friction_with_little_drag_is_no_friction_that_falls_with_speed(tmp_path: Path) -> None:
    """Half a per cent of damping by drag at 0.8 mm, where friction of 0.2 % of the spring makes 13 % below 8 µm."""
    drag, friction = 0.006 * 0.75 * np.pi * MASS / LARGEST, 0.002 * STIFFNESS * LARGEST
    levels = [decay(n * LARGEST, np.zeros(0), 0.0, drag=drag, friction=friction) for n in (1, 0.6, 0.36)]
    found = traced(tmp_path, levels)
    assert found["verdict"] in ("identified", "ambiguous")
    composition = found["composition"]
    assert isinstance(composition, list)
    assert {one["family"] for one in composition} == {"coulomb", "quadratic-damping"}
