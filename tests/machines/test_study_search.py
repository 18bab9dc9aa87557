"""Pareto search: known fronts and optima are found; killed at any moment it ends with the same bytes."""

from __future__ import annotations

import itertools
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import search_kills
from search_kills import STUDY, Zdt

from jointlib.errors import InputError
from machines.study.factors import Factor
from machines.study.findings.verdict import judge
from machines.study.run import planned, search_all
from machines.study.search import generations, marks
from machines.study.store import Store
from machines.study.study import Study
from machines.study.study_file import read_study

pytest.importorskip("pymoo", reason="pymoo is not installed (extra optimise)")
SCRIPT = Path(search_kills.__file__)


def searched(study: Study, evaluation: Any, folder: Path, block: int = 4) -> tuple[Study, dict[str, np.ndarray]]:
    store = Store.begin(folder, {"study": "a search"}, study.total, block)
    search_all(study, store, evaluation, None, 1)
    return planned(study, folder), store.results()


@pytest.mark.slow
@pytest.mark.parametrize("power", [0.5, 2.0])
def test_a_search_finds_a_known_front(power: float, tmp_path: Path) -> None:
    """ZDT1 (convex) and ZDT2 (concave) in four variables, 2000 designs: the front is f2 = 1 − f1^p, f1 from 0 to 1.

    Forty designs spread evenly over its length of 1.5 would leave points of it a quarter of their spacing away on
    average, 0.01; half of the designs tried at random leave 0.5.
    """
    study = search_kills.study(tmp_path, 4, 2000, 40)
    study, results = searched(study, Zdt(power), tmp_path / "r", 8)
    front = judge(study, results).front
    found = np.array([[d.results["weight"], d.results["static-compliance"]] for d in front])
    f1 = np.linspace(0, 1, 500)
    true = np.stack([f1, 1 - f1**power], axis=1)
    distance = np.min(np.hypot(*(true[:, None] - found[None]).transpose(2, 0, 1)), axis=1)
    assert np.mean(distance) < 0.01
    # the area between the front and (1, 1): ∫ f1^p df1 less what steps of a fortieth cut off
    order = found[np.argsort(found[:, 0])]
    inside = np.minimum(np.append(order[1:, 0], 1.0), 1.0) - np.minimum(order[:, 0], 1.0)
    area = np.sum(inside * np.maximum(1 - order[:, 1], 0.0))
    assert 1 / (power + 1) - 0.025 < area <= 1 / (power + 1)


def test_a_search_finds_the_best_design_that_is_allowed(tmp_path: Path) -> None:
    """The least x + y with x y of at least 1/4 is 1, at (1/2, 1/2)."""

    class Sum(Zdt):
        def of(self, numbers: np.ndarray, first: int) -> dict[str, np.ndarray]:
            return {"weight": numbers.sum(axis=1), "minimum-depth": numbers.prod(axis=1)}

    limit = '[[constraint]]\nquantity = "minimum-depth"\nat_least = 0.25\n'
    search_kills.study(tmp_path, 2, 600, 30, "seed = 3\n" + limit)
    text = (tmp_path / "zdt.study.toml").read_text()
    second = '[[objective]]\nquantity = "static-compliance"\ngoal = "min"\n'
    (tmp_path / "zdt.study.toml").write_text(text.replace(second, ""))
    study, results = searched(read_study(tmp_path / "zdt.study.toml"), Sum(1.0), tmp_path / "r", 5)
    best = judge(study, results).best
    assert best is not None
    assert 1.0 <= best.results["weight"] < 1.005


@pytest.fixture
def undisturbed(tmp_path: Path) -> tuple[Path, dict[str, bytes], dict[str, np.ndarray]]:
    folder = tmp_path / "killed"
    folder.mkdir()
    study = search_kills.study(folder, 3, 230, 20)
    _, results = searched(study, Zdt(0.5), tmp_path / "whole")
    return folder, plans(tmp_path / "whole"), results


def plans(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in (folder / "plan").glob("*.npz")}


