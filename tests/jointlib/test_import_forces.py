"""Dynamometer records are imported with what is said of the cut, whatever the capitals of their headings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import jointlib
from jointlib.answers.import_records import brought_to
from jointlib.errors import InputError

FEEDS = (0.08e-3, 0.15e-3, 0.25e-3)


def turned(folder: Path) -> list[Path]:
    """Records at three feeds: Ks 2100 and 950 N/mm², edges of 45 and 60 N/mm, 2 mm deep."""
    rng, files = np.random.default_rng(5), []
    for i, feed in enumerate(FEEDS, 1):
        forces = [2e-3 * (K * feed + edge) for K, edge in ((2100e6, 45e3), (950e6, 60e3))]
        table = [np.arange(4000) / 2000, *(force + 5 * rng.normal(size=4000) for force in forces)]
        files.append(folder / f"turned_{i}.csv")
        np.savetxt(files[-1], np.stack(table, 1), delimiter=",", header="t_s,FC_N,FF_N", comments="", fmt="%.6g")
    return files


def test_forces_are_imported_and_identified_without_a_file_written_by_hand(tmp_path: Path) -> None:
    files, target = turned(tmp_path), tmp_path / "turned.measurement.toml"
    said = ["cutting.process=turning", "cutting.depth=2 mm", "cutting.speed=900", "simulated=true"]
    said += [f"record.turned_{i}.feed={1e3 * feed:g} mm" for i, feed in enumerate(FEEDS, 1)]
    brought = brought_to(files, target, "cutting-force", said)
    assert [table["role"].value for table in brought.draft.channels] == ["Fc", "Ff"]
    found = jointlib.cutting_forces(target).parameters
    for name, true in (("tangential", 2100e6), ("normal", 950e6), ("edge_tangential", 45e3), ("edge_normal", 60e3)):
        assert found[name].value == pytest.approx(true, abs=4 * found[name].standard_error)
        assert found[name].standard_error < 0.02 * true


def test_what_is_not_said_of_the_cut_is_asked_for_once(tmp_path: Path) -> None:
    said = ["cutting.process=turning", "cutting.depth=2 mm", "record.turned_1.feed=0.08 mm"]
    with pytest.raises(
        InputError, match=r"do not say speed, feed of the cut, expected --set cutting.speed=VALUE"
    ) as told:
        brought_to(turned(tmp_path), tmp_path / "x.measurement.toml", "cutting-force", said)
    assert len(told.value.sentences) == 1
