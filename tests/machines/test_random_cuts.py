"""What the verb says of random cuts is true in time: knocks, feed, loss of contact, joints with memory."""

from __future__ import annotations

import os
from dataclasses import replace

import numpy as np
import pytest
from random_cuts import Cut, Fate, fates, judged, machine

from machines.lobes import amplitude_limits


@pytest.mark.thorough
def test_sentences_are_read_as_fates() -> None:
    made = machine(np.random.default_rng(0), False)
    limits = amplitude_limits(made, [3000.0], [1e-6, 1e-5, 1e-4])
    reach = float(limits.known[0])
    cut = Cut(made, limits, 0.5e-3, ("At 3000 rpm and 0.5 mm vibrations of up to 100 µm at the tool die out.",))
    assert fates(cut) == [Fate(0.0, pytest.approx(1e-4), "dies")]
    said = (
        "At 3000 rpm every vibration of up to 40 µm at the tool dies out below 0.7 mm.",
        "At 3000 rpm and 0.5 mm vibrations below 20 µm at the tool die out, larger ones settle at 60 µm (80.0 Hz), a "
        "knock beyond 90 µm makes it grow beyond 100 µm.",
    )
    assert fates(replace(cut, said=said)) == [
        Fate(0.0, pytest.approx(4e-5), "dies"),
        Fate(0.0, pytest.approx(2e-5), "dies"),
        Fate(pytest.approx(2e-5), pytest.approx(9e-5), pytest.approx(6e-5)),
        Fate(pytest.approx(9e-5), np.inf, "grows"),
    ]
    said = (
        "At 3000 rpm and 0.5 mm, beside the 3 µm that the teeth force, chatter starts by itself and settles at 12 µm "
        "(80.0 Hz), looked at up to 100 µm.",
    )
    assert fates(replace(cut, said=said)) == [Fate(0.0, np.inf, pytest.approx(1.2e-5))]
    said = ("At 3000 rpm and 0.5 mm, above a lens, the smallest vibrations grow; what becomes of larger ones is not.",)
    assert fates(replace(cut, said=said)) == [Fate(0.0, pytest.approx(0.03 * reach), "lasts")]


@pytest.mark.slow
def test_sentences_about_a_few_random_cuts_hold_in_a_simulation_of_its_own() -> None:
    told, wrong = judged(2, seed=3)
    assert told == 2
    assert wrong == []


@pytest.mark.slow
def test_of_random_cuts_at_most_one_in_fifty_is_told_something_that_is_not_so() -> None:
    count = int(os.environ.get("JOINTLIB_CUTS", "40"))
    told, wrong = judged(count)
    assert told >= 0.9 * count
    assert len(wrong) <= 0.02 * count, "\n".join(wrong)
