"""A cutter in a holder in the simulated spindle, with a joint between shank and holder, in closed form."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from spectral_beams import BAR, BEARINGS, LINES, PLACES, SPINDLE, Bar, in_spindle, noisy, receptance

from jointlib.arrays import Array, ComplexArray
from machines import uncouple

CUTTER = (Bar(0.034, 0.0128, 560e9, 14500.0, 0.0), Bar(0.026, 0.016, 560e9, 14500.0, 0.0))
HOLDER = (Bar(0.02, 0.05, time=0.0), Bar(0.025, 0.04, time=0.0))
TRUE = {"stiffness": 9e7, "rotation": 3e4, "damping": 300.0, "rotation_damping": 0.1}
MEASURED = LINES[::3]
BEGUN = {"stiffness": 1.5e8, "rotation": 6e4, "damping": 400.0, "rotation_damping": 0.15}
TOOL = """schema = "jointlib/tool/1"
name = "16 mm"
diameter = "16 mm"
flute_length = "34 mm"
stick_out = "60 mm"
equivalent = 0.8
young = 560e9
density = 14500
poisson = 0.3

[[section]]
length = "20 mm"
diameter = "50 mm"

[[section]]
length = "25 mm"
diameter = "40 mm"

[joint]
"""


def tip(
    joint: dict[str, float], lines: Array, axis: str = "x", force: float = 1.0, cubic: float = 0.0, slip: float = 0.0
) -> ComplexArray:
    """Receptance at the tip under a peak force in N; deflections of the joint may have k3 z³ and a friction in N.

    With the first harmonic of both at the joint's amplitude, whose solution is followed from small forces on.
    """
    omega = 2 * np.pi * lines
    R = receptance(CUTTER, {}, lines)[:, [0, 4, 5]][:, :, [0, 4, 5]]
    front, rear = BEARINGS[axis]
    n = len(HOLDER)
    S = receptance([*HOLDER, *SPINDLE], {n + 1: front, n + 2: rear}, lines)[:, :2, :2]
    k = joint["stiffness"] + 1j * omega * joint["damping"]
    kt = joint["rotation"] + 1j * omega * joint["rotation_damping"]

    def moved(A: Array) -> tuple[ComplexArray, Array]:
        """The receptance, and the joint's amplitude by its gain at the amplitude A."""
        bent = k + 0.75 * cubic * A**2 + (4j * slip / np.pi / A if slip else 0.0)
        J = np.zeros((len(lines), 2, 2), dtype=complex)
        J[:, 0, 0], J[:, 1, 1] = 1 / bent, 1 / kt
        inner = np.linalg.solve(R[:, 1:, 1:] + S + J, R[:, 1:, :1])[:, :, 0]
        return R[:, 0, 0] - np.sum(R[:, 0, 1:] * inner, axis=1), np.abs(inner[:, 0] / bent) * force

    if slip:
        # Next to sticking an iteration from small to small creeps: the amplitude is bracketed instead.
        low, high = np.full(len(lines), 1e-20), np.full(len(lines), 1e-3)
        for _ in range(100):
            A = np.sqrt(low * high)
            more = moved(A)[1] > A
            low, high = np.where(more, A, low), np.where(more, high, A)
        return moved(np.sqrt(low * high))[0]
    A = np.zeros(len(lines))
    for _ in range(400 if cubic else 1):
        A = 0.5 * A + 0.5 * moved(A)[1]
    return moved(A)[0]


def written(
    folder: Path, forces: tuple[float, ...] = (1.0,), decibels: float = 60.0, seed: int = 0, **bent: float
) -> Path:
    """Machine, tool, spindle end and records of both directions; the path of the measurement file."""
    random, library = np.random.default_rng(seed), Path(__file__).parents[2] / "machines" / "library"
    for name in ("end.component.toml", "end.npz"):
        (folder / name).write_bytes((library / name).read_bytes())
    joint = "".join(f"{key} = {value}\n" for key, value in BEGUN.items())
    (folder / "cutter.tool.toml").write_text(TOOL + joint)
    (folder / "machine.toml").write_text(
        'schema = "jointlib/machine/1"\ntool = "cutter.tool.toml"\n'
        '[[component]]\nname = "spindle"\nfile = "end.component.toml"\n'
    )
    text = 'schema = "jointlib/measurement/1"\nkind = "frf"\nsimulated = true\n'
    for force in forces:
        for axis in "xy":
            value, error = noisy(tip(TRUE, MEASURED, axis, force, **bent), decibels, random)
            name = f"tip_{axis}_{force:g}.csv"
            table = np.column_stack([MEASURED, value.real, value.imag, error])
            np.savetxt(
                folder / name, table, ["%.0f", "%.8e", "%.8e", "%.2e"], ",", header="f,re,im,deviation", comments=""
            )
            text += (
                f'[[record]]\nfile = "{name}"\ndrive = "cutter.tip.{axis}"\nresponse = "cutter.tip.{axis}"\n'
                f'quantity = "receptance"\nforce = "{force:g} N"\n'
            )
    (folder / "tip.measurement.toml").write_text(text)
    return folder / "tip.measurement.toml"


def fresh_end(folder: Path, seed: int) -> None:
    """The end of the spindle, uncoupled from records of the bar with noise of their own, in place of the library's."""
    random, library = np.random.default_rng(1000 + seed), Path(__file__).parents[2] / "machines" / "library"
    (folder / "bar").mkdir()
    for axis in "xy":
        H, deviation = noisy(in_spindle(BAR, LINES, axis), 60.0, random)
        for o, d in ((0, 0), (1, 0), (1, 1)):
            table = np.column_stack([LINES, H[:, o, d].real, H[:, o, d].imag, deviation[:, o, d]])
            name = folder / "bar" / f"{PLACES[o]}_{PLACES[d]}_{axis}.csv"
            np.savetxt(name, table, delimiter=",", header="f,re,im,deviation", comments="")
    for name in ("bar.measurement.toml", "bar.component.toml"):
        (folder / name).write_bytes((library / name).read_bytes())
    files = folder / "bar.measurement.toml", folder / "bar.component.toml"
    uncouple(files[0], remove=files[1], output=folder / "end.component.toml")
