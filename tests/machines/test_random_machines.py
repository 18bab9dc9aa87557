"""The random machines that other tests lean on: what the generator promises of them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from random_machines import damped, felt_band, mutations, random_document, random_machine, tool_modes, write_random

from machines import frozen_receptance, read_machine

SEEDS = range(8)


@pytest.mark.slow
def test_a_seed_is_one_machine_of_5_to_200_contacts_held_damped_and_soft_at_its_tool(tmp_path: Path) -> None:
    counts = []
    for seed in SEEDS:
        machine = random_machine(seed)
        read = read_machine(write_random(seed, tmp_path / f"{seed}.toml"))
        assert random_document(seed) == random_document(seed)
        assert [c.name for c in read.connections] == [c.name for c in machine.connections]
        frequency, compliance = tool_modes(machine)
        assert frequency.min() > 2, "a machine that nothing holds"
        assert 1e-9 < compliance.sum() < 1e-4, "a tool that is rigid, or loose"
        counts.append(len(machine.flexible))
    assert min(counts) >= 5
    assert max(counts) <= 215
    assert max(counts) > 40


def test_its_band_holds_what_the_tool_feels_and_its_receptance_is_that_of_its_modes() -> None:
    machine = random_machine(3)
    low, high = felt_band(machine)
    frequency, compliance = tool_modes(machine)
    assert low < frequency.min()
    assert high > frequency[np.argmax(compliance)]
    still = frozen_receptance(machine, [low / 100], 0.0).receptance[0].real
    np.testing.assert_allclose(np.trace(still), compliance.sum(), rtol=2e-2)


@pytest.mark.slow
def test_mutations_differ_from_the_machine_in_the_one_thing_they_name() -> None:
    machine = random_machine(5)
    made = dict(mutations(machine, 5))
    assert len(made) >= 12
    assert made["no band"].frequency is None
    wide, narrow = made["band far too wide"].frequency, made["band too narrow"].frequency
    assert wide is not None
    assert narrow is not None
    assert wide[1] > 1e3 * narrow[1]
    bare = damped(machine, 0.0)
    lossless = frozen_receptance(replace(bare, frequency=machine.frequency), [400.0], 0.0).receptance
    assert all(c.kind != "beam" for c in bare.components), "materials keep their damping"
    assert abs(lossless.imag).max() < 1e-9 * abs(lossless).max()
