"""Newton's method over a range with arc length in windows, against arc length over the whole range."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_several_joints import GUIDE, chain

import machines.continuation.fold_windows
from jointlib.errors import Outcome
from machines import ArcLength, Response, response
from machines.operating.branches import End, Stability

BAND = [1100.0, 1350.0]


def shape(found: Response) -> list[tuple[Stability, tuple[End, End]]]:
    return [(b.stability, b.ends) for b in found.branches[0]]


def ends(found: Response) -> list[float]:
    return [float(f) for b in found.branches[0] for f in b.frequency[[0, -1]]]


@pytest.mark.slow
@pytest.mark.parametrize("force", [35.0, 75.0])
def test_windows_find_the_branches_that_arc_length_finds(force: float) -> None:
    """At 35 N five joints fold over; at 75 N one reaches its limit on both flanks."""
    machine = chain(10, 5)
    found = response(machine, force, BAND, points=60)
    whole = response(machine, force, BAND, points=60, method=ArcLength())
    assert shape(found) == shape(whole)
    assert ends(found) == pytest.approx(ends(whole), rel=1e-6)
    assert found.outcomes == whole.outcomes
    for k in range(5):
        a, b = (max(p.amplitude for p in r.peaks_of(f"j{k + 1}", force)) for r in (found, whole))
        assert a == pytest.approx(b, rel=1e-6)
    own = found.frfs[0]
    common = np.intersect1d(own.frequency, whole.frfs[0].frequency)
    H, other = (f.receptance[np.isin(f.frequency, common), 0, 0] for f in (own, whole.frfs[0]))
    assert len(common) >= 60
    assert np.max(np.abs(H - other)) < 1e-7 * np.max(np.abs(other))


def test_nothing_is_followed_where_nothing_folds(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError("arc length was called")

    monkeypatch.setattr(machines.continuation.fold_windows, "by_arc_length", refuse)
    found = response(chain(10, 5), 10.0, [1000.0, 3000.0], points=200)
    (branch,) = found.branches[0]
    assert branch.ends == (End.RANGE, End.RANGE)
    assert found.outcomes == (Outcome.CONVERGED,)


@pytest.mark.thorough
def test_only_a_window_round_the_fold_is_followed(monkeypatch: pytest.MonkeyPatch) -> None:
    followed = []
    genuine = machines.continuation.fold_windows.by_arc_length

    def watched(*given):  # type: ignore[no-untyped-def]
        followed.append(given[2])
        return genuine(*given)

    monkeypatch.setattr(machines.continuation.fold_windows, "by_arc_length", watched)
    found = response(chain(10, 5), 35.0, [1000.0, 3000.0], points=400)
    assert len(found.branches[0]) == 3
    assert 0 < max(lines[-1] - lines[0] for lines in followed) < 100.0


@pytest.mark.thorough
def test_branches_are_in_one_piece_across_the_edges_of_a_window() -> None:
    machine = chain(10, 5).with_joint("j4", replace(GUIDE, validity={"amplitude": (0.0, 3e-6)}))
    found = response(machine, 35.0, BAND, points=60)
    assert found.outcomes == (Outcome.OUT_OF_RANGE,)
    for branch in found.branches[0]:
        assert np.all(np.diff(branch.frequency) > 0)
        edges = [f for f, end in zip(branch.frequency[[0, -1]], branch.ends, strict=True) if end is End.RANGE]
        assert all(f in BAND for f in edges)
    limits = [np.max(np.abs(b.joint[i, 3])) for b in found.branches[0] for i in (0, -1) if b.ends[i] is End.LIMIT]
    assert limits == pytest.approx([3e-6] * len(limits), rel=1e-8)
    assert limits


def test_a_resonance_between_two_lines_is_resolved_before_anything_is_followed() -> None:
    """Sixty lines over 6 kHz miss peaks of 10 Hz; halving by the tangents finds what a dense grid shows."""
    machine = chain(10, 5)
    found = response(machine, 5.0, [1000.0, 7000.0], points=60)
    dense = response(machine, 5.0, np.linspace(1000.0, 7000.0, 3000))
    tops = sorted(dense.peaks_of("j2", 5.0), key=lambda p: -p.amplitude)[:3]
    for top in tops:
        near = min(found.peaks_of("j2", 5.0), key=lambda p: abs(p.frequency - top.frequency))
        assert near.amplitude == pytest.approx(top.amplitude, rel=1e-6)
