"""Forced response of a machine with nonlinear joints: branches, receptance per force, refined peaks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError, Outcome, nearest
from jointlib.frf import FRF
from jointlib.shown.pictures import axes_of, draw_magnitude, literal, name_curves, shades
from jointlib.shown.progress import Progress, Silent
from jointlib.shown.result import Columns, Shown, package

from ..bundles.bundle import said_by
from ..continuation.overtones import Overtones, refined
from ..harmonic_balance.assembly import Assembly
from ..model.limits import beyond_frequency
from ..model.machine import Machine, checked_forces, checked_range
from ..operating.branches import Branch, Stability
from ..operating.peaks import Peak
from ..operating.resonances import known_between
from ..stability.disturbances import AFFORDABLE, Disturbances
from ..stability.labels import held_means, with_errors, with_held_forces
from ..stability.perturbations import labelled, nothing_stable, of_peaks, with_stability
from ..statics.statics import static_point
from ..tool.chatter_band import chatter_band, frequency_range
from ..tool.tool_model import around
from .methods import AmplitudeMap, ArcLength, Newton, in_one_harmonic, unmoved

_POINTS = 600
_FEW = 50
"""Lines for which poles of the whole machine do not pay."""


@dataclass(frozen=True, eq=False, repr=False)
class Response(Shown):
    """What a harmonic force on ``drive`` does; tuples have one entry per force.

    Phasors are peak values with time factor e^(+jωt), their phase relative to the force.
    """

    drive: str
    force: tuple[float, ...]
    """N, peak."""
    connections: tuple[str, ...]
    outputs: tuple[str, ...]
    branches: tuple[tuple[Branch, ...], ...]
    frfs: tuple[FRF, ...]
    """Receptance from ``drive`` to ``outputs`` on the smallest solution of each line, the one that a force raised
    from rest at fixed frequency reaches; nan where no admissible solution exists."""
    outcomes: tuple[Outcome, ...]
    """CONVERGED, or what kept the solution at some line from being used."""
    peaks: tuple[Peak, ...]
    """One per force, connection and resonance."""
    warnings: tuple[str, ...] = ()
    """What bears on the result, a sentence each."""
    turned: frozenset[str] = frozenset()
    """Connections whose motion is an angle in rad."""

    @property
    def deflected(self) -> tuple[Peak, ...]:
        """Known peaks of displacements, which alone compare in size; of angles where no joint gives way otherwise."""
        known = tuple(p for p in self.peaks if np.isfinite(p.amplitude))
        return tuple(p for p in known if p.connection not in self.turned) or known

    def peaks_of(self, connection: str, force: float) -> tuple[Peak, ...]:
        """Peaks of one connection at one force in N, ascending in frequency."""
        return tuple(p for p in self.peaks if p.connection == connection and p.force == force)

    def finding(self) -> str:
        """The largest relative motion in a joint, and what kept a solution from being used."""
        count, low, high = len(self.force), min(self.force), max(self.force)
        sizes = f"{count} forces of {low:g} to {high:g}" if count > 3 else ", ".join(f"{f:g}" for f in self.force)
        said = f"{sizes} N on {self.drive}"
        if self.deflected:
            top = max(self.deflected, key=lambda p: p.amplitude)
            unit = "µrad" if top.connection in self.turned else "µm"
            said += f"; {top.connection} moves most, {top.amplitude * 1e6:.4g} {unit} at {top.frequency:.5g} Hz"
            said += f" under {top.force:g} N" if len(self.force) > 1 else ""
        outcome = next((o for o in self.outcomes if o is not Outcome.CONVERGED), Outcome.CONVERGED)
        return f"{said}\n{outcome.value}".strip()

    def columns(self) -> Columns:
        """A row per peak of a joint."""
        return {
            "force": ([p.force for p in self.peaks], "N"),
            "connection": ([p.connection for p in self.peaks], ""),
            "frequency": ([p.frequency for p in self.peaks], "Hz"),
            "amplitude": ([p.amplitude for p in self.peaks], "m"),
            "width": ([p.width for p in self.peaks], "Hz"),
            "stability": ([p.stability.value for p in self.peaks], ""),
            "outcome": ([p.outcome.name.lower() for p in self.peaks], ""),
        }

    def to_xarray(self) -> Any:
        """The receptance from ``drive`` in m/N over force, frequency and output as an xarray DataArray.

        Lines are those of all forces together; on lines that a force was not solved at it is nan.
        """
        xarray = package("xarray", "to_xarray")
        lines = np.unique(np.concatenate([frf.frequency for frf in self.frfs]))
        H = np.full((len(self.force), len(lines), len(self.outputs)), np.nan + 0j)
        for own, frf in zip(H, self.frfs, strict=True):
            own[np.searchsorted(lines, frf.frequency)] = frf.receptance[:, :, 0]
        places = {
            "force": xarray.Variable("force", list(self.force), {"units": "N"}),
            "frequency": xarray.Variable("frequency", lines, {"units": "Hz"}),
            "output": list(self.outputs),
        }
        about = {"units": "m/N", "drive": self.drive}
        return xarray.DataArray(H, places, ("force", "frequency", "output"), "receptance", about)

    def plot(self, ax: Any = None, output: str | None = None) -> Any:
        """|x/F| of an output (default: where the force acts) in µm/N, all branches; broken where motion leaves them."""
        axes = axes_of(ax)
        shown = output or (self.drive if self.drive in self.outputs else self.outputs[0])
        if shown not in self.outputs:
            raise InputError(f"plot: no output {shown!r}, {nearest(shown, self.outputs)}")
        o = self.outputs.index(shown)
        for force, branches, colour in zip(self.force, self.branches, shades(len(self.force)), strict=True):
            for i, (branch, style) in enumerate(styled(branches)):
                name = f"{force:g} N" if i == 0 else None
                H = branch.output[:, o] / force
                draw_magnitude(axes, branch.frequency, H, color=colour, linestyle=style, label=name)
        title = literal(f"{shown} per force on {self.drive}")
        axes.set(xlabel="frequency [Hz]", ylabel="|x/F| [µm/N]", title=title)
        name_curves(axes)
        return axes


def styled(branches: Sequence[Branch]) -> list[tuple[Branch, str]]:
    """Branches with the line they are drawn in: broken where no slowly swept test would stay."""
    return [(branch, "--" if branch.stability is Stability.UNSTABLE else "-") for branch in branches]


def response(
    machine: Machine,
    force: float | Sequence[float] | None = None,
    frequency: Sequence[float] | Array | None = None,
    drive: str | None = None,
    method: AmplitudeMap | Newton | ArcLength | None = None,
    *,
    outputs: Sequence[str] | None = None,
    points: int = _POINTS,
    harmonics: int | str | Sequence[int] = 1,
    stability: str = "folds",
    progress: Progress | None = None,
) -> Response:
    """Steady response to harmonic forces, each joint replaced by its describing function at its own amplitude.

    Nonlinear receptance coupling (Dhupia et al. 2008, eqs 17–20) in the form z + Hzz g(z) = Hzf F, exact from an
    open joint to a rigid one. Every point carries an estimate of the error made by leaving out further harmonics.

    Parameters
    ----------
    machine
        Every connection must have its joint.
    force
        Peak forces in N; default: those of the file.
    frequency
        [low, high] in Hz, laid out with ``points`` lines and refined round the peaks; or more than two ascending
        lines, which are used as they are. Default: the range of the file.
    drive
        Degree of freedom the force acts on; default: that of the file, else the tool's x, else y.
    method
        `AmplitudeMap`, `ArcLength` or `Newton`; default: the map where one joint is nonlinear at most, arc length over
        a range where there are several, Newton's method on given lines.
    outputs
        Degrees of freedom of the receptances; default: the tool's and ``drive``.
    harmonics
        1; ascending multiples of the frequency such as (1, 3, 5), by arc length; or "auto": further harmonics at those
        forces at which the estimated error of the first exceeds 0.1 % somewhere. Under a static load the mean is solved
        for beside them; it may be named, (0, 1, 2, 3).
    stability
        "folds"; "hill": what small disturbances do as well, where there are equations of motion: by Hill's method in
        one harmonic of joints that do not remember, else by the step of the laws over a cycle; "auto": that where it
        takes some ten seconds at most, for the peaks alone where every point would take longer.
    progress
        Told of every part that takes long.
    """
    during = progress or Silent()
    wanted = Overtones.of(harmonics, machine.static is not None)
    if stability not in ("folds", "hill", "auto"):
        raise InputError(f"response: stability is {stability!r}, expected 'folds', 'hill' or 'auto'")
    driven = machine.driven_dof(drive)
    forces = _forces(machine, force)
    lines, refine = _lines(machine, frequency, points)
    names = tuple(dict.fromkeys([*machine.tool.values(), driven] if outputs is None else outputs))
    low, high = 2 * np.pi * float(lines[0]), 2 * np.pi * float(lines[-1])
    assembly = Assembly(machine, names, (driven,), (low, high) if len(lines) > _FEW else None)
    found = in_one_harmonic(assembly, forces, lines, refine, method, during)
    points = sum(len(b.frequency) for part in found for b in part.branches)
    with during.step(f"estimating what further harmonics change at {points} points"):
        estimated = with_errors(assembly, forces, [part.branches for part in found])
    found, remarks = refined(assembly, forces, lines, found, estimated, wanted, during)
    if not known_between(assembly, lines):
        remarks = ("a part is known on the lines only, so peaks are the largest values on them", *remarks)
    connections = tuple(c.name for c in machine.flexible)
    with during.step("estimating what forces change that sliders may hold"):
        branches = labelled(with_held_forces(assembly, forces, [part.branches for part in found]))
    remarks = (*remarks, *held_means(driven, forces, branches))
    if stability != "folds" and connections:
        disturbed = Disturbances.of(machine)
        if isinstance(disturbed, str):
            remarks = (*remarks, disturbed) if stability == "hill" else remarks
        else:
            most = AFFORDABLE if stability == "auto" else np.inf
            with during.step("looking at what small disturbances do"):
                branches, said = with_stability(branches, [part.peaks for part in found], connections, disturbed, most)
            remarks = (*remarks, *([said] if said else []), *nothing_stable(forces, branches))
    peaks = [p for part, own in zip(found, branches, strict=True) for p in of_peaks(part.peaks, own, connections)]
    still = unmoved(machine, driven, (b for part in found for b in part.branches))
    by_modes = chatter_band(machine).said if frequency is None and machine.frequency is None else ()
    return Response(
        driven,
        tuple(forces.tolist()),
        connections,
        names,
        tuple(branches),
        tuple(part.frf for part in found),
        tuple(part.outcome for part in found),
        tuple(sorted(peaks, key=lambda p: p.force)),
        (*_warnings(machine, float(lines[0]), float(lines[-1])), *by_modes, *still, *remarks),
        frozenset(c.name for c in machine.flexible if c.rotates),
    )


def _warnings(machine: Machine, low: float, high: float) -> tuple[str, ...]:
    under_load = () if machine.static is None else static_point(machine).warnings
    return (*beyond_frequency(machine, low, high), *said_by(machine.joints()), *under_load)


def _forces(machine: Machine, force: float | Sequence[float] | None) -> Array:
    given = machine.force if force is None else np.atleast_1d(np.asarray(force, dtype=float)).tolist()
    checked = checked_forces(given, "response")
    if not checked:
        raise InputError(f"{machine.where}: no force is given, expected force in [response] or as an argument")
    return np.array(checked)


def _own_modes(machine: Machine) -> Array:
    """Lines in Hz round the modes of a tool without a joint, of which no peak of a joint tells; none without modes."""
    if machine.flexible or not machine.tool:
        return np.zeros(0)
    try:
        model = chatter_band(machine).model
    except InputError:
        model = None
    return np.zeros(0) if model is None else around(model.poles) / (2 * np.pi)


def _lines(machine: Machine, frequency: Sequence[float] | Array | None, points: int) -> tuple[Array, bool]:
    """The lines in Hz, and whether more may be added."""
    given = frequency_range(machine) if frequency is None else frequency
    values = np.asarray(given, dtype=float)
    if values.shape == (2,):
        low, high = checked_range(values.tolist(), "response")
        if points < 2:
            raise InputError(f"response: points is {points}, expected at least 2")
        lines = np.linspace(low, high, points)
        near = _own_modes(machine)
        return np.union1d(lines, near[(near > low) & (near < high)]), True
    if values.ndim != 1 or len(values) == 0 or not np.all(np.isfinite(values)):
        raise InputError("response: frequency must be [low, high] or ascending lines in Hz, finite")
    if values[0] <= 0 or np.any(np.diff(values) <= 0):
        raise InputError("response: lines of frequency must be positive and ascending")
    return values, False
