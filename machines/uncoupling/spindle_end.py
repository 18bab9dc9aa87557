"""The end of a spindle in both planes, and the component file that machines couple tools to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.io.atomic import sha256, write_npz
from jointlib.io.toml_file import write_toml

from ..components.measured import Measured
from ..components.nodes import checked_nodes
from ..components.plausibility import spans
from ..indices import Mask
from .assembly import Assembly, same_lines
from .blank import Plane
from .end_receptance import Hits
from .estimated_end import EstimatedEnd, estimated_end

NODE = "nose"
"""Name of the node at the end of the spindle."""
_BRIDGED = 2
"""Lines between two weak ones that do not part them into two bands."""
_MOSTLY = 0.5


@dataclass(frozen=True, eq=False)
class SpindleEnd:
    """Receptances of the end of a spindle, a 2 × 2 block a plane; between the planes it is taken as uncoupled."""

    frequency: Array
    planes: tuple[Plane, ...]
    ends: tuple[EstimatedEnd, ...]
    position: Array
    """m, machine axes."""
    notes: tuple[str, ...]

    @property
    def dofs(self) -> tuple[str, ...]:
        """``nose.x``, ``nose.ry``, ``nose.y``, ``nose.rx``."""
        return tuple(f"{NODE}.{word}" for plane in self.planes for word in plane.words)

    @cached_property
    def receptance(self) -> ComplexArray:
        """S over `dofs`, (lines, n, n)."""
        return _blocks([end.receptance for end in self.ends])

    @cached_property
    def variance(self) -> Array:
        """E|error|² of its entries."""
        return _blocks([np.asarray(end.variance, dtype=complex) for end in self.ends]).real

    @property
    def weak(self) -> Mask:
        """Lines that do not tell the end by themselves, in one plane or the other."""
        return np.asarray(np.any([end.weak for end in self.ends], axis=0))

    @property
    def weak_bands(self) -> list[tuple[float, float]]:
        """Hz, runs of such lines."""
        at = np.flatnonzero(self.weak)
        runs = np.split(at, np.flatnonzero(np.diff(at) > _BRIDGED + 1) + 1) if len(at) else []
        return [(float(self.frequency[run[0]]), float(self.frequency[run[-1]])) for run in runs]

    def component(self, name: str) -> Measured:
        """It as a measured component, with a node in space where tools are held."""
        nodes = checked_nodes(f"component {name!r}", (NODE,), self.position[None])
        return Measured(
            name,
            self.dofs,
            self.frequency,
            self.receptance,
            variance=self.variance,
            interpolation="spline",
            nodes=nodes,
        )


def uncoupled(assemblies: Sequence[Assembly]) -> SpindleEnd:
    """The end of the spindle that all assemblies share, in every plane that was measured.

    Raises
    ------
    InputError
        Where blanks are coupled at different places or stand on different lines, or the responses do not tell an end.
    """
    frequency, first = same_lines(assemblies), assemblies[0].blank
    for assembly in assemblies[1:]:
        if assembly.blank.axis != first.axis or not np.allclose(assembly.blank.position, first.position, atol=1e-6):
            raise InputError(
                f"{assembly.blank.where}: coupled at {_mm(assembly.blank.position)}, {first.where} at "
                f"{_mm(first.position)}, expected all blanks at the end of one spindle"
            )
    planes, ends, notes = [], [], []
    length = max(assembly.blank.reach(assembly.places) for assembly in assemblies)
    for plane in first.planes:
        hits = [each for assembly in assemblies if (each := assembly.hits(plane)) is not None]
        word = plane.words[0]
        if not hits:
            notes.append(f"Nothing was measured along {word}: the spindle is not known there.")
            continue
        if not any(each.tells_all for each in hits):
            raise InputError(
                f"{assemblies[0].where}: along {word} {len(hits[0].free)} responses do not tell deflection and slope "
                "of the end, expected two places hit and both sensed: tip from tip, neck from tip, neck from neck"
            )
        planes.append(plane)
        ends.append(_end(frequency, hits, length, assemblies[0], word))
    crossed = sum(assembly.crossed for assembly in assemblies)
    if crossed:
        notes.append(f"{crossed} responses across the planes are left out: the planes are taken as uncoupled.")
    found = SpindleEnd(frequency, tuple(planes), tuple(ends), first.position, ())
    try:
        found.component("spindle")
    except InputError as error:
        said = str(error).partition(": ")[2].partition("; it may count")[0]
        raise InputError(f"{assemblies[0].where}: without {first.where} no spindle is left: {said}") from None
    if np.any(found.weak):
        share = float(np.mean(found.weak))
        tip = "; a shorter and stiffer blank, or places further apart, tell more" if share > _MOSTLY else ""
        notes.append(
            f"At {spans(frequency, found.weak)} a line alone does not tell the end: the lines around stand in{tip}."
        )
    return SpindleEnd(frequency, tuple(planes), tuple(ends), first.position, tuple(notes))


def _end(frequency: Array, hits: Sequence[Hits], length: float, assembly: Assembly, word: str) -> EstimatedEnd:
    """The end in one plane; `InputError` where the equations have no solution."""
    try:
        found = estimated_end(frequency, hits, length)
    except np.linalg.LinAlgError:
        found = None
    if found is None or not (np.all(np.isfinite(found.receptance)) and np.all(np.isfinite(found.variance))):
        raise InputError(
            f"{assembly.where}: along {word} the responses tell no end of a spindle beside {assembly.blank.where}, "
            "expected those of the blank in a spindle"
        )
    return found


def write_spindle(path: Path, found: SpindleEnd, files: Sequence[Path]) -> tuple[Path, ...]:
    """The component file, and ``X.npz`` beside it with the receptances and their variances."""
    stem = path.name.removesuffix(".toml").removesuffix(".component")
    arrays = path.with_name(f"{stem}.npz")
    write_npz(
        arrays,
        {"frequency": found.frequency, "receptance": found.receptance, "variance": np.maximum(found.variance, 0)},
    )
    noted: dict[str, Any] = {
        "program": f"jointlib {version('jointlib')}",
        "weak": [list(band) for band in found.weak_bands],
        "files": [{"file": file.name, "sha256": sha256(file)} for file in files],
    }
    if found.notes:
        noted["notes"] = list(found.notes)
    table = {
        "kind": "frf",
        "dofs": list(found.dofs),
        "interpolation": "spline",
        "record": [{"file": arrays.name, "quantity": "receptance"}],
        "node": [{"name": NODE, "at": found.position.tolist()}],
        "provenance": noted,
    }
    write_toml(path, "component", table)
    return path, arrays


def _blocks(blocks: Sequence[ComplexArray]) -> ComplexArray:
    """Blocks (lines, 2, 2) on the diagonal."""
    whole = np.zeros((len(blocks[0]), 2 * len(blocks), 2 * len(blocks)), dtype=complex)
    for k, block in enumerate(blocks):
        whole[:, 2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = block
    return whole


def _mm(position: Array) -> str:
    return "(" + ", ".join(f"{1e3 * value:.4g}" for value in position) + ") mm"
