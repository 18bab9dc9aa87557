"""The reference run that every FMU carries: what it does along a motion or under forces, from the laws themselves."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.law import Motion

from ..system.closed import stiff_closed
from ..system.conditions import Condition
from ..system.step_limit import Range, kinks
from ..system.system import System
from ..system.under_conditions import UnderConditions
from .closed_simulation import simulate_closed
from .simulation import simulate

FOLDER = "extra/org.fmi-standard.fmi-ls-ref"
MANIFEST = f"{FOLDER}/fmi-ls-manifest.xml"
CSV = "reference.csv"
_SEED = 1936
INTEGRATED = 1e-6
"""How far apart, relative to the largest value, two integrations of one structure may be.

Both keep 1e-10 a step; what remains is the hysteresis of the events, 1e-6 of the play or the slip of a joint."""

SMALL = 1e-6
"""An output that stays below this share of the largest of its unit is held against that share."""
LOOSEST = 1e-3
"""No FMU may ask for more than that to be overlooked: what fixed steps leave of joints that slip and ring."""
STILL = 0.1
"""An output of a stiff structure below this share of the largest of its unit is held against that share, as many of its
joints hardly move: their forces are large constants times what a tolerance leaves of the motion."""
STIFF = 1e-9
"""Tolerance with which a stiff structure repeats its run."""
_STIFF_STEPS = 2
"""Communication steps in one of its samples."""

MANIFEST_TEXT = f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiReferences
    xmlns:fmi-ls="http://fmi-standard.org/fmi-ls-manifest"
    fmi-ls:fmi-ls-name="org.fmi-standard.fmi-ls-ref"
    fmi-ls:fmi-ls-version="1.0.0-alpha.1"
    fmi-ls:fmi-ls-description="Files that belong to this FMU">
  <Related type="text/csv" source="{CSV}" role="result" description="Inputs and outputs. First row: initialization. \
Every other row: the inputs set at the time of the row before and held, and the outputs after the step."/>
</fmiReferences>
"""


@dataclass(frozen=True)
class ReferenceRun:
    """Time (s), inputs and outputs by column; see the manifest for what a row means."""

    names: tuple[str, ...]
    """``time``, the inputs, the outputs."""
    rows: Array
    """Shape (samples, names)."""
    error: float = 0.0
    """What halving the steps of its integration changes at most, relative to the largest value of an output."""


def motion(joint: Joint, over: Range) -> tuple[Array, Array, float]:
    """Displacement (m), velocity (m/s) and time step (s) of a run that visits what a joint can do.

    Rest, a harmonic motion that grows past every kink and reverses, rest while displaced, rest again at zero, and
    displacements and velocities that have nothing to do with each other. Kinks beyond the range are visited too.
    """
    positions, speeds = kinks(joint)
    A = max([over.amplitude, *(1.5 * abs(x) for x in positions)])
    V = max([over.velocity, *(1.1 * abs(x) for x in speeds)])
    angle = 2 * np.pi * np.arange(240) / 40
    size = np.linspace(0.0, 1.0, angle.size)
    rng = np.random.default_rng(_SEED)
    rest = np.zeros(10)
    z = np.concatenate([rest, size * np.sin(angle), rest + 0.7, rest, rng.uniform(-1, 1, 120)])
    v = np.concatenate([rest, size * np.cos(angle), rest, rest, rng.uniform(-1, 1, 120)])
    return A * z, V * v, 2 * np.pi * A / (40 * V)


def reference_run(system: System, over: Range | None) -> ReferenceRun:
    """What the system does, from the Python laws: along :func:`motion`, or under forces where it has a structure."""
    if system.states:
        return _under_forces(system)
    assert over is not None
    return _along_motion(system, over)


def _along_motion(system: System, over: Range) -> ReferenceRun:
    """The force of the Python law along :func:`motion`, from the virgin state; two sides share the motion.

    Conditions begin at their start values, go through all that is known of them, and jump about in it.
    """
    ((_, joint),) = system.joints
    z, v, step = motion(joint, over)
    D = system.D
    u = np.column_stack([z, v]) @ D / np.sum(D**2, axis=1)[0]
    z, v = (u @ D.T).T
    rng = np.random.default_rng(_SEED)
    for k, c in enumerate(system.conditions, start=-len(system.conditions)):
        u[:, k] = _course(c, len(u), rng)
    at = system.conditions_in(u)
    under, state = UnderConditions(joint), joint.initial_state(z[0])
    force, behind = np.empty(z.shape), under.begun(at[0])
    force[0] = under.step(Motion(z[0], v[0]), at[0], state, behind)[0]
    for i in range(1, len(z)):
        force[i], state, behind = under.step(Motion(z[i], v[i], step), at[i], state, behind)
    return _run(system, step, u, force[:, None] @ system.H.T)


