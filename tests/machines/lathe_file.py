"""The two masses of the library with a cut in turning, as a file of their own."""

from __future__ import annotations

from pathlib import Path

LIBRARY = Path(__file__).parents[2] / "machines" / "library"
CUT = '\n[cutting]\nprocess = "turning"\nspecific = 1e9\nfeed = "0.2 mm"\ndiameter = "80 mm"\nspeed = [2000, 9000]\n'


def lathe_file(folder: Path) -> Path:
    """``lathe.toml`` in a folder."""
    text = (LIBRARY / "two_mass.toml").read_text().replace("two_mass.joint.toml", f"{LIBRARY}/two_mass.joint.toml")
    (folder / "lathe.toml").write_text(text + CUT)
    return folder / "lathe.toml"