def kill_often(kills: int, workers: int, undisturbed: tuple[Path, dict[str, bytes], dict[str, np.ndarray]]) -> None:
    """Kill it at moments drawn at random after its first result, until it has been killed so often; then let it end."""
    folder, plan, results = undisturbed
    shards, rng, killed = folder / "r" / "shards", np.random.default_rng(7), 0
    words = [sys.executable, str(SCRIPT), str(folder), str(workers)]
    while killed < kills:
        before, process = len(list(shards.glob("*.npz"))), subprocess.Popen(words)
        while process.poll() is None and len(list(shards.glob("*.npz"))) <= before:
            time.sleep(0.005)
        time.sleep(rng.uniform(0.0, 0.8 / kills))
        process.send_signal(signal.SIGKILL)
        assert process.wait() == -signal.SIGKILL, "it ended before it was killed"
        killed += 1
    subprocess.run(words, check=True)
    store, _ = Store.opened(folder / "r")
    found = store.results()
    assert all(np.array_equal(found[name], values) for name, values in results.items())
    assert plans(folder / "r") == plan
    ranges = store.held()
    assert all(first[1] < then[0] for first, then in itertools.pairwise(ranges))


@pytest.mark.slow
def test_a_search_killed_at_random_moments_ends_with_the_same_bytes(undisturbed: Any) -> None:
    kill_often(3, 1, undisturbed)


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2])
def test_a_search_killed_twenty_times_ends_with_the_same_bytes(workers: int, undisturbed: Any) -> None:
    kill_often(20, workers, undisturbed)


def test_no_design_is_computed_twice(tmp_path: Path) -> None:
    """Lists of six and five: 28 of 30 combinations, the last of which the optimiser alone would hardly meet."""
    lists = '[[factor]]\npath = "a"\nvalues = [1, 2, 4, 8, 16, 32]\n'
    lists += '[[factor]]\npath = "b"\nvalues = ["u", "v", "w", "x", "y"]\n'
    path = tmp_path / "lists.study.toml"
    path.write_text(STUDY + "count = 28\npopulation = 8\n" + lists)
    study, results = searched(read_study(path), Entries(), tmp_path / "r")
    rows = {tuple(row) for row in study.numbers().tolist()}
    assert len(rows) == len(results["weight"]) == 28
    assert rows <= set(itertools.product(range(6), range(5)))
    # They crowd where they are good: shares of their variance would tell of the search.
    assert judge(study, results).sensitivity == {}


class Entries:
    """Weighs the entries of lists."""

    def numbers(self, designs: np.ndarray) -> np.ndarray:
        return designs

    def of(self, numbers: np.ndarray, first: int) -> dict[str, np.ndarray]:
        return {"weight": numbers @ [1.0, 2.0], "static-compliance": numbers @ [-1.0, 1.0]}


def test_what_does_not_exist_or_has_no_limit_does_not_stop_a_search(tmp_path: Path) -> None:
    class Holes(Zdt):
        def of(self, numbers: np.ndarray, first: int) -> dict[str, np.ndarray]:
            found = super().of(numbers, first)
            found["weight"] = np.where(numbers[:, 1] > 0.7, np.nan, found["weight"])
            found["static-compliance"] = np.where(numbers[:, 2] > 0.5, -np.inf, found["static-compliance"])
            return found

    study = search_kills.study(tmp_path, 3, 300, 30)
    study, results = searched(study, Holes(0.5), tmp_path / "r", 1)
    numbers = study.numbers()
    assert np.mean(np.isnan(results["weight"][-60:])) < 0.1 < np.mean(np.isnan(results["weight"][:30]))
    assert np.mean(numbers[-60:, 2] > 0.5) > 0.6


CASES = """
[[factor]]
path = "x"
range = [0.0, 1.0]
[[factor]]
path = "y"
role = "uncertain"
range = [0.0, 1.0]
[conditions]
material = [{ name = "steel", specific = 2e9 }, { name = "brass", specific = 1e9 }]
[[constraint]]
quantity = "minimum-depth"
at_least = 0.3
[[constraint]]
quantity = "weight"
at_most = 0.9
"""


