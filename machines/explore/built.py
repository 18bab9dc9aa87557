"""A machine at one setting of its controls, and what was computed of it so far."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import CheckFailed, InputError, Outcome
from jointlib.frf import FRF, ReceptanceKind

from ..cutting.amplitude.chattering_tool import chattering, chattering_point
from ..cutting.process.chart import StabilityLobes
from ..cutting.process.cutting import Cutting
from ..cutting.rest.solve import stability_lobes
from ..cutting.rest.together import preview
from ..harmonic_balance.assembly import Assembly
from ..model.machine import Machine
from ..operating.operating_point import OpenTool, frozen_receptance, operating_point
from ..tool.at_rest import tool_at_rest
from ..tool.chatter_band import chatter_band, modes_at_rest
from ..tool.tool_model import ToolModel
from ..view import scene
from ..view.modes import modes_of
from ..view.page import data

_LINES = 500
_STATIC_LINE = 0.1
"""Hz; low enough for the receptance to be the static one, high enough for free parts."""
_MOST_WAVES = 64
"""Waves between two teeth up to which the exact methods answer while one waits."""


@dataclass(frozen=True, eq=False)
class Built:
    """A machine with all its joints, whatever it cuts; ``modal``: whether to ask for the modes of its tool point."""

    machine: Machine
    modal: bool

    @cached_property
    def band(self) -> tuple[float, float]:
        """Lowest and highest frequency in Hz."""
        found = chatter_band(self.machine)
        return found.low, found.high

    @cached_property
    def assembly(self) -> Assembly:
        """Its joints as they stand, and which of them depend on amplitude."""
        tool = tuple(self.machine.tool.values())
        return Assembly(self.machine, tool, tool)

    @cached_property
    def limits(self) -> Mapping[str, float]:
        """Largest amplitude in m at which the law of every nonlinear joint is known, by connection; inf: anywhere."""
        names = (self.machine.flexible[i].name for i in self.assembly.nonlinear)
        return {name: limit.amplitude for name, limit in zip(names, self.assembly.limits, strict=False)}

    @cached_property
    def model(self) -> ToolModel | None:
        """The tool point at rest as modes, where it is a sum of modes."""
        return modes_at_rest(self.machine) if self.modal else None

    @cached_property
    def lines(self) -> Array:
        """Lines over the band in Hz, closer where the modes at rest are."""
        low, high = self.band
        even = np.linspace(low, high, _LINES)
        if self.model is None:
            return even
        near = self.model.lines
        return np.unique(np.concatenate([even, near[(near > low) & (near < high)]]))

    @cached_property
    def rest(self) -> FRF:
        """Receptance of the tool point in m/N for small motion."""
        if self.model is None:
            return operating_point(self.machine, self.lines, 0.0).frf
        dofs = self.machine.tool_dofs
        kind = ReceptanceKind.TANGENT if self.assembly.nonlinear else ReceptanceKind.LINEAR
        return FRF(self.lines, self.model(self.lines), dofs, dofs, kind)

    @cached_property
    def static_compliance(self) -> float:
        """Yield of the tool point under a constant force in m/N, the larger of x and y.

        Of parts that only a receptance is known of, at the lowest line of all of them.
        """
        if self.model is not None:
            G = self.model(np.zeros(1))
        else:
            line = max(_STATIC_LINE, self.machine.known_band[0])
            G = frozen_receptance(self.machine, line, 0.0).receptance
        return float(np.max(np.abs(np.einsum("fii->fi", G))))

    @cached_property
    def view(self) -> Mapping[str, Any]:
        """What ``viewer.js`` draws under ``view``, None where nothing can be, and what is ``said`` of it."""
        try:
            drawn = scene(self.machine)
            modes, why = modes_of(self.machine, drawn)
        except InputError as error:
            return {"view": None, "said": f"The machine is not drawn: {error}."}
        return {"view": data(drawn, modes), "said": " ".join([*([why] if why else []), *drawn.placeless])}

    @cached_property
    def open(self) -> OpenTool:
        """The tool on the lines with its joints open."""
        return OpenTool(self.machine, self.lines)

    def moving(self, amplitude: float, cutting: Cutting | None) -> FRF:
        """The receptance with every joint frozen at a tool-point amplitude in m."""
        if amplitude == 0:
            return self.rest
        kind = ReceptanceKind.FROZEN if self.assembly.nonlinear else ReceptanceKind.LINEAR
        with np.errstate(over="ignore", invalid="ignore"):  # where nothing settles, joints are held at their limits
            if cutting is None:
                return self.open.vibrating(amplitude).frf
            G = chattering(self.open, cutting, amplitude)[0].frf.receptance
        return replace(self.rest, receptance=G, kind=kind)

    def quick_lobes(self, speeds: Array, amplitude: float, cutting: Cutting, moving: FRF) -> StabilityLobes:
        """The chart by the fast method of the process, from the modes at rest or the lines of ``moving``."""
        method = preview(cutting.process)
        if amplitude == 0:
            return stability_lobes(self.model or tool_at_rest(self.machine), cutting, speeds, method)
        return stability_lobes(moving, cutting, speeds, method, axes=self.machine.tool_axes)

    def joints_at(self, frequency: float, amplitude: float, cutting: Cutting | None) -> tuple[Mapping[str, float], str]:
        """Amplitude of every joint in m at a frequency (Hz) and tool-point amplitude (m), and what held one back."""
        if amplitude == 0:
            return {}, ""
        with np.errstate(over="ignore", invalid="ignore"):
            if cutting is None:
                point = operating_point(self.machine, frequency, amplitude)
            else:
                point = chattering_point(self.machine, cutting, frequency, amplitude)[0]
        outcome = point.outcomes[0]
        if outcome is Outcome.STALLED:
            return {}, outcome.value
        size = dict(zip((c.name for c in self.machine.flexible), point.joint_amplitude[0].tolist(), strict=True))
        return size, "" if outcome is Outcome.CONVERGED else outcome.value

    def gains(self, names: Mapping[str, str], amplitude: Array, frequency: float) -> dict[str, ComplexArray]:
        """Describing function in N/m over amplitude (m) at a frequency (Hz) of one nonlinear joint of each place.

        ``names`` tells the place of every connection.
        """
        flexible, omega = self.machine.flexible, np.full(len(amplitude), 2 * np.pi * frequency)
        first: dict[str, int] = {}
        for i in self.assembly.nonlinear:
            first.setdefault(names.get(flexible[i].name, flexible[i].name), i)
        return {
            flexible[i].name: np.asarray(self.assembly.joints[i].first_harmonic(amplitude, omega).gain)
            for i in first.values()
        }


@dataclass(frozen=True, eq=False)
class Moment:
    """One setting: a machine, what it cuts, and how far its tool point moves."""

    built: Built
    machine: Machine
    """That of `built`, cutting what was chosen."""
    amplitude: float
    """Of the tool point in m."""

    @property
    def cutting(self) -> Cutting | None:
        """The cut; None where the file has none."""
        return None if self.machine.cutting is None else Cutting(**self.machine.cutting)

    def refuse_slow(self, speed: float) -> None:
        """Raise where an exact method would take minutes at a spindle speed in rpm."""
        if self.cutting is None or self.cutting.process != "milling":
            return
        highest = self.built.band[1]
        waves = highest * 60 / (self.cutting.cuts_per_revolution * speed)
        if waves > _MOST_WAVES:
            raise CheckFailed(
                f"at {speed:g} rpm {waves:.0f} waves of {highest:.4g} Hz pass between two teeth, more than the "
                f"{_MOST_WAVES} that are followed while one waits; `jointlib lobes --speed {speed:g}` takes its time"
            )
