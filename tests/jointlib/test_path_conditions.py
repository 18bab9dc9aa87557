"""What of a path record is held out together where nobody declared conditions."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from prepared import prepared

from jointlib.arrays import Array
from jointlib.loop.path.strokes import Division, divide

RATE, SPEED = 2000.0, 0.05


def written(folder: Path, records: Mapping[str, tuple[Array, Array]]) -> Division:
    """Of records of displacement (m) and force (N) by name."""
    lines = f'schema = "jointlib/measurement/1"\nkind = "path"\ncarriage = "8 kg"\nsample_rate = {RATE}\n'
    lines += '[[channel]]\nname = "z"\nquantity = "displacement"\nunit = "m"\n'
    lines += '[[channel]]\nname = "F"\nquantity = "force"\nunit = "N"\n'
    for name, (z, force) in records.items():
        np.savez(folder / f"{name}.npz", z=z, F=force)
        lines += f'[[record]]\nfile = "{name}.npz"\n'
    file = folder / "tones.measurement.toml"
    file.write_text(lines)
    return divide(prepared(file))


def division(folder: Path, tones: tuple[float, ...], speeds: tuple[float, ...]) -> Division:
    """Of records of one tone each, in Hz, with peak speeds in m/s; the force is that of a mass of 8 kg on a spring."""
    t, records = np.arange(round(2.5 * RATE)) / RATE, {}
    for tone, speed in zip(tones, speeds, strict=True):
        w = 2 * np.pi * tone
        z = speed / w * np.sin(w * t)
        records[f"{tone:g}"] = z, (2e5 - 8.0 * w**2) * z
    return written(folder, records)


def test_tones_of_nearly_one_speed_are_told_apart_by_their_travel(tmp_path: Path) -> None:
    """Held out as one condition, three of four tones leave a single one to find mass, spring and damper from."""
    found = division(tmp_path, (4.0, 9.0, 17.0, 29.0), (0.6 * SPEED, SPEED, SPEED, SPEED))
    assert (found.grouped_by, len(found.conditions)) == ("travel", 4)


def test_speeds_are_conditions_where_the_travel_is_one(tmp_path: Path) -> None:
    found = division(tmp_path, (2.0, 4.0, 8.0), (SPEED / 4, SPEED / 2, SPEED))
    assert (found.grouped_by, len(found.conditions)) == ("peak speed", 3)


def test_the_few_slow_strokes_of_a_random_motion_do_not_stand_for_all_of_it(tmp_path: Path) -> None:
    """Most strokes are too short to be a block; a contest on the others alone saw 5 % of the motion of a damper."""
    rng, count = np.random.default_rng(3), round(100 * RATE)
    lines = np.fft.rfftfreq(count, 1 / RATE)
    band = np.where((lines >= 0.2) & (lines <= 4.0), 1.0, 0.0)
    z = np.fft.irfft(band * (rng.normal(size=len(lines)) + 1j * rng.normal(size=len(lines))), count)
    z *= 3e-3 / z.std()
    blocks = written(tmp_path, {"random": (z, 2e5 * z + 1e4 * np.gradient(z, 1 / RATE))}).blocks
    assert len(blocks) == 40
    assert sum(b.end - b.first for b in blocks) == blocks[-1].end - blocks[0].first
