"""Recipe of the simulated records that ship with the guide mill: ``python -m jointlib.rig.guide_records DIR``.

The joint below is the truth the records come from. It is declared here and nowhere else: the programs that analyse
the records see the files alone.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointlib.arrays import Array
from jointlib.io.atomic import write as write_whole
from jointlib.io.atomic import write_text
from jointlib.joint import Joint
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.viscous import Viscous
from jointlib.rig.dynamic import DynamicRig, SteadyState
from jointlib.rig.excitation import multisine
from jointlib.rig.sensors import Converter, noise_level, with_noise
from jointlib.rig.static import StaticRig, push_and_pull

SEED = 20080514
TRUE_JOINT = Joint(
    (
        HertzGuide(preload=612.0, kappa=3.98071e-8),
        Viscous(damping=481.3),
        Jenkins(stiffness=3.913e7, slip_force=35.71),
    ),
    name="guide",
)
FORCES = {
    "rig_1": 21.0,
    "rig_2": 47.0,
    "rig_3": 120.0,
    "rig_4": 175.0,
    "rig_5": 175.0,
    "rig_sealed": 175.0,
}
"""Records and their root mean square shaker force in N, each with phases of its own."""
CONVERTERS = {"a1": Converter(4096.0), "a2": Converter(2048.0), "a3": Converter(2048.0), "P": Converter(1024.0)}
"""Ranges in m/s² and N; 16 bits."""
SIGNAL_TO_NOISE = 60.0
"""dB at the highest level; the sensors make the same noise at every level."""
PERIODS = 4
REACH = 7.4e-6
"""Largest set deflection of the static test, m."""


def steady_states(substeps: int = 4) -> SteadyState:
    """The rig shaken at every level, before sensors."""
    rng = np.random.default_rng([SEED, 1])
    return DynamicRig(TRUE_JOINT).steady_state([multisine(rng, rms) for rms in FORCES.values()], substeps=substeps)


def rig_records(steady: SteadyState | None = None) -> dict[str, dict[str, NDArray[np.int32]]]:
    """Counts of a1, a2, a3, P by record, the excitation-off record ``rig_quiet`` included."""
    steady, rng = steady or steady_states(), np.random.default_rng([SEED, 2])
    top = list(FORCES).index("rig_4")
    sigma = {name: noise_level(value[:, top], SIGNAL_TO_NOISE) for name, value in steady.channels.items()}
    clean = {name: {c: value[:, k] for c, value in steady.channels.items()} for k, name in enumerate(FORCES)}
    clean["rig_quiet"] = {c: np.zeros(len(value)) for c, value in steady.channels.items()}
    return {
        name: {c: CONVERTERS[c].counts(v) for c, v in with_noise(rng, channels, sigma, PERIODS).items()}
        for name, channels in clean.items()
    }


def static_record() -> tuple[Array, Array]:
    """Deflection in m and load in N of the vise test."""
    return StaticRig(TRUE_JOINT).curve(np.random.default_rng([SEED, 3]), push_and_pull(REACH, 75))


def write(folder: Path) -> None:
    """All records into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    deflection, load = static_record()
    rows = [f"{1e6 * z:.4f},{f:.2f}" for z, f in zip(deflection, load, strict=True)]
    head = "# simulated by jointlib.rig, not measured on a machine; deflection in um, load in N"
    write_text(folder / "static.csv", "\n".join([head, "deflection,load", *rows, ""]))
    for name, channels in rig_records().items():
        arrays: dict[str, Any] = {c: v.astype(np.int16) for c, v in channels.items()}
        write_whole(folder / f"{name}.npz", partial(np.savez_compressed, **arrays))


def main(arguments: Sequence[str]) -> int:
    """Command line: one folder."""
    if len(arguments) != 1:
        print("usage: python -m jointlib.rig.guide_records DIR", file=sys.stderr)
        return 2
    write(Path(arguments[0]))
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
