"""Stepped sines on a machine: where they act, where the motion is measured, at which forces and lines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.laws.hertz_guide import HertzGuide

from ..loop.forward import Answer, Forward, Points
from ..loop.noise.deviation import from_neighbours
from ..loop.records import LevelFRF
from ..model.machine import Machine
from ..tool.chatter_band import chatter_band

LEVELS = (0.05, 0.15, 0.3, 0.6, 1.0)
"""Of the top force, from which those of a test are taken."""
SEALED = 3
"""Index of the level that is measured once more for the errors before and after."""
_EVEN, _BESIDE, _WIDTH = 100, 9, 0.06
_OTHERS = 5
_OF_LIFT_OFF, _OF_RANGE = 0.8, 0.95
_SHRINKS = 12
_NOISE_OF = 0.01
_KNOWN = 0.97
"""Share of the lines that must have a motion."""


@dataclass(frozen=True, eq=False)
class Bench:
    """A machine as it is believed to be, and all that could be measured of it."""

    machine: Machine
    drive: str
    places: tuple[str, ...]
    """Degrees of freedom whose motion could be measured, the driven one first."""
    lines: Array
    """Hz."""
    top: float
    """N, peak."""
    noise: float
    """Of a line, complex rms over the rms of a response."""
    absolute: float | None
    """The same in m/N, where it was given so."""
    assumed: tuple[str, ...] = ()

    @property
    def forces(self) -> Array:
        """N, of all levels."""
        return self.top * np.array(LEVELS)

    @cached_property
    def _forward(self) -> Forward:
        return _forward(self.machine, self.lines, self.forces, self.drive, self.places)

    def responses(self, joints: Sequence[Joint]) -> ComplexArray | None:
        """m/N, (places, levels, lines), of the machine with these joints; None where many lines have no motion.

        Lines that were not found take those of their neighbours, where they are few.
        """
        moving = self._moving(joints)
        answer = self._forward.answer(joints, moving, ramp=True)
        if np.mean(answer.fine) < _KNOWN:
            return None
        # What the joints do does not depend on where the motion is measured.
        H = self._forward.everywhere(moving, answer.force).reshape(-1, len(LEVELS), len(self.lines))
        fine, at = answer.fine.reshape(H.shape[1:]), np.arange(len(self.lines))
        for n in np.flatnonzero(~np.all(fine, axis=1)):
            ok = fine[n]
            for x in H[:, n]:
                x[:] = np.interp(at, at[ok], x[ok].real) + 1j * np.interp(at, at[ok], x[ok].imag)
        return H

    def _moving(self, joints: Sequence[Joint]) -> tuple[int, ...]:
        """Those whose gain depends on amplitude, and those that differ from what the machine is believed to have."""
        changed = (i for i, (a, b) in enumerate(zip(joints, self.machine.joints(), strict=True)) if a is not b)
        return tuple(sorted({*self._forward.nonlinear, *changed}))

    def motion(self, joint: int) -> tuple[Array, Array]:
        """Amplitude in m of a joint at the top force, and rad/s, line by line."""
        z = self._top.z[:, joint]
        return np.where(self._top.fine, np.abs(z), 0.0), 2 * np.pi * self.lines

    @cached_property
    def _top(self) -> Answer:
        machine = self.machine
        forward = _forward(machine, self.lines, np.array([self.top]), self.drive, (self.drive,))
        return forward.answer(machine.joints(), tuple(range(len(machine.joints()))), ramp=True)

    @cached_property
    def believed(self) -> ComplexArray:
        """With nothing hidden."""
        found = self.responses(self.machine.joints())
        if found is None:
            raise InputError(
                f"{self.machine.where}: no response is found at up to {self.top:g} N, expected a lower --force"
            )
        return found

    @cached_property
    def sigma(self) -> Array:
        """m/N, noise of a line at every place, (places,)."""
        size = np.sqrt(np.mean(np.abs(self.believed) ** 2, axis=(1, 2)))
        return self.noise * size if self.absolute is None else np.full(len(size), self.absolute)


@dataclass(frozen=True)
class Test:
    """What is measured: some of the places, at some of the levels."""

    places: tuple[int, ...]
    levels: tuple[int, ...]

    @property
    def cost(self) -> int:
        """Responses to be measured, those at the sealed level among them."""
        return len(self.places) * (len(self.levels) + 1)

    def rows(self) -> list[tuple[int, int, bool]]:
        """(place, level, sealed) of every record."""
        return [
            (p, n, n == SEALED and n not in self.levels) for p in self.places for n in sorted({*self.levels, SEALED})
        ]


def tests(bench: Bench) -> list[Test]:
    """From the fewest responses to the most."""
    levels = (0, 2, 4), (0, 1, 2, 4)
    places = [(0,), *((0, i) for i in range(1, len(bench.places)))]
    return sorted((Test(p, n) for n in levels for p in places), key=lambda t: t.cost)


def measured(bench: Bench, H: ComplexArray, test: Test, rng: np.random.Generator) -> tuple[LevelFRF, ...]:
    """Responses with noise, whose size is then found from neighbouring lines, as of a file that does not say it."""
    out = []
    for p, n, sealed in test.rows():
        noise = rng.standard_normal((2, len(bench.lines))) * bench.sigma[p] / np.sqrt(2)
        x = H[p, n] + noise[0] + 1j * noise[1]
        deviation = from_neighbours(bench.lines, x)
        name = record_name(bench, p, n)
        out.append(
            LevelFRF(
                name, bench.drive, bench.places[p], bench.forces[n], bench.lines, x, deviation, "neighbours", sealed, ""
            )
        )
    return tuple(out)


def record_name(bench: Bench, place: int, level: int) -> str:
    """Of the response of a place at a level."""
    words = bench.places[place].replace(".", "_").replace(" ", "")
    return f"{words}_{bench.forces[level]:.3g}N"


def bench_of(machine: Machine, force: float | None, noise: float | None, absolute: float | None) -> Bench:
    """The tool is driven; how far follows from the force that is given and from what the joints bear."""
    assumed: list[str] = []
    drive = machine.drive or next(iter(machine.tool.values()), None)
    if drive is None:
        raise InputError(f"{machine.where}: neither [tool] nor drive in [response] says where a force can act")
    top = force or max(machine.force, default=0.0)
    if not top:
        raise InputError(f"{machine.where}: no force in [response], expected --force, the largest that is safe")
    band = chatter_band(machine)
    low, high = machine.frequency or (band.low, band.high)
    felt = [f for f in band.felt if low < f < high]
    near = [np.linspace((1 - _WIDTH) * f, (1 + _WIDTH) * f, _BESIDE) for f in felt]
    lines = np.unique(np.round(np.concatenate([np.geomspace(low, high, _EVEN), *near]), 3))
    lines = lines[(lines >= low) & (lines <= high)]
    lines = lines[np.concatenate([[True], np.diff(lines) > 1e-4 * lines[1:]])]
    others = [d for d in machine.dofs if d != drive]
    picked = [others[i] for i in np.unique(np.linspace(0, len(others) - 1, _OTHERS).astype(int))] if others else []
    if noise is None and absolute is None:
        assumed.append("noise of a line 40 dB below the rms of its response; give yours with --noise")
    bench = Bench(machine, drive, (drive, *picked), lines, top, noise or _NOISE_OF, absolute, ())
    for _ in range(_SHRINKS):
        share = _strain(bench)
        if share <= 1:
            break
        bench = replace(bench, top=0.9 * bench.top / min(share, 3.0))
    if bench.top < top:
        assumed.append(f"up to {bench.top:.3g} N instead of {top:g} N, as far as every joint is known to bear")
    return replace(bench, assumed=tuple(assumed))


def _strain(bench: Bench) -> float:
    """Largest motion of a joint at the top force over what it may move."""
    machine, answer = bench.machine, bench._top
    if np.mean(answer.fine) < _KNOWN:
        return 3.0
    z = np.max(np.abs(answer.z[answer.fine]), axis=0)
    return float(
        max((a / reach for a, j in zip(z, machine.joints(), strict=True) if (reach := _reach(j))), default=0.0)
    )


def _reach(joint: Joint) -> float:
    """m; 0 where nothing is known."""
    known = joint.validity.get("amplitude")
    if known is not None and known[1] > 0:
        return _OF_RANGE * known[1]
    lifts = [law.lift_off_displacement for law in joint.laws if isinstance(law, HertzGuide)]
    return _OF_LIFT_OFF * min(lifts) if lifts else 0.0


def _forward(machine: Machine, lines: Array, forces: Array, drive: str, places: tuple[str, ...]) -> Forward:
    """Every line of every force, seen at the first of the places."""
    n, f = (x.ravel() for x in np.meshgrid(range(len(forces)), lines, indexing="ij"))
    first, ones = np.zeros(len(f), dtype=np.intp), np.ones(len(f))
    points = Points(f, forces[n], first, first, first, ones.astype(complex), ones)
    return Forward.at_points(machine, points, (drive,), places)
