"""The measured responses of an assembly, sorted by planes and held against its blank."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError, nearest
from jointlib.modal_fit.responses import Responses

from ..measured_modes.measured_responses import read_responses
from .blank import Blank, Plane, read_blank
from .end_receptance import Hits

_STEADY = 0.2
"""By how much −ω² G may vary over the first lines that count as a mass line."""
_FIRST = 1.5
"""Times the lowest frequency up to which the first lines reach."""
_FEW = 5
_ALIKE, _MOSTLY = 1e-3, 0.5
_SIGMAS, _LIGHTER = 3.0, 0.02
_PLACES = "expected two or three places along it, such as tip.x and neck.x"


@dataclass(frozen=True, eq=False)
class Assembly:
    """A blank in the spindle, as it was measured."""

    blank: Blank
    responses: Responses
    where: str

    @property
    def places(self) -> tuple[str, ...]:
        """Stations of the blank at which something was measured."""
        return places_of(self.responses)

    def hits(self, plane: Plane) -> Hits | None:
        """The responses in a plane, None where nothing was measured in it; those between planes are left out."""
        direction, measured = plane.words[0], self.responses
        sides = [tuple(measured.dofs[k].rpartition(".") for k in pair) for pair in measured.pairs]
        kept = [i for i, (o, d) in enumerate(sides) if o[2] == direction == d[2]]
        if not kept:
            return None
        places = sorted({place for i in kept for place, _, _ in sides[i]}, key=list(self.blank.beam.stations).index)
        R = self.blank.receptance(measured.frequency, plane, places)
        n = len(places)
        moves = [places.index(sides[i][0][0]) for i in kept]
        driven = [places.index(sides[i][1][0]) for i in kept]
        hits = Hits(
            measured.value[kept],
            measured.deviation[kept],
            np.array([R[:, o, d] for o, d in zip(moves, driven, strict=True)]),
            np.array([R[:, o, n:] for o in moves]),
            np.array([R[:, d, n:] for d in driven]),
            R[:, n:, n:],
        )
        self._not_free(hits, direction)
        self._not_lighter(hits, [o == d for o, d in zip(moves, driven, strict=True)])
        return hits

    @property
    def crossed(self) -> int:
        """Responses along one axis to a force along another, which say nothing of either plane."""
        ends = [tuple(self.responses.dofs[k].rpartition(".")[2] for k in pair) for pair in self.responses.pairs]
        return sum(o != d for o, d in ends)

    def _not_free(self, hits: Hits, direction: str) -> None:
        """Refuse an assembly that does as the free blank does: nothing holds it."""
        like = np.maximum(_SIGMAS * hits.deviation, _ALIKE * np.abs(hits.free))
        if np.mean(np.all(np.abs(hits.assembly - hits.free) < like, axis=0)) > _MOSTLY:
            raise InputError(
                f"{self.where}: along {direction} the responses are those of {self.blank.where} alone, expected those "
                "of the blank in a spindle"
            )

    def _not_lighter(self, hits: Hits, own: Sequence[bool]) -> None:
        """Refuse an assembly that moves like a free mass on its first lines, and a smaller one than the blank."""
        f = self.responses.frequency
        first = f <= max(_FIRST * f[0], f[min(_FEW, len(f) - 1)])
        for i in np.flatnonzero(own):
            flexible = (-((2 * np.pi * f[first]) ** 2) * hits.assembly[i, first]).real
            mean = float(np.mean(flexible))
            noise = float(np.median(hits.deviation[i, first] / np.abs(hits.assembly[i, first])))
            if not (mean > 0 and np.ptp(flexible) < _STEADY * mean and noise < _STEADY):
                continue
            alone = float(np.mean((-((2 * np.pi * f[first]) ** 2) * hits.free[i, first]).real))
            if 0 < alone < mean * (1 - _SIGMAS * noise - _LIGHTER):
                raise InputError(
                    f"{self.blank.where}: alone it moves like {1 / alone:.3g} kg where it is hit, but the first lines "
                    f"of {self.where} are those of {1 / mean:.3g} kg, expected a blank lighter than the assembly"
                )


def places_of(responses: Responses) -> tuple[str, ...]:
    """Places in the names of degrees of freedom, each once."""
    return tuple(dict.fromkeys(dof.rpartition(".")[0] for pair in responses.pairs for dof in _named(responses, pair)))


def _named(responses: Responses, pair: tuple[int, int]) -> tuple[str, str]:
    return responses.dofs[pair[0]], responses.dofs[pair[1]]


def read_assembly(
    files: Sequence[Path],
    tool: Path,
    coupled: str | None,
    band: tuple[float, float] | None,
    condition: str | None,
    overhang: float | None,
) -> Assembly:
    """Responses of measurement files and the blank in a component file that they belong to."""
    responses = _of_places(read_responses(files, band, condition))
    where = str(files[0])
    places = places_of(responses)
    if "" in places or len(places) < 2:
        one = next(iter(places)) or "one place"
        raise InputError(f"{where}: all responses are those of {one}, which tells no rotation of {tool}, {_PLACES}")
    if len(responses.frequency) < 2 * _FEW:
        inside = "" if band is None else f" from {band[0]:g} to {band[1]:g} Hz (--band)"
        raise InputError(f"{where}: {len(responses.frequency)} lines{inside}, expected at least {2 * _FEW}")
    blank = read_blank(tool, coupled, places)
    known = [f"{s}.{p.words[0]}" for s in blank.beam.stations for p in blank.planes]
    for dof in responses.dofs:
        if dof not in known:
            raise InputError(f"{where}: {dof!r} is no deflection of a station of {tool}, {nearest(dof, known)}")
    if responses.frequency[-1] > blank.beam.up_to * (1 + 1e-9):
        raise InputError(
            f"{where}: measured up to {responses.frequency[-1]:.5g} Hz, but {tool} is made up to {blank.beam.up_to:g} "
            "Hz, expected a larger up_to there or less --band"
        )
    reach = blank.reach(places)
    if overhang is not None and reach > overhang * (1 + 1e-9):
        raise InputError(
            f"--overhang: {overhang * 1e3:.4g} mm from the tip to the face of the spindle, but {tool} is "
            f"{reach * 1e3:.4g} mm long to its coupled end, expected a blank no longer than the assembly"
        )
    return Assembly(blank, responses, where)


def _of_places(responses: Responses) -> Responses:
    """Names as ``place.direction``, without that of the component before it."""
    return replace(responses, dofs=tuple(".".join(dof.split(".")[-2:]) for dof in responses.dofs))


def same_lines(assemblies: Sequence[Assembly]) -> Array:
    """Hz, the lines on which all assemblies stand."""
    first = assemblies[0].responses.frequency
    for other in assemblies[1:]:
        f = other.responses.frequency
        if f.shape != first.shape or np.any(np.abs(f - first) > 1e-9 * first[-1]):
            raise InputError(
                f"{other.where}: {len(f)} lines from {f[0]:.6g} to {f[-1]:.6g} Hz, {assemblies[0].where} has "
                f"{len(first)} from {first[0]:.6g} to {first[-1]:.6g} Hz, expected the same lines for all blanks"
            )
    return first
