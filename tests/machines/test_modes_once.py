"""What is known once is not computed again: modes at rest, how far vectors lie apart, joints put in together."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from jointlib import Joint
from jointlib.errors import InputError
from jointlib.laws.linear import Linear
from machines import read_machine
from machines.answers.modes import modes
from machines.modes.free_vibration import InMotions
from machines.tool.coinciding import told_apart

LIBRARY = Path(__file__).parents[2] / "machines" / "library"


def test_mistakes_and_modes_share_one_decomposition(monkeypatch: pytest.MonkeyPatch) -> None:
    solved, solve = [], InMotions.solve

    def counted(*of: object) -> object:
        solved.append(of)
        return solve(*of)  # type: ignore[arg-type]

    monkeypatch.setattr(InMotions, "solve", counted)
    modes(LIBRARY / "three_joints.toml")
    assert len(solved) == 1


def test_vectors_are_told_apart_as_their_singular_values_say() -> None:
    rng = np.random.default_rng(7)
    for apart in (1e-2, 1e-6, 1.9e-8, 0.6e-8, 1e-9, 0.0):
        vectors = rng.standard_normal((80, 60)) + 1j * rng.standard_normal((80, 60))
        vectors[:, 1] = vectors[:, 0] + apart * vectors[:, 1]
        vectors /= np.linalg.norm(vectors, axis=0)
        reach = np.linalg.svd(vectors, compute_uv=False)
        assert told_apart(vectors) == (reach[-1] * 1e8 > reach[0])
    assert told_apart(np.eye(3, 1, dtype=complex))


def test_joints_put_in_together_are_those_put_in_one_after_the_other() -> None:
    machine = read_machine(LIBRARY / "three_joints.toml")
    names = [c.name for c in machine.flexible][:2]
    new = {name: Joint((Linear(1e7 * (k + 1)),)) for k, name in enumerate(names)}
    together, each = machine.with_joints(new), machine
    for name, joint in new.items():
        each = each.with_joint(name, joint)
    assert together.joints() == each.joints()
    assert [c.name for c in together.connections] == [c.name for c in machine.connections]
    with pytest.raises(InputError, match="no flexible connection 'screw_of_none'"):
        machine.with_joints({**new, "screw_of_none": Joint((Linear(1.0),))})
