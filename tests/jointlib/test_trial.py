"""Normal equations of a contest, against numpy's least squares."""

from __future__ import annotations

import numpy as np

from jointlib.loop.trial import solve


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
