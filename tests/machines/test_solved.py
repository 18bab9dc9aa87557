"""Small systems side by side, of which some have no solution."""

from __future__ import annotations

import numpy as np
import pytest

from machines.solved import solve_each


@pytest.mark.parametrize("turn", [1.0, 1j])
def test_a_system_without_a_solution_leaves_its_neighbours_as_they_are(turn: complex) -> None:
    rng = np.random.default_rng(8)
    A = turn * rng.normal(size=(6, 4, 4))
    right = rng.normal(size=(6, 4, 2))
    A[1, :, 2] = 0.0
    A[3, 0, 0] = np.nan
    right[4, 1, 0] = np.inf
    found = solve_each(A, right)
    assert np.all(np.isnan(found[[1, 3, 4]]))
    for i in (0, 2, 5):
        assert np.array_equal(found[i], np.linalg.solve(A[i : i + 1], right[i : i + 1])[0])


def test_where_all_have_one_it_is_that_of_numpy() -> None:
    rng = np.random.default_rng(9)
    A, right = rng.normal(size=(5, 3, 3)), rng.normal(size=(5, 3, 1))
    assert np.array_equal(solve_each(A, right), np.linalg.solve(A, right))
    singular = np.zeros((2, 3, 3))
    assert np.all(np.isnan(solve_each(singular, right[:2])))
