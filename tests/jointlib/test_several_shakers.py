"""Two shakers at once: what each causes is told apart, with its error, or refused where it cannot be."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from struck import Structure, declared, sampled, write_record
from test_coverage import PART, RATE, holds, random_force, within

from jointlib import InputError, read_measurement
from jointlib.estimation.estimate import estimate
from jointlib.estimation.result import Estimate

SECOND = '[[channel]]\nname = "G"\nquantity = "force"\nunit = "N"\ndof = "part.p1"\n'


def driven(
    folder: Path,
    seed: int,
    common: float = 0.0,
    noise: float = 0.02,
    samples: int = 32768,
    part: Structure = PART,
    more: str = "",
) -> Estimate:
    """Random forces at places 0 and 1, of which ``common`` is the same signal; 2 % noise on every channel."""
    rng = np.random.default_rng(seed)
    one, other, both = (random_force(samples, 1000 * seed + k) for k in range(3))
    fine = [np.sqrt(1 - common) * x + np.sqrt(common) * both for x in (one, other)]
    moved = [sampled(part, force, RATE, k) for k, force in enumerate(fine)]
    F, G, x = moved[0][0], moved[1][0], moved[0][1] + moved[1][1]
    F, G, x = (y + rng.normal(0, noise * np.std(y), y.shape) for y in (F, G, x))
    write_record(folder / "r.npz", F, x)
    with np.load(folder / "r.npz") as held:
        columns = dict(held)
    np.savez(folder / "r.npz", G=G, **columns)
    text = declared("shaker", RATE, ["r.npz"], 2, f"[estimate]\nlength = 1.0\n{more}")
    text = text.replace("sample_rate", "band = [30, 450]\nsample_rate").replace(
        "[[channel]]", SECOND + "[[channel]]", 1
    )
    (folder / "m.toml").write_text(text)
    return estimate(read_measurement(folder / "m.toml"))


@pytest.mark.thorough
def test_what_each_force_causes_is_told_apart(tmp_path: Path) -> None:
    found = driven(tmp_path, 0)
    assert {(f.response, f.drive) for f in found.frfs} == {(f"part.p{o}", f"part.p{i}") for o in (0, 1) for i in (0, 1)}
    for f in found.frfs:
        true = PART.receptance(f.frequency, int(f.response[-1]), int(f.drive[-1]))
        assert f.deviation is not None
        assert np.linalg.norm(f.deviation) < 0.1 * np.linalg.norm(true)
        assert 0.6 < np.linalg.norm(f.receptance - true) / np.linalg.norm(f.deviation) < 1.6
    assert any(
        "2 forces at once: coherence of" in said and "condition of their spectra 1." in said for said in found.notes
    )
    assert not any("reciprocal" in said for said in found.notes)


@pytest.mark.slow
@pytest.mark.parametrize("common", [0.0, 0.5])
def test_the_bound_holds_for_forces_with_and_without_a_common_part(tmp_path: Path, common: float) -> None:
    holds([within(driven(tmp_path, seed, common).frfs, PART) for seed in range(1, 21)], high=0.02)


@pytest.mark.thorough
def test_a_common_part_makes_the_errors_larger_and_is_told(tmp_path: Path) -> None:
    apart, tied = driven(tmp_path, 3), driven(tmp_path, 3, common=0.8)
    for a, b in zip(apart.frfs, tied.frfs, strict=True):
        assert a.variance is not None
        assert b.variance is not None
        assert 1.5 < np.median(b.variance / a.variance) < 5  # of a correlation of 0.8 it is 1/(1 − 0.8²)
    (said,) = (note for note in tied.notes if "forces at once" in note)
    assert 0.55 < float(said.split("with the others ")[1].split()[0]) < 0.75


@pytest.mark.thorough
def test_forces_of_one_signal_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="so what each causes cannot be told"):
        driven(tmp_path, 4, common=1.0, noise=0.002)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ('signal = "chirp"', 'expected signal = "random"'),
        ('estimator = "H2"', "estimator 'H2', expected 'H1'"),
    ],
)
def test_what_does_not_go_with_several_forces_is_refused(tmp_path: Path, more: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        driven(tmp_path, 5, samples=8192, more=more)


def test_too_few_blocks_for_the_forces_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="independent averages for 2 forces, expected more than 3"):
        driven(tmp_path, 6, samples=4096)
