"""Charts by the methods that keep the tooth frequency: multi-frequency and collocation."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import CheckFailed, InputError, Outcome

from .band import Shape, Spectrum, shape, spectrum
from .chart import StabilityLobes
from .collocation import FINER, MORE, arc_map
from .critical_depth import NONE, Crossing, eigenvector, first_crossing, near
from .cutting import Cutting
from .multi_frequency import HarmonicLoop
from .tool_model import ToolModel
from .tool_point import ToolPoint

NOTES = (
    "Not covered: helix, uneven tooth pitch, runout, process damping, axial and torsional motion, loss of contact.",
    "The minimum depth is the lowest at the speeds given.",
)
_PAST = 5
"""Harmonics beyond the highest frequency that matters."""
_MOST = 400
_AGREE = 5e-5
_SAME = 0.05
_GAIN = 0.5
_UNBOUNDED = 0.1
_WORTH_TELLING = 1e-4
_UNSEEN_PEAK = 50.0
"""Height over its flexibility of a mode beyond the band, with a damping ratio of 0.01."""
_RAISES = 6
_GUARD = 1e-6


@dataclass(frozen=True)
class _Found:
    """A crossing with its chatter line (in tooth frequencies) and the relative error in depth that the band leaves."""

    crossing: Crossing
    line: float = np.nan
    doubt: float = 0.0


def by_harmonics(point: ToolPoint, cutting: Cutting, speed: Array) -> StabilityLobes:
    """Multi-frequency chart; P harmonics are settled when 2·P change the depth by less than 5·10⁻⁵."""
    cuts, resolved = cutting.cuts_per_revolution, shape(point)
    highest = max(float(point.lines[-1]), (resolved.highest + _PAST * cuts * float(np.max(speed)) / 60) * 2)
    receptance = spectrum(point, highest)
    axes = tuple("xy".index(axis) for axis in point.axes)
    stiffest = _stiffest(cutting, axes)
    found = [
        _harmonic(HarmonicLoop(receptance, cutting, axes, cuts * rpm / 60, 0), resolved, stiffest)
        for rpm in speed.tolist()
    ]
    said = _band_said(receptance, found, stiffest, speed)
    return _chart("multi-frequency", found, cutting, speed, said)


def by_collocation(model: ToolModel, point: ToolPoint, cutting: Cutting, speed: Array) -> StabilityLobes:
    """Collocation chart; n nodes are settled when n + 4 change the depth by less than 10⁻⁶ of itself."""
    resolved = shape(point)
    found = []
    for rpm in speed.tolist():
        tooth = cutting.cuts_per_revolution * rpm / 60
        coarse = arc_map(model, cutting, rpm)
        crossing = first_crossing(coarse, resolved.folded(tooth))
        for more in range(1, _RAISES + 1):
            finer = arc_map(model, cutting, rpm, MORE + FINER * more)
            settled = near(finer, crossing) if crossing.kind else first_crossing(finer, resolved.folded(tooth))
            if settled.kind == crossing.kind and not abs(settled.depth / crossing.depth - 1) > _GUARD:
                break
            crossing = first_crossing(finer, resolved.folded(tooth))
        else:
            raise CheckFailed(
                f"collocation: at {rpm:g} rpm the depth still changes with the number of nodes; use multi-frequency"
            )
        if not settled.kind:
            found.append(_Found(NONE))
            continue
        reach = int(np.ceil(2 * resolved.highest / tooth)) + 1
        orders = np.arange(-reach - 1.0, reach + 1.0)
        force = finer.force(settled.fraction, eigenvector(finer, settled), orders)
        line = settled.fraction + orders
        moved = np.einsum("qab,qb->qa", model(line * tooth), force)
        found.append(_Found(settled, _largest(line, np.linalg.norm(moved, axis=1))))
    return _chart("collocation", found, cutting, speed, ())


def _harmonic(loop: HarmonicLoop, resolved: Shape, stiffest: float) -> _Found:
    """The settled crossing at one speed; P grows until twice as many change nothing."""
    fraction = resolved.folded(loop.tooth_frequency)
    P = int(np.ceil(resolved.highest / loop.tooth_frequency)) + _PAST
    while P <= _MOST:
        coarse = replace(loop, harmonics=P)
        crossing = first_crossing(coarse, fraction)
        finer = replace(loop, harmonics=2 * P)
        if not crossing.kind:
            if not first_crossing(finer, fraction).kind:
                return _Found(NONE)
        elif _left_out(resolved, coarse, stiffest * crossing.depth) < _GAIN:
            settled = near(finer, crossing)
            while settled.kind and abs(settled.depth / crossing.depth - 1) > _AGREE and finer.harmonics < _MOST:
                if abs(settled.depth / crossing.depth - 1) > _SAME:
                    settled = NONE
                    break
                crossing, finer = settled, replace(loop, harmonics=2 * finer.harmonics)
                settled = near(finer, crossing)
            if settled.kind and abs(settled.depth / crossing.depth - 1) <= _AGREE:
                moved = coarse.motion(settled.fraction, eigenvector(coarse, replace(settled)))
                line = _largest(settled.fraction + coarse.orders, moved)
                return _Found(settled, line, _doubt(finer, settled))
        P *= 2
    raise CheckFailed(
        f"multi-frequency: at a tooth frequency of {loop.tooth_frequency:g} Hz the depth still changes with the number "
        f"of harmonics at {_MOST} of them; raise the spindle speed or narrow the band"
    )


def _left_out(resolved: Shape, loop: HarmonicLoop, cut: float) -> float:
    """Gain round the loop, at most, of lines past the harmonics kept; below 1 they cannot chatter by themselves."""
    beyond = resolved.size[resolved.lines > (loop.harmonics + 0.5) * loop.tooth_frequency]
    return 2 * cut * float(np.max(beyond, initial=0.0))


def _stiffest(cutting: Cutting, axes: tuple[int, ...]) -> float:
    """Largest stiffness of the cut per depth over a turn of the tool, N/m²."""
    angle = np.linspace(0, 2 * np.pi, 721)[:, None] + 2 * np.pi / cutting.cuts_per_revolution * np.arange(
        cutting.cuts_per_revolution
    )
    place = np.mod(angle, 2 * np.pi)
    u, v = (part[..., list(axes)] for part in cutting.tooth(place))
    u = u * ((place >= cutting.entry_angle) & (place <= cutting.exit_angle))[..., None]
    return float(np.max(np.linalg.norm(np.einsum("kja,kjb->kab", u, v), ord=2, axis=(1, 2))))


def _doubt(loop: HarmonicLoop, crossing: Crossing) -> float:
    """Relative change of the depth if the receptance is nothing, not a mass, past its last known line."""
    receptance = loop.receptance
    assert isinstance(receptance, Spectrum)
    if not np.isfinite(receptance.known[1]):
        return 0.0
    without = near(replace(loop, receptance=replace(receptance, carried_on=False)), crossing)
    return abs(without.depth / crossing.depth - 1) if without.kind else np.inf


def _largest(line: Array, moved: Array) -> float:
    """The line, in tooth frequencies, at which the tool moves most; of two alike the positive one."""
    return float(abs(line[np.argmax(moved)]))


def _band_said(receptance: Spectrum, found: list[_Found], stiffest: float, speed: Array) -> tuple[str, ...]:
    """What the ends of the band cost; refused where that cannot be bounded."""
    low, high = receptance.known
    if not np.isfinite(high):
        return ()
    doubt = np.array([one.doubt for one in found])
    worst = int(np.argmax(doubt))
    if doubt[worst] > _UNBOUNDED:
        raise InputError(
            f"multi-frequency: the receptance is known from {low:g} to {high:g} Hz, which decides the depth at "
            f"{int(np.count_nonzero(doubt > _UNBOUNDED))} of {len(found)} speeds, at {speed[worst]:g} rpm most; "
            "expected a wider band"
        )
    shallowest = min(one.crossing.depth for one in found)
    end = receptance.point(np.array([high]))[0]
    rising = float(np.max(np.einsum("ii->i", end.real)))
    if rising > 0 and (not np.isfinite(shallowest) or 2 * shallowest * stiffest * rising * _UNSEEN_PEAK > 1):
        raise InputError(
            f"multi-frequency: at its end, {high:g} Hz, the receptance is that of a spring, so a mode above it may "
            "chatter first; expected a band that ends past the modes"
        )
    if doubt[worst] < _WORTH_TELLING:
        return ()
    return (
        f"The receptance is known from {low:g} to {high:g} Hz; beyond, it is carried on as a mass and below as a "
        f"spring: the depth may be off by up to {100 * doubt[worst]:.2g} %, at {speed[worst]:g} rpm.",
    )


def _chart(
    method: str, found: list[_Found], cutting: Cutting, speed: Array, said: tuple[str, ...]
) -> StabilityLobes:
    depth = np.array([one.crossing.depth for one in found])
    line = np.array([one.line for one in found])
    tooth = cutting.cuts_per_revolution * speed / 60
    lowest = int(np.argmin(depth))
    some = bool(np.isfinite(depth[lowest]))
    return StabilityLobes(
        method=method,
        speed=speed,
        depth=depth,
        chatter_frequency=line * tooth,
        kind=np.array([one.crossing.kind for one in found]),
        lobe=np.where(np.isfinite(line), np.floor(np.nan_to_num(line)), -1).astype(np.int64),
        minimum_depth=float(depth[lowest]),
        minimum_frequency=float(line[lowest] * tooth[lowest]) if some else np.nan,
        minimum_phase=float(line[lowest] % 1) if some else np.nan,
        cuts_per_revolution=cutting.cuts_per_revolution,
        branches=(),
        outcome=Outcome.CONVERGED,
        notes=NOTES,
        warnings=said,
    )
