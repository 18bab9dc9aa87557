"""Several harmonics carried over point by point, against the curve that arc length follows."""

from __future__ import annotations

from pathlib import Path as File
from unittest.mock import patch

import numpy as np
import pytest

from jointlib.errors import Outcome
from machines import read_machine
from machines.continuation import carried, overtone_windows, overtones
from machines.continuation.arclength import Path
from machines.continuation.carried import Strayed, _Points
from machines.forced_response.response import Response, response
from machines.harmonic_balance.balance import excess
from machines.harmonic_balance.harmonics import Forces
from machines.model.limits import Limit
from machines.operating.tops import tops

LIBRARY = File(__file__).parents[2] / "machines" / "library"


def both_ways(name: str, force: list[float]) -> tuple[Response, Response]:
    """The response with points carried over, and with arc length in their place."""
    machine = read_machine(LIBRARY / name)
    drive = machine.tool_dofs[0]
    with patch.object(overtones, "pieced", wraps=overtones.pieced) as spy:
        quick = response(machine, force, drive=drive, harmonics="auto")
    assert spy.called
    with patch.object(overtones, "pieced", return_value=None):
        followed = response(machine, force, drive=drive, harmonics="auto")
    return quick, followed


def assert_same_peaks(one: Response, other: Response) -> None:
    def of(response: Response) -> dict[tuple[float, str], list[tuple[float, float]]]:
        found: dict[tuple[float, str], list[tuple[float, float]]] = {}
        for peak in response.peaks:
            found.setdefault((peak.force, peak.connection), []).append((peak.frequency, peak.amplitude))
        return found

    theirs = of(other)
    for key, peaks in of(one).items():
        for frequency, amplitude in peaks:
            nearest = min(theirs[key], key=lambda p: abs(p[0] - frequency))
            if abs(nearest[0] / frequency - 1) < 1e-4:
                assert amplitude == pytest.approx(nearest[1], rel=1e-6)
    missing = [
        (key, frequency)
        for key, peaks in theirs.items()
        for frequency, _ in peaks
        if not any(abs(f / frequency - 1) < 1e-4 for f, _ in of(one).get(key, []))
    ]
    assert not missing


@pytest.mark.slow
def test_points_carried_over_are_those_of_the_curve() -> None:
    quick, followed = both_ways("two_mass.toml", [60.0, 80.0])
    assert {b.harmonics for own in quick.branches for b in own} == {(1, 3, 5)}
    assert_same_peaks(quick, followed)
    for ours, theirs in zip(quick.frfs, followed.frfs, strict=True):
        shared = np.intersect1d(ours.frequency, theirs.frequency)
        assert len(shared) > 500
        H, G = (each.on(shared).receptance for each in (ours, theirs))
        assert pytest.approx(G, rel=1e-6, abs=1e-9 * np.max(np.abs(G))) == H


@pytest.mark.thorough
def test_where_a_branch_folds_arc_length_follows() -> None:
    with patch.object(overtone_windows, "follow", wraps=overtone_windows.follow) as spy:
        quick, followed = both_ways("two_mass.toml", [120.0])
    assert spy.called
    assert len(quick.branches[0]) == len(followed.branches[0]) > 1
    assert_same_peaks(quick, followed)


@pytest.mark.thorough
def test_arc_length_follows_where_newton_strays_and_there_alone() -> None:
    honest = carried._settled

    def straying(path: Path, force: np.ndarray, omega: np.ndarray, start: np.ndarray) -> _Points:
        near = np.abs(omega / (2 * np.pi) - 1500.0) < 20.0
        if np.any(near):
            raise Strayed(omega[near])
        return honest(path, force, omega, start)

    machine = read_machine(LIBRARY / "two_mass.toml")
    plain = response(machine, [80.0], drive=machine.tool_dofs[0], harmonics="auto")
    with (
        patch.object(carried, "_settled", straying),
        patch.object(overtone_windows, "follow", wraps=overtone_windows.follow) as spy,
        patch.object(overtones, "by_arc_length") as whole,
    ):
        pieced = response(machine, [80.0], drive=machine.tool_dofs[0], harmonics="auto")
    assert spy.called
    assert not whole.called
    assert_same_peaks(plain, pieced)
    shared = np.intersect1d(plain.frfs[0].frequency, pieced.frfs[0].frequency)
    assert len(shared) > 500
    H, G = (each.frfs[0].on(shared).receptance for each in (plain, pieced))
    assert pytest.approx(G, rel=1e-6, abs=1e-9 * np.max(np.abs(G))) == H


@pytest.mark.slow
def test_contacts_of_a_lathe_have_the_peaks_of_the_curve() -> None:
    quick, followed = both_ways("lathe.toml", [100.0])
    assert len(quick.peaks) > 400
    assert_same_peaks(quick, followed)


def test_tops_of_two_modes_between_coarse_points() -> None:
    omega = np.unique(np.concatenate([np.linspace(800, 1200, 60), 1000 + 10 * np.sinh(np.linspace(-2, 2, 21))]))

    def amplitude(w: np.ndarray) -> np.ndarray:
        return np.abs(1 / (1000**2 - w**2 + 2j * 0.01 * 1000 * w) + 0.3 / (1100**2 - w**2 + 2j * 0.01 * 1100 * w))

    found = tops(omega, amplitude(omega)[:, None], 1e-6)
    fine = np.linspace(990, 1010, 2_000_001)
    highest = fine[np.argmax(amplitude(fine))]
    first = np.argmin(np.abs(found.omega - 1000))
    assert found.sure[first]
    assert found.omega[first] == pytest.approx(highest, rel=1e-7)
    assert found.amplitude[first] == pytest.approx(np.max(amplitude(fine)), rel=1e-8)


def test_rounding_has_no_tops() -> None:
    omega = np.linspace(1.0, 2.0, 200)
    shaken = 1e-12 * np.random.default_rng(1).standard_normal(200)
    assert not len(tops(omega, np.stack([2 - omega + shaken, np.abs(shaken)], axis=1)).row)


def test_a_motion_that_is_rounding_is_not_closed_in_on_however_little_counts_as_a_rise() -> None:
    omega = np.linspace(1.0, 2.0, 200)
    still = 1e-11 * np.abs(np.random.default_rng(1).standard_normal(200))
    found = tops(omega, np.stack([1 / (1 + (omega - 1.5) ** 2), still], axis=1), still=1e-12)
    assert found.motion.tolist() == [0]


def test_a_joint_that_symmetry_holds_still_feeds_no_energy() -> None:
    z = np.array([[[1e-8, 1e-23]]], dtype=complex)
    springs = Forces(1e6 * z * np.array([1.0, np.exp(-0.3j)]), *(np.zeros((1, 1, 1, 2)),) * 2, np.abs(z[:, 0]))
    limits = [Limit(np.inf, Outcome.OUT_OF_RANGE)] * 2
    assert np.all(excess(springs, z, (1,), limits) <= 0)
    assert np.flatnonzero(excess(springs, z * np.array([1.0, 1e14]), (1,), limits) > 0).tolist() == [3]
