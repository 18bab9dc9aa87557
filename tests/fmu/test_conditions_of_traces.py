"""What a trace of a path makes of conditions and what FMUs make of them, where they tell the same."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from prepared import prepared

from fmu.system.under_conditions import UnderConditions
from jointlib.arrays import Array
from jointlib.joint import Joint
from jointlib.law import JointLaw, Motion
from jointlib.laws.bouc_wen import BoucWen
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.cubic import Cubic
from jointlib.laws.dahl import Dahl
from jointlib.laws.iwan import Iwan
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.lugre import LuGre
from jointlib.laws.maxwell import Maxwell
from jointlib.laws.viscous import Viscous
from jointlib.loop.path.columns import kept
from jointlib.loop.path.force.followed import Followed
from jointlib.loop.path.preparation import Run
from jointlib.modulation import Modulation, held, lagged
from jointlib.parameter import Role

RATE = 2000.0
TABLE = ((0.0, 0.4), (1.0, 1.0), (3.0, 1.6))


def runs_of(folder: Path, voltages: Sequence[Array]) -> tuple[Run, ...]:
    """Records of a sine of 3 Hz and 40 µm, with a voltage beside it."""
    lines = f'schema = "jointlib/measurement/1"\nkind = "path"\nsample_rate = {RATE}\n'
    for name, quantity, unit in (("z", "displacement", "m"), ("F", "force", "N"), ("u", "voltage", "V")):
        told = "input = true\n" if name == "u" else ""
        lines += f'[[channel]]\nname = "{name}"\nquantity = "{quantity}"\nunit = "{unit}"\n{told}'
    for i, u in enumerate(voltages):
        z = 40e-6 * np.sin(2 * np.pi * 3.0 * np.arange(len(u)) / RATE)
        np.savez(folder / f"{i}.npz", z=z, F=1e5 * z, u=u)
        lines += f'[[record]]\nfile = "{i}.npz"\n'
    file = folder / "damper.measurement.toml"
    file.write_text(lines)
    return prepared(file)


def stepped(law: JointLaw, run: Run, *modulations: Modulation) -> Array:
    """The force as an FMU has it, step by step; laws that remember are stepped as sparsely as the trace does."""
    under = UnderConditions(Joint((law,), modulations=modulations))
    path = run.stepped() if law.states else run.path
    z, v = path.displacement, path.velocity
    u = run.inputs["voltage"][:: run.preparation.step if law.states else 1]
    state, behind, force = law.initial_state(z[0]), under.begun({"voltage": u[0]}), np.empty(len(z))
    for i in range(len(z)):
        motion = Motion(z[i], v[i], path.time_step)
        force[i], state, behind = under.step(motion, {"voltage": float(u[i])}, state, behind)
    return run.spread(force) if law.states else force


@pytest.mark.parametrize(
    ("law", "role"),
    [(Viscous(400.0), Role.DAMPING), (Coulomb(12.0, 1e-4), Role.SLIP_FORCE), (Cubic(1e15), Role.STIFFNESS)],
    ids=["viscous", "coulomb", "cubic"],
)
def test_without_memory_a_trace_and_an_fmu_have_one_rule(law: JointLaw, role: Role, tmp_path: Path) -> None:
    u = 1.5 + 2.0 * np.sin(2 * np.pi * 0.8 * np.arange(round(2 * RATE)) / RATE)
    runs, m = runs_of(tmp_path, [u]), Modulation(role, "voltage", 1.0, TABLE)
    told = Followed(runs).force(law, (m,))
    expected = kept(runs, [stepped(law, run, m) for run in runs])
    assert np.max(np.abs(told - expected)) <= 1e-12 * np.max(np.abs(expected))


MEMORIES = (
    (Jenkins(4e6, 20.0), Role.SLIP_FORCE),
    (Jenkins(4e6, 20.0), Role.STIFFNESS),
    (Dahl(4e6, 20.0), Role.SLIP_FORCE),
    (BoucWen(4e6, 20.0, 1.5, 0.4), Role.SLIP_FORCE),
    (LuGre(4e6, 100.0, 15.0, 20.0, 1e-3), Role.SLIP_FORCE),
    (Iwan((2e6, 2e6), (8.0, 16.0)), Role.SLIP_FORCE),
    (Maxwell(4e6, 4e4), Role.STIFFNESS),
)


@pytest.mark.parametrize(("law", "role"), MEMORIES, ids=lambda x: str(getattr(x, "kind", x)))
@pytest.mark.parametrize("second", [False, True])
def test_with_memory_as_well(law: JointLaw, role: Role, second: bool, tmp_path: Path) -> None:
    """What a law remembers stays where it is while its parameters change, in records of two lengths too."""
    t = np.arange(round(2 * RATE)) / RATE
    u = [1.5 + 2.0 * np.sin(2 * np.pi * 0.8 * t), np.where(t[:3000] < 0.7, 0.3, 2.4)][: 2 if second else 1]
    runs, m = runs_of(tmp_path, u), Modulation(role, "voltage", 1.0, TABLE)
    told = Followed(runs).force(law, (m,))
    expected = kept(runs, [stepped(law, run, m) for run in runs])
    assert np.max(np.abs(told - expected)) <= 1e-9 * np.max(np.abs(expected))


@pytest.mark.parametrize("law", [Jenkins(4e6, 20.0), Iwan((2e6, 2e6), (8.0, 16.0))], ids=lambda law: str(law.kind))
def test_two_that_act_on_one_role_multiply(law: JointLaw, tmp_path: Path) -> None:
    u = 1.5 + 1.4 * np.sin(2 * np.pi * 0.8 * np.arange(round(2 * RATE)) / RATE)
    runs = runs_of(tmp_path, [u])
    both = [
        Modulation(Role.SLIP_FORCE, "voltage", 1.0, table) for table in (TABLE, ((0.0, 1.2), (1.0, 1.0), (3.0, 0.7)))
    ]
    told = Followed(runs).force(law, tuple(both))
    expected = kept(runs, [stepped(law, runs[0], *both)])
    assert np.max(np.abs(told - expected)) <= 1e-9 * np.max(np.abs(expected))


def test_the_lag_of_a_trace_is_that_of_an_fmu_whose_steps_become_short() -> None:
    """Straight lines between samples there, held over a step here: apart by half a step."""
    apart, lag = [], 0.05
    for rate in (500.0, 1000.0, 2000.0):
        u = np.sin(2 * np.pi * 4.0 * np.arange(round(rate)) / rate)
        v = [float(u[0])]
        for x in u[1:]:
            v.append(held(float(x), v[-1], lag, 1 / rate))
        apart.append(float(np.max(np.abs(lagged(u, lag, 1 / rate) - v))))
    assert apart[0] / apart[1] == pytest.approx(2.0, rel=0.05)
    assert apart[1] / apart[2] == pytest.approx(2.0, rel=0.05)
