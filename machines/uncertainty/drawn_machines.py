"""Machines drawn from what was identified and measured of them: joints, modes, measured responses, the cut.

Every quantity (a parameter of a joint, a line of a measured FRF) has its own stream of random numbers, told by the seed
and its name. The same samples thus stand behind every speed, amplitude and depth, and behind a changed design: the
difference between two bands is one of the machines and not of chance.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any
from zlib import crc32

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.joint import Covariance, Joint
from jointlib.parameter import parameters_of
from jointlib.system.memory import refuse_beyond

from ..components.measured import Measured
from ..components.modal import Modal
from ..cutting.process.cutting import Cutting
from ..model.machine import Machine

_INSIDE = 1e-9
FEWEST = 40
"""Samples of which 2.5 % are one."""
_EACH_VALUE, _EACH_PART = 60.0, 4000.0
"""Bytes that a sample takes while it is drawn."""
_SLIGHT = 0.01
"""Share of its value that a coefficient of the cut, a frequency or a damping has at least."""


def draws(name: str, count: int, size: int, seed: int = 0) -> Array:
    """Standard normal numbers of a named quantity, (count, size); more samples leave the first ones as they are."""
    return np.random.default_rng([seed, crc32(name.encode())]).standard_normal((count, size))


def sampled_joint(joint: Joint, name: str, count: int, seed: int = 0) -> tuple[list[Joint], int]:
    """Joints drawn from the covariance of an identified one, and how many parameters met a bound."""
    if joint.covariance is None:
        return [joint] * count, 0
    names, matrix = joint.covariance.names, np.asarray(joint.covariance.matrix, dtype=float)
    root = _root(matrix)
    centre = np.array([joint.parameters[n] for n in names])
    found = centre + draws(name, count, len(names), seed) @ root.T
    low, high = np.array([_bounds(joint, n) for n in names]).T
    kept = np.clip(found, low, high)
    joints = [joint.with_parameters(dict(zip(names, row.tolist(), strict=True))) for row in kept]
    return [replace(j, validity=joint.validity) for j in joints], int(np.count_nonzero(kept != found))


def _root(matrix: Array) -> Array:
    """R with R·Rᵀ the matrix, by eigenvectors: it may be singular, as of parameters that only occur together."""
    size, vectors = np.linalg.eigh(matrix / np.outer(_scale(matrix), _scale(matrix)))
    return np.asarray(_scale(matrix)[:, None] * vectors * np.sqrt(np.maximum(size, 0.0)))


def _scale(matrix: Array) -> Array:
    deviation = np.sqrt(np.diag(matrix))
    return np.where(deviation > 0, deviation, 1.0)


def _bounds(joint: Joint, name: str) -> tuple[float, float]:
    """What a parameter may be; strictly above a bound is a billionth of its value above it."""
    part, _, field = name.partition(".")
    law = dict(zip(joint.part_names, joint.laws, strict=True))[part]
    (found,) = (p for p in parameters_of(law) if p.name == field.partition("[")[0])
    above = found.above + _INSIDE * abs(joint.parameters[name] - found.above) if np.isfinite(found.above) else -np.inf
    return max(found.lower, above), found.upper


def sampled_value(part: Measured, count: int, seed: int = 0) -> list[Measured]:
    """Measured FRFs with errors of the variance that was measured with them, independent from line to line."""
    if part.variance is None:
        return [part] * count
    size = part.value.size
    normal = draws(part.name, count, 2 * size, seed).reshape(count, 2, *part.value.shape)
    error = np.sqrt(part.variance / 2) * (normal[:, 0] + 1j * normal[:, 1])
    # One record stands on both sides of the diagonal where the other was not measured.
    mirrored = np.triu(np.all(part.value == part.value.swapaxes(1, 2), axis=0), 1)
    error = np.where(mirrored.T, error.swapaxes(2, 3), error)
    return [replace(part, value=part.value + e) for e in error]


def sampled_modes(part: Modal, count: int, seed: int = 0) -> tuple[list[Modal], int]:
    """Modal components drawn from the standard errors of their modes, and how many values met a bound."""
    drawn, clipped = {}, 0
    for key in ("frequency", "damping_ratio"):
        error = getattr(part, f"{key}_error")
        if error is not None:
            value = getattr(part, key)
            found = value + draws(f"{part.name}.{key}", count, len(value), seed) * error
            drawn[key] = np.maximum(found, _SLIGHT * value)
            clipped += int(np.count_nonzero(drawn[key] != found))
    if not drawn:
        return [part] * count, 0
    return [replace(part, **{key: values[i] for key, values in drawn.items()}) for i in range(count)], clipped


def sampled_cuts(table: Mapping[str, Any], count: int, seed: int = 0) -> tuple[list[Mapping[str, Any]], int]:
    """Fields of `Cutting` with coefficients drawn from their covariance, and how many were set to a bound.

    Those over the chip stay above a hundredth of their value, as a negative one would push the tool out of the cut.
    """
    known: Covariance | None = table.get("covariance")
    if known is None:
        return [table] * count, 0
    centre = np.array([float(table[name]) for name in known.names])
    found = centre + draws("cutting", count, len(centre), seed) @ _root(np.asarray(known.matrix, dtype=float)).T
    held = np.array([not name.startswith("edge") for name in known.names])
    kept = np.where(held, np.maximum(found, _SLIGHT * centre), found)
    drawn = [dict(zip(known.names, row.tolist(), strict=True)) for row in kept]
    rows: list[Mapping[str, Any]] = [{**table, **values, "covariance": None} for values in drawn]
    return rows, int(np.count_nonzero(kept != found))


def drawn_cut(cutting: Cutting, sample: int, count: int, seed: int) -> Cutting:
    """One of ``count`` cuts, the same as stands in that one of `sampled_machines`."""
    if cutting.covariance is None:
        return cutting
    values = {name: getattr(cutting, name) for name in cutting.covariance.names}
    row = sampled_cuts({**values, "covariance": cutting.covariance}, count, seed)[0][sample]
    return replace(cutting, **row)


def refuse_certain(machine: Machine, cut: bool = True) -> None:
    """Raise where nothing in the machine, or in its ``cut``, has an error that could be drawn."""
    varied = any(c.variance is not None for c in machine.components if isinstance(c, Measured))
    varied |= any(c.uncertain for c in machine.components if isinstance(c, Modal))
    varied |= cut and (machine.cutting or {}).get("covariance") is not None
    if not varied and all(joint.covariance is None for joint in machine.joints()):
        raise InputError(
            f"{machine.where}: no joint has a covariance and no measured FRF a variance, so there is nothing to sample "
            "(nor have modes a frequency_error or a damping_ratio_error, or [cutting] a file with a covariance)"
        )


def refuse_too_many(machine: Machine, count: int) -> None:
    """Refuse fewer samples than a band needs, and so many that what is drawn does not fit into memory."""
    if count < FEWEST:
        raise InputError(f"--samples: {count}, expected at least {FEWEST}")
    values = sum(c.value.size for c in machine.components if isinstance(c, Measured) and c.variance is not None)
    parts = len(machine.components) + len(machine.connections)
    need = count * (_EACH_VALUE * values + _EACH_PART * parts)
    refuse_beyond(need, f"--samples: {count} samples of {values} measured values and {parts} parts and joints")


def sampled_machines(machine: Machine, count: int = 1000, seed: int = 0) -> tuple[list[Machine], int]:
    """The machine with everything drawn whose error is known; see `Band.clipped`."""
    joints, clipped = {}, 0
    for connection, joint in zip(machine.flexible, machine.joints(), strict=True):
        joints[connection.name], beyond = sampled_joint(joint, connection.name, count, seed)
        clipped += beyond
    parts: dict[str, list[Any]] = {}
    for c in machine.components:
        if isinstance(c, Measured):
            parts[c.name] = sampled_value(c, count, seed)
        elif isinstance(c, Modal):
            parts[c.name], beyond = sampled_modes(c, count, seed)
            clipped += beyond
    refuse_certain(machine)
    cuts, beyond = sampled_cuts(machine.cutting or {}, count, seed)
    clipped += beyond
    found = []
    for i in range(count):
        components = tuple(parts[c.name][i] if c.name in parts else c for c in machine.components)
        connections = tuple(replace(c, joint=joints[c.name][i]) if c.name in joints else c for c in machine.connections)
        cutting = None if machine.cutting is None else cuts[i]
        found.append(replace(machine, components=components, connections=connections, cutting=cutting))
    return found, clipped
