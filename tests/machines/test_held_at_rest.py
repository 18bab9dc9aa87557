"""The vibration that the teeth force where very many joints depend on amplitude: these are held as at rest."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from jointlib.shown.progress import Silent
from machines import lobes_at_amplitude, read_machine
from machines.answers.told.lobes_forced import forced

JOINTS, STIFFNESS = 14, 2e6


def mill(folder: Path, law: str) -> Path:
    """A head of 20 kg on so many joints side by side, each a spring and a damper and something more."""
    rows = [
        'schema = "jointlib/machine/1"\nname = "mill"',
        '[[component]]\nname = "head"\nkind = "lumped"\ndofs = ["x", "y"]\nmass = [["20 kg", 0], [0, "20 kg"]]',
        f'stiffness = [["{STIFFNESS:g} N/m", 0], [0, "{20 * STIFFNESS:g} N/m"]]\ndamping = [[400, 0], [0, 900]]',
    ]
    for i in range(JOINTS):
        own = law.replace("2e+06", f"{2 + i / 100}e6")  # two alike would be told as one that was written twice
        rows += [f'[[connection]]\nname = "j{i}"\nbetween = ["head.x", "ground"]\njoint = {{ law = [{own}] }}']
    rows += [
        '[tool]\nx = "head.x"\ny = "head.y"\n[response]\nfrequency = [10, 800]\nforce = ["10 N"]',
        '[cutting]\nprocess = "milling"\nteeth = 3\nmode = "down"\nimmersion = 0.4\nfeed = "0.08 mm"',
        'tangential = "700 N/mm^2"\nnormal = "210 N/mm^2"\nspeed = [2000, 6000]',
    ]
    path = folder / f"mill{len(law)}.toml"
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return path


SPRING = f'{{ kind = "linear", stiffness = "{STIFFNESS:g} N/m" }}, {{ kind = "viscous", damping = 40 }}'
CUBIC = ', { kind = "cubic", stiffness3 = 1e15 }'


def test_it_is_that_of_the_springs_and_dampers_that_they_are_to_small_motions(tmp_path: Path) -> None:
    speeds, depths = np.array([2400.0, 3600.0]), (1e-4, 3e-4)
    machines = [read_machine(mill(tmp_path, law)) for law in (SPRING + CUBIC, SPRING)]
    (bent, lines, _), (straight, fewer, _) = (
        forced(one, lobes_at_amplitude(one, speeds, 0.0), depths, None, None, Silent()) for one in machines
    )
    found, known = bent["forced"], straight["forced"]
    assert found["held_at_rest"] == JOINTS
    assert "held_at_rest" not in known
    for key in ("amplitude", "surface_error"):
        assert np.asarray(found[key]) == pytest.approx(np.asarray(known[key]), rel=1e-9)
    told = f"{JOINTS} joints depend on amplitude and are held as at rest in what the teeth force"
    told += "; larger motions change it."
    assert told in lines
    assert told not in fewer