def _course(condition: Condition, samples: int, rng: np.random.Generator) -> Array:
    """A condition over a run: still for a third of it, then from end to end of what is known and back, then jumps."""
    low = condition.low if np.isfinite(condition.low) else condition.start - condition.size
    high = condition.high if np.isfinite(condition.high) else condition.start + condition.size
    still, even = samples // 3, (samples - samples // 3) // 2
    swept = np.interp(np.linspace(0, 3, even), [0, 1, 2, 3], [condition.start, high, low, condition.start])
    jumps = rng.uniform(low, high, samples - still - even)
    return np.concatenate([np.full(still, condition.start), swept, jumps])


def _under_forces(system: System) -> ReferenceRun:
    """Rest, forces that jump from step to step, decay: six periods of the slowest motion, at most 60 of the fastest.

    Conditions are beside their start values all the time. What is stiff runs by communication steps instead, as periods
    of its fastest motion are no time.
    """
    low, high = system.band
    stiff = stiff_closed(system)
    if stiff is not None and system.step is not None:
        step = _STIFF_STEPS * system.step
    else:
        step = (min(6 / low, 60 / high) if low else 1.0) / 120
    rng = np.random.default_rng(_SEED)
    u = np.zeros((121, len(system.inputs)))
    forces = len(system.inputs) - len(system.conditions)
    u[3:80, :forces] = rng.uniform(-1, 1, (77, forces)) * [s.size for s in system.inputs[:forces]]
    u[:, forces:] = [c.elsewhere for c in system.conditions]
    if stiff is None:
        return _run(system, step, u, simulate(system, u, step))
    y, changed = simulate_closed(stiff, u, step, INTEGRATED, LOOSEST)
    error = changed / sizes(y, [s.unit for s in system.outputs], STILL)
    return _run(system, step, u, y, float(np.max(error, initial=0.0)))


def _run(system: System, step: float, u: Array, y: Array, error: float = 0.0) -> ReferenceRun:
    names = ("time", *(s.name for s in (*system.inputs, *system.outputs)))
    return ReferenceRun(names, np.column_stack([step * np.arange(len(u)), u, y]), error)


def sizes(values: Array, units: Sequence[str], small: float) -> Array:
    """Largest absolute value of each output, not less than a small share of the largest of its unit."""
    own = np.max(np.abs(values), axis=0)
    shared = [max(x for x, other in zip(own, units, strict=True) if other == unit) for unit in units]
    return np.asarray(np.maximum(np.maximum(own, small * np.array(shared)), np.finfo(float).tiny))


def told_of(scalar: ElementTree.Element, key: str, default: str = "") -> str:
    """What a model description tells of a variable that is a number: itself in FMI 3, in an element of its own in 2."""
    real = scalar.find("Real")
    return (scalar if real is None else real).get(key, default)


def csv_text(run: ReferenceRun) -> str:
    """The run as CSV; numbers read back as they were."""
    lines = [",".join(f'"{name}"' for name in run.names)]
    lines += [",".join(repr(float(x)) for x in row) for row in run.rows]
    return "\n".join(lines) + "\n"


def read_csv(text: str, where: str) -> ReferenceRun:
    """A reference run from CSV: ``time`` and any variables."""
    rows = [row for row in csv.reader(io.StringIO(text)) if row]
    if len(rows) < 3 or not rows[0] or rows[0][0].strip() != "time":
        raise InputError(f"{where}: no reference run, expected a first column 'time' and at least two rows")
    names = tuple(cell.strip() for cell in rows[0])
    try:
        values = np.array([[float(cell) for cell in row] for row in rows[1:]])
    except ValueError as error:
        raise InputError(f"{where}: {error}, expected numbers in rows of {len(names)}") from None
    if values.shape[1:] != (len(names),) or not np.all(np.isfinite(values)):
        raise InputError(f"{where}: not a table of finite numbers, expected rows of {len(names)}")
    if not np.all(np.diff(values[:, 0]) > 0):
        raise InputError(f"{where}: time does not grow from row to row, expected it to")
    return ReferenceRun(names, values)
