"""Machine files of drawn mills: as the shop's file tells one, and as it is, for the border that its cuts meet."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

from cut_shop import DAMPING_ERROR, FREQUENCY_ERROR, Campaign, Mill

from machines import lobes_at_amplitude, read_machine
from machines.model.machine import Machine

OF_AMPLITUDE = ("joint-slip", "run-out")
"""Effects by which the border hangs on how far the tool moves."""


def machine_of(c: Campaign) -> Machine:
    """The machine file of a campaign, read."""
    frequency, ratio = ([float(mode[i]) for mode in c.told.modes] for i in (1, 2))
    known = f"frequency_error = {[FREQUENCY_ERROR * f for f in frequency]}\n"
    known += f"damping_ratio_error = {[DAMPING_ERROR * z for z in ratio]}\n"
    return _read(c.told, c.told.modes, known, f"speed = [{0.9 * min(c.speeds)}, {1.1 * max(c.speeds)}]\n")


def border(mill: Mill, speed: float) -> float:
    """m, the depth from which on the mill as it is chatters from rest at a speed in rpm, by collocation."""
    soft = [*mill.softens, *[0.0] * (len(mill.modes) - len(mill.softens))]
    modes = [(axis, f * (1 - s * speed / 1e4), z, m) for (axis, f, z, m), s in zip(mill.modes, soft, strict=True)]
    machine = _read(mill, modes, "", f"process_damping = {mill.rubbing}\n" if mill.rubbing else "")
    return float(lobes_at_amplitude(machine, [speed], 0.0, "collocation").depth[0])


def _read(mill: Mill, modes: Sequence[tuple[int, float, float, float]], known: str, cut: str) -> Machine:
    text = f"""
schema = "jointlib/machine/1"
name = "mill"
[[component]]
name = "cutter"
kind = "modal"
dofs = ["x", "y"]
frequency = {[float(mode[1]) for mode in modes]}
damping_ratio = {[float(mode[2]) for mode in modes]}
modal_mass = {[float(mode[3]) for mode in modes]}
shapes = {[[float(mode[0] == axis) for mode in modes] for axis in (0, 1)]}
{known}[tool]
x = "cutter.x"
y = "cutter.y"
[cutting]
process = "milling"
teeth = {mill.teeth}
mode = "{mill.direction}"
immersion = {mill.immersion}
tangential = {mill.tangential}
normal = {mill.normal}
diameter = {mill.diameter}
feed = {mill.feed}
{cut}"""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "machine.toml").write_text(text)
        return read_machine(Path(folder) / "machine.toml")
