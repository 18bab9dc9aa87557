"""Keys of a measurement file that not every kind of measurement reads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from jointlib.estimation.settings import EXCITED
from jointlib.io.toml import Section
from jointlib.measurement import CUTS, FORCES, RINGDOWN

_OF_CUT = ("process", "teeth", "mode", "immersion", "speed", "depth", "feed", "diameter", "helix")
OF_FILE: Mapping[str, Sequence[str]] = {
    "sample_rate": ("rig", "path", "static", *EXCITED, FORCES, CUTS, RINGDOWN),
    "bodies": ("rig",),
    "driven": ("rig",),
    "carriage": ("path",),
    "modal_mass": (RINGDOWN,),
    "period": ("rig", "path", "shaker"),
    "settle": ("rig", "path", "shaker"),
    "band": ("rig", "path", *EXCITED, FORCES, RINGDOWN),
    "estimate": EXCITED,
    "cutting": (FORCES, CUTS),
    "cut": (CUTS,),
}
"""The kinds that read a key at the top of a file; what is not here all read."""
OF_CHANNEL: Mapping[str, Sequence[str]] = {
    "body": ("rig",),
    "role": ("rig", FORCES),
    "dof": EXCITED,
    "transfer": (FORCES,),
}
OF_RECORD: Mapping[str, Sequence[str]] = {
    "period": ("rig", "path", "shaker"),
    "start": ("path",),
    "drive": EXCITED,
    **dict.fromkeys(_OF_CUT, (FORCES,)),
}


def refuse_elsewhere(section: Section, kind: str, places: Mapping[str, Sequence[str]]) -> None:
    """Tell the keys of a table that nobody reads in a measurement of this kind."""
    for key in [key for key, kinds in places.items() if key in section.table and kind not in kinds]:
        at = " or ".join(map(repr, places[key]))
        said = f"{key} has no place in a measurement of kind {kind!r}, expected it in one of kind {at} alone"
        section.fault(f"{said} (the mass that rides along a path is 'carriage')" if key == "bodies" else said)