def test_the_search_and_the_verdict_judge_alike(tmp_path: Path) -> None:
    """Means over samples of the worst of two cases; a design is allowed where no constraint is violated."""
    path = tmp_path / "cases.study.toml"
    sampling = "count = 500\npopulation = 20\nsamples = 5\nconfidence = 0.6\n"
    path.write_text(STUDY + sampling + CASES)
    study, rng = read_study(path), np.random.default_rng(2)
    assert (len(study.cases), study.repeats) == (2, 10)
    results = {name: rng.random(500 * 10) for name in ("weight", "static-compliance", "minimum-depth")}
    results["minimum-depth"] += 0.3
    results["weight"][::97] = np.nan
    losses, violations = marks(study, results)
    study_of = searched_designs(study)
    verdict = judge(study_of, results)
    allowed = np.all(violations == 0, axis=1)
    assert 0 < verdict.feasible == np.count_nonzero(allowed) < 500
    assert verdict.best is not None
    assert losses[verdict.best.number, 0] == verdict.best.results["weight"] == np.min(losses[allowed, 0])
    assert np.min(violations) == 0 < np.max(violations)


def searched_designs(study: Study) -> Study:
    from dataclasses import replace

    return replace(study, found=np.linspace(0, 1, study.count)[:, None])


def test_proposals_follow_from_seed_and_results_alone(tmp_path: Path) -> None:
    study = search_kills.study(tmp_path, 3, 60, 20)
    runs = []
    for power in (0.5, 0.5, 2.0):
        proposals, designs = generations(study), []
        designs.append(next(proposals))
        for _ in range(2):
            designs.append(proposals.send((designs[-1], Zdt(power).of(designs[-1], 0))))
        with pytest.raises(StopIteration):
            proposals.send((designs[-1], Zdt(power).of(designs[-1], 0)))
        runs.append(np.concatenate(designs))
    assert np.array_equal(runs[0], runs[1])
    assert not np.array_equal(runs[0], runs[2])
    assert np.array_equal(runs[0][:20], runs[2][:20])
    other = next(generations(search_kills.study(tmp_path, 3, 60, 20, "seed = 5")))
    assert not np.array_equal(other, runs[0][:20])


@pytest.mark.parametrize(
    ("keys", "factors", "said"),
    [
        ("count = 6", [["a", "b", "c"], [1, 2]], "the lists have 6 combinations and count is 6"),
        ("count = 10\npopulation = 20", None, "population is 20 and count 10"),
        ("count = 10", [["a"]], "no factor has anything to choose"),
        ("count = 10\npopulation = 1", None, "population is 1"),
    ],
)
def test_searches_without_sense_are_refused(keys: str, factors: Any, said: str, tmp_path: Path) -> None:
    path = tmp_path / "s.study.toml"
    lists = "".join(f'[[factor]]\nname = "f{i}"\npath = "p{i}"\nvalues = {v}\n' for i, v in enumerate(factors or []))
    path.write_text(STUDY + keys + "\n" + (lists or search_kills.FACTOR.format(i=0)))
    with pytest.raises(InputError, match=said):
        read_study(path)


def test_a_search_without_its_optimiser_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study = search_kills.study(tmp_path, 3, 60, 20)
    monkeypatch.setitem(sys.modules, "pymoo", None)
    for name in [name for name in sys.modules if name.startswith("pymoo.")]:
        monkeypatch.delitem(sys.modules, name)
    with pytest.raises(InputError, match=r"pymoo is not installed, expected pip install 'jointlib\[optimise\]'"):
        next(generations(study))


def test_lists_of_numbers_are_ordered_and_others_are_not() -> None:
    from machines.study.search import _ordered

    lists: list[tuple[list[Any], bool]] = [
        ([1, 2, 4], True),
        (["4 mm", "2 mm", "1 mm"], True),
        ([1, 4, 2], False),
        (["4 mm", "1 m"], False),
        (["a.toml", "b.toml"], False),
        ([[1.0], [2.0]], False),
        ([1, 1, 2], False),
    ]
    for values, ordered in lists:
        assert _ordered(Factor("f", "f", tuple(values))) is ordered
