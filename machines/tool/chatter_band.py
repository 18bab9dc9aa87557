"""Where chatter is looked for: the frequencies that the modes of the tool need, whatever band somebody typed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError

from ..components.mode_sum import modes
from ..coupling.second_order import machine_equations
from ..coupling.state_equations import machine_states
from ..harmonic_balance.assembly import Assembly
from ..indices import Mask
from ..model.machine import Machine
from ..statics.working_point import tangents
from .machine_model import OpenJoints
from .plausible import refuse_undamped
from .tool_model import ToolModel, Undamped, around

_FELT = 0.05
"""Share of the highest peak, or of the static compliance, from which on the tool feels a mode."""
_BEYOND = 3.0
"""Times below the lowest and above the highest mode that the tool feels up to which is looked."""
_WIDTHS = 1.0
"""Times |Re s| beside a mode within which it may chatter."""
_OSCILLATING = 1e-6
_STIFF = 1e12
"""N/m in place of a joint that is rigid at rest, where only the order of frequencies counts."""
_SAME = 1e-6
"""Of the largest receptance; the rounding of a decomposition costs less."""
_COMPARED = 7
_HIGHEST = 1e9
"""Hz; a wave of sound in steel is a few micrometres long there."""
_LINES = 600
_FIRST_GUESS = 100.0
"""Hz at which joints are linearised before a mode is known."""


@dataclass(frozen=True, eq=False)
class ChatterBand:
    """The frequencies in Hz over which a machine is searched for chatter.

    Parameters
    ----------
    low, high
        The band: that of the file, widened to hold every mode that the tool feels, or without one a third of the
        lowest to three times the highest of them. Of a part that only an FRF is known of, no more than what is known.
    felt
        Natural frequencies in Hz of the modes that the tool feels, ascending; empty where they are not known.
    lines
        Lines in Hz on which every mode leaves a trace.
    model
        The tool point at rest as modes; None where the machine has none, or a joint is no spring and damper in truth.
    known
        Lowest and highest frequency in Hz at which the machine is known at all; (0, inf) where it has equations.
    said
        What the user has to be told of the band, a sentence each.
    """

    low: float
    high: float
    felt: Array
    lines: Array
    model: ToolModel | None
    known: tuple[float, float]
    said: tuple[str, ...]
    undamped: Undamped | None = None
    """What is wrong where a mode that the tool feels never settles."""

    @property
    def whole(self) -> bool:
        """Whether no mode of the tool can lie beyond."""
        return not np.isfinite(self.known[1])

    @property
    def middle(self) -> float:
        """Hz at which joints that are no spring and damper are linearised."""
        return (self.low + self.high) / 2


@lru_cache(maxsize=8)
def chatter_band(machine: Machine) -> ChatterBand:
    """The band of a machine at rest; `InputError` where neither its modes nor its file tell one."""
    if machine.without_equations:
        return _of_records(machine)
    typed = machine.frequency
    try:
        model, undamped = _linearised(machine, _FIRST_GUESS if typed is None else float(np.mean(typed))), None
        if model is not None:
            refuse_undamped(model)
    except Undamped as error:
        model, undamped = None, error
    if model is None:
        natural = _natural(machine)
        felt = np.asarray(2j * np.pi * natural[natural > 0])
    else:
        felt = model.poles[_felt(model)]
        felt = felt[np.argsort(np.abs(felt))]
    if not len(felt):
        if typed is None:
            raise InputError(f"{machine.where}: the tool feels no mode that vibrates, expected frequency in [response]")
        return ChatterBand(*typed, np.zeros(0), np.linspace(*typed, _LINES), model, (0.0, np.inf), ())
    if np.abs(felt[-1]) > 2 * np.pi * _HIGHEST:
        raise InputError(
            f"{machine.where}: the tool feels a mode at {np.abs(felt[-1]) / (2 * np.pi):.3g} Hz, expected none above "
            f"{_HIGHEST:g} Hz: a joint is far too stiff, or a part far too light; one that does not give way is rigid"
        )
    natural, width = np.abs(felt) / (2 * np.pi), _WIDTHS * np.abs(felt.real) / (2 * np.pi)
    low, high = float(natural[0] / _BEYOND), float(natural[-1] * _BEYOND)
    span = _span(float(natural[0]), float(natural[-1]))
    if typed is None:
        said = f"No frequency in [response]: the tool feels modes at {span}, looked at from {_span(low, high)}."
    else:
        low = low if np.any(natural - width < typed[0]) else typed[0]
        high = high if np.any(natural + width > typed[1]) else typed[1]
        said = ""
        if (low, high) != typed:
            said = (
                f"The band of [response], {_span(*typed)}, cuts off modes of the tool ({span}): "
                f"chatter was looked for from {_span(low, high)}."
            )
    near, peaks = np.unique(around(felt) / (2 * np.pi)), np.abs(felt.imag) / (2 * np.pi)
    top = min(high, _BEYOND * float(natural[-1]))
    near = near[near > 0]
    lines = np.union1d(np.linspace(low, high, _LINES), near[(near > low) & (near < high)])
    if model is not None and not _is_exact(machine, model, np.append(np.linspace(low, top, _COMPARED), peaks)):
        model = None
    return ChatterBand(low, high, natural, lines, model, (0.0, np.inf), (said,) if said else (), undamped)


def _span(low: float, high: float) -> str:
    """Two frequencies in Hz in words, one where they read the same."""
    first, last = (f"{f:.4g} Hz" if f < 1e4 else f"{f / 1e3:.4g} kHz" for f in (low, high))
    return last if first == last else f"{first.removesuffix(' Hz') if last.endswith(' Hz') else first} to {last}"


def modes_at_rest(machine: Machine) -> ToolModel | None:
    """Modes of the tool point at rest; None where the machine has none, or a joint is no spring and damper in truth."""
    return chatter_band(machine).model


def frequency_range(machine: Machine) -> tuple[float, float]:
    """The band in Hz that its file asks for, else that of its modes."""
    if machine.frequency is not None:
        return machine.frequency
    band = chatter_band(machine)
    return band.low, band.high


def _of_records(machine: Machine) -> ChatterBand:
    """What is known of a machine with parts that only an FRF is known of."""
    known = machine.known_band
    if not known[0] < known[1]:
        raise InputError(f"{machine.where}: its measured parts have no frequency in common")
    typed = known if machine.frequency is None else machine.frequency
    low, high = max(typed[0], known[0]), min(typed[1], known[1])
    if not low < high:
        raise InputError(
            f"{machine.where}: [response] frequency is {_span(*typed)}, expected a band within {_span(*known)}, where "
            "its measured parts are known"
        )
    said: tuple[str, ...] = ()
    if machine.frequency is None:
        said = (f"Band of the measured parts: {low:.4g} to {high:.4g} Hz.",)
    elif (low, high) != typed:
        said = (
            f"The band of [response], {_span(*typed)}, reaches beyond what is known of the measured parts, "
            f"{_span(*known)}: chatter was looked for from {_span(low, high)}.",
        )
    return ChatterBand(low, high, np.zeros(0), np.linspace(low, high, _LINES), None, known, said)


def _linearised(machine: Machine, frequency: float) -> ToolModel | None:
    """Modes of the tool with the joints linearised at a frequency in Hz; None where they are not to be told apart."""
    if not machine.tool:
        return None
    try:
        return OpenJoints.of(machine).models(tangents(machine, frequency), frequency)[0]
    except Undamped:
        raise
    except InputError:
        return None


def _felt(model: ToolModel) -> Mask:
    """Which oscillating modes the tool feels: by their peak, or by their share of the static compliance."""
    size = np.linalg.norm(model.inputs, axis=1) * np.linalg.norm(model.outputs, axis=1)
    found = np.zeros(len(size), dtype=bool)
    for reach in (size / np.abs(model.poles.real), size / np.abs(model.poles)):
        found |= reach >= _FELT * np.max(reach, initial=0.0)
    return found & (np.abs(model.poles.imag) > _OSCILLATING * np.abs(model.poles))


def _natural(machine: Machine) -> Array:
    """Every natural frequency in Hz of a machine whose modes at the tool cannot be told apart.

    From the symmetric equations where all parts have them: a joint that is far too stiff leaves slow modes in their
    rounding, and nothing else tells them from free motions.
    """
    K = tangents(machine, _FIRST_GUESS)[0].real
    K = np.where(np.isfinite(K), K, _STIFF)
    try:
        e = machine_equations(machine)
        squared, _, _ = modes(e.mass, e.stiffness + e.joints.T @ (K[:, None] * e.joints))
    except InputError:
        return machine_states(machine).natural_frequencies(K)
    return np.asarray(np.sqrt(np.maximum(np.sort(squared), 0.0)) / (2 * np.pi))


def _is_exact(machine: Machine, model: ToolModel, lines: Array) -> bool:
    """Whether the modes are the machine: every joint a spring and a damper, K + jωC, on lines in Hz."""
    tool = machine.tool_dofs
    G = Assembly(machine, tool, tool).coupled(2 * np.pi * lines, tangents(machine, lines))
    error = np.linalg.norm(model(lines) - G, axis=(1, 2))
    return bool(np.all(error <= _SAME * np.max(np.linalg.norm(G, axis=(1, 2)))))
