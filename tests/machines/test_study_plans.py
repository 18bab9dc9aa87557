"""Plans of a study: every combination, even spread, and sensitivities of a function whose indices are known."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

from jointlib.errors import InputError
from jointlib.io.toml import Section
from machines.study.factors import Factor
from machines.study.sampling import plan, sensitivities


def factor(**keys: Any) -> Factor:
    section = Section({"path": "component.slide.mass", **keys}, "study.toml: [[factor]] 1", Path())
    found = Factor.from_section(section)
    section.done()
    return found


def test_full_factorial_holds_every_combination_once() -> None:
    factors = [factor(values=["a", "b", "c"]), factor(range=[1.0, 2.0], levels=3), factor(values=[True, False])]
    design = plan(factors, "factorial", 0, 0)
    rows = {tuple(f.value(n) for f, n in zip(factors, numbers, strict=True)) for numbers in _numbers(factors, design)}
    assert len(design) == len(rows) == 18
    assert {row[1] for row in rows} == {1.0, 1.5, 2.0}


def _numbers(factors: list[Factor], design: np.ndarray) -> np.ndarray:
    return np.stack([f.numbers(design[:, i]) for i, f in enumerate(factors)], axis=1)


def test_latin_hypercube_meets_every_slice_once() -> None:
    design = plan([factor(range=[0.0, 1.0])] * 3, "latin-hypercube", 50, 7)
    for column in design.T:
        assert sorted(np.floor(50 * column)) == list(range(50))
    assert np.array_equal(design, plan([factor(range=[0.0, 1.0])] * 3, "latin-hypercube", 50, 7))


def test_values_keep_the_unit_of_the_file() -> None:
    preload = factor(range=["400 N", "900 N"])
    assert preload.value(float(preload.numbers(np.array(0.5)))) == "650.0 N"
    assert factor(range=[2, 8]).value(5.0) == 5.0
    assert factor(values=["4 kHz", 3]).value(0.0) == "4 kHz"
    assert preload.words(650.0) == "650 N"


@pytest.mark.parametrize(
    ("keys", "wanted"),
    [
        ({"range": ["1 mm", "100 mm"], "scale": "log"}, stats.loguniform(1.0, 100.0)),
        ({"distribution": {"kind": "normal", "mean": "3 N", "deviation": "0.5 N"}}, stats.norm(3.0, 0.5)),
        ({"distribution": {"kind": "log-normal", "median": "3 N", "deviation": 0.2}}, stats.lognorm(0.2, scale=3.0)),
        ({"range": [2.0, 5.0]}, stats.uniform(2.0, 3.0)),
    ],
)
def test_continuous_factors_follow_their_distribution(keys: dict[str, Any], wanted: Any) -> None:
    u = np.linspace(0.01, 0.99, 25)
    np.testing.assert_allclose(wanted.cdf(factor(**keys).numbers(u)), u, rtol=1e-9)


def test_sensitivities_of_the_ishigami_function_are_its_known_indices() -> None:
    """y = sin x1 + 7 sin² x2 + 0.1 x3⁴ sin x1 on (−π, π)³ (Ishigami and Homma 1990), indices in closed form."""
    design = plan([factor(range=[-np.pi, np.pi])] * 3, "sobol", 2**13, 3)
    x = -np.pi + 2 * np.pi * design
    y = np.sin(x[:, 0]) + 7 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])
    first, total = sensitivities(y, 3)
    a, b, pi4 = 7.0, 0.1, np.pi**4
    variance = a**2 / 8 + b * pi4 / 5 + b**2 * pi4**2 / 18 + 0.5
    alone = np.array([0.5 * (1 + b * pi4 / 5) ** 2, a**2 / 8, 0.0]) / variance
    together = 8 * b**2 * pi4**2 / 225 / variance
    np.testing.assert_allclose(first, alone, atol=0.01)
    np.testing.assert_allclose(total, alone + together * np.array([1, 0, 1]), atol=0.01)


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({}, "no values given"),
        ({"values": [1], "range": [1, 2]}, "values and range given"),
        ({"values": []}, "expected a list of at least one value"),
        ({"range": [3.0, 3.0]}, "range from 3 to 3 is empty"),
        ({"range": ["1 mm", "2 m"]}, "units 'mm' and 'm' differ"),
        ({"range": [1.0]}, r"expected \[low, high\]"),
        ({"range": [-1.0, 2.0], "scale": "log"}, "-1 has no logarithm"),
        ({"distribution": {"kind": "normal", "mean": 1.0, "deviation": 0.0}}, "deviation is 0"),
        ({"distribution": {"kind": "cauchy"}}, "kind is 'cauchy'"),
        ({"range": [1.0, float("nan")]}, "expected a finite number"),
        ({"range": [1, 2], "rnage": 3}, "rnage"),
    ],
)
def test_factors_without_sense_are_refused(keys: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        factor(**keys)


def test_a_single_factor_explains_everything() -> None:
    u = plan([factor(range=[0, 1])], "sobol", 64, 0)[:, 0]
    first, total = sensitivities(np.sin(3 * u), 1)
    assert (first.shape, total.shape) == ((1,), (1,))
    assert float(first[0]) == pytest.approx(1.0, abs=0.05)
    assert float(total[0]) == pytest.approx(1.0, abs=0.05)


def test_the_deviation_of_a_logarithm_has_no_unit() -> None:
    with pytest.raises(InputError, match="deviation has the unit 'N', expected a number: it is that of the logarithm"):
        factor(distribution={"kind": "log-normal", "median": "3 N", "deviation": "1 N"})


def test_plans_without_sense_are_refused() -> None:
    with pytest.raises(InputError, match="power of two"):
        plan([factor(range=[1, 2])], "sobol", 1000, 0)
    with pytest.raises(InputError, match="a list or levels"):
        plan([factor(range=[1, 2])], "factorial", 0, 0)
    with pytest.raises(InputError, match="100,000,000 configurations"):
        plan([factor(range=[1, 2], levels=100)] * 4, "factorial", 0, 0)
