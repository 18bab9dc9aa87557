"""Normal equations of a contest, against numpy's least squares."""

from __future__ import annotations

import numpy as np
import pytest

from jointlib.loop.contest.model import Model, prediction_error
from jointlib.loop.contest.rivals import score
from jointlib.loop.contest.trial import solve, trial


def test_columns_of_very_different_size_are_solved_like_least_squares() -> None:
    rng = np.random.default_rng(3)
    X = rng.standard_normal((4, 500)) * np.array([1.0, 1e9, 1e-9, 1e3])[:, None]
    y = rng.standard_normal(500)
    exact = np.linalg.lstsq((X / np.linalg.norm(X, axis=1)[:, None]).T, y, rcond=None)[0] / np.linalg.norm(X, axis=1)
    np.testing.assert_allclose(solve(X @ X.T, X @ y), exact, rtol=1e-9)


def test_a_column_of_one_record_keeps_its_coefficient_where_that_record_is_left_out() -> None:
    rng = np.random.default_rng(4)
    everywhere, own = rng.standard_normal(400), np.r_[np.zeros(300), rng.standard_normal(100)]
    X, y = np.array([everywhere, own]), rng.standard_normal(400)
    whole, G, b = np.diag(X @ X.T), X[:, :300] @ X[:, :300].T, X[:, :300] @ y[:300]
    # Rounding leaves such a column a little more or less than nothing.
    for rounding in (0.0, 1e-30, -1e-30):
        found = solve(G + rounding * np.ones((2, 2)), b + rounding, whole)
        assert found[1] == 0.0
        np.testing.assert_allclose(found[0], everywhere[:300] @ y[:300] / (everywhere[:300] @ everywhere[:300]))


@pytest.mark.parametrize("apart", [1e-3, 3e-5, 1e-6])
def test_what_a_record_has_of_its_own_lends_it_nothing_while_it_is_left_out(apart: float) -> None:
    """A stiffness, a damping and a drift in each record, beside the two of all records that they imitate."""
    parts, t = tuple(slice(i, i + 100) for i in (0, 100, 200, 300)), np.tile(np.linspace(0, 1, 100), 4)
    for seed in range(20):
        rng = np.random.default_rng(seed)
        stiffness, damping, y = rng.standard_normal((3, 400))
        own = []
        for part in parts:
            here = (np.arange(400) >= part.start) & (np.arange(400) < part.stop)
            own += [(c + apart * rng.standard_normal(400)) * here for c in (stiffness, damping)] + [
                stiffness * t * here
            ]
        model = Model(y, np.array([stiffness, damping, *own]), parts, 400)
        left = prediction_error(model)
        assert left @ left < 1.1 * (y @ y)
        noise = trial(model, {}, rng.standard_normal((1, 400)), joint_only=False)
        assert noise is not None
        assert abs(score(model, "noise", [noise], 1).gain) < 0.05 * (y @ y)
