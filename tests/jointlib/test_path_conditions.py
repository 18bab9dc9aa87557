"""What of a path record is held out together where nobody declared conditions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from prepared import prepared

from jointlib.loop.path.strokes import Division, divide

RATE, SPEED = 2000.0, 0.05


def division(folder: Path, tones: tuple[float, ...], speeds: tuple[float, ...]) -> Division:
    """Of records of one tone each, in Hz, with peak speeds in m/s; the force is that of a mass of 8 kg on a spring."""
    lines = f'schema = "jointlib/measurement/1"\nkind = "path"\ncarriage = "8 kg"\nsample_rate = {RATE}\n'
    lines += '[[channel]]\nname = "z"\nquantity = "displacement"\nunit = "m"\n'
    lines += '[[channel]]\nname = "F"\nquantity = "force"\nunit = "N"\n'
    t = np.arange(round(2.5 * RATE)) / RATE
    for tone, speed in zip(tones, speeds, strict=True):
        w = 2 * np.pi * tone
        z = speed / w * np.sin(w * t)
        np.savez(folder / f"{tone:g}.npz", z=z, F=(2e5 - 8.0 * w**2) * z)
        lines += f'[[record]]\nfile = "{tone:g}.npz"\n'
    file = folder / "tones.measurement.toml"
    file.write_text(lines)
    return divide(prepared(file))


def test_tones_of_nearly_one_speed_are_told_apart_by_their_travel(tmp_path: Path) -> None:
    """Held out as one condition, three of four tones leave a single one to find mass, spring and damper from."""
    found = division(tmp_path, (4.0, 9.0, 17.0, 29.0), (0.6 * SPEED, SPEED, SPEED, SPEED))
    assert (found.grouped_by, len(found.conditions)) == ("travel", 4)


def test_speeds_are_conditions_where_the_travel_is_one(tmp_path: Path) -> None:
    found = division(tmp_path, (2.0, 4.0, 8.0), (SPEED / 4, SPEED / 2, SPEED))
    assert (found.grouped_by, len(found.conditions)) == ("peak speed", 3)
