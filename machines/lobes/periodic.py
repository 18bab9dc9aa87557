"""Charts by the methods that keep the tooth frequency: multi-frequency and collocation."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import CheckFailed, InputError, Outcome

from .band import Shape, Spectrum, shape, spectrum
from .chart import StabilityLobes
from .collocation import FINER, MORE, ArcMap, arc_map, node_count
from .critical_depth import eigenvector, first_crossings, near
from .cutting import Cutting
from .loop_branches import NONE, Crossing
from .multi_frequency import HarmonicLoop
from .tool_model import ToolModel
from .tool_point import ToolPoint

NOTES = (
    "Not covered: helix, uneven tooth pitch, runout, process damping, axial and torsional motion, loss of contact.",
    "The minimum depth is the lowest at the speeds given.",
)
PAST = 3
"""Harmonics beyond the highest frequency that matters, in the search; the depth itself is settled with more."""
MOST_SEARCHED, _MOST = 128, 512
_AGREE = 1e-4
_SAME = 0.05
_GAIN = 0.5
_FEW = 24
"""Harmonics up to which all lines take part in the search."""
_LARGEST = 450
"""Rows of the matrices of a loop up to which it is computed; finer ones have twice as many."""
_STRONG, _WEAK_LINE, _FAINTEST = 0.3, 0.1, 1e-3
"""Shares: of the largest receptance, of the level searched, and of the largest again, below which nothing chatters."""
_UNBOUNDED = 1.0
_WORTH_TELLING = 1e-4
_RESONANT, _TURNED = 0.5, 0.3
_UNSEEN_PEAK = 50.0
"""Height over its flexibility of a mode beyond the band, with a damping ratio of 0.01."""
_FAR = 2.0
"""Times the highest mode that matters from which on one is far above it."""
_MANY_NODES = 300
_REDUCED = 3e-5
_RAISES = 6
_GUARD = 1e-6


@dataclass(frozen=True)
class Found:
    """A crossing with its chatter line (in tooth frequencies) and the relative error in depth that the band leaves."""

    crossing: Crossing
    line: float = np.nan
    doubt: float = 0.0


def by_harmonics(point: ToolPoint, cutting: Cutting, speed: Array) -> StabilityLobes:
    """Multi-frequency chart; P harmonics are settled when 2·P change the depth by less than 10⁻⁴."""
    cuts, resolved = cutting.cuts_per_revolution, shape(point)
    highest = max(float(point.lines[-1]), (resolved.highest + PAST * cuts * float(np.max(speed)) / 60) * 2)
    receptance = spectrum(point, highest)
    axes = tuple("xy".index(axis) for axis in point.axes)
    stiffest = stiffest_direction(cutting, axes)
    _refuse_resonant_ends(receptance, resolved)
    found = [
        _harmonic(HarmonicLoop(receptance, cutting, axes, cuts * rpm / 60, 0), resolved, stiffest)
        for rpm in speed.tolist()
    ]
    said = _band_said(receptance, found, stiffest, speed)
    return charted("multi-frequency", found, cutting, speed, said)


def by_collocation(model: ToolModel, point: ToolPoint, cutting: Cutting, speed: Array) -> StabilityLobes:
    """Collocation chart; n nodes are settled when n + 4 change the depth by less than 10⁻⁶ of itself."""
    resolved = shape(point)
    far = model.fastest > _FAR * 2 * np.pi * resolved.highest
    found, apart = [], 0.0
    for rpm in speed.tolist():
        tooth = cutting.cuts_per_revolution * rpm / 60
        if far and node_count(model, cutting, rpm) > _MANY_NODES:
            settled, finer, change = _reduced(model, point, cutting, rpm, resolved)
            apart = max(apart, change)
        else:
            settled, finer = _collocated(model, cutting, rpm, resolved.folded(tooth))
        if not settled.kind:
            found.append(Found(NONE))
            continue
        reach = int(np.ceil(2 * resolved.highest / tooth)) + 1
        orders = np.arange(-reach - 1.0, reach + 1.0)
        force = finer.force(settled.fraction, eigenvector(finer, settled), orders)
        line = settled.fraction + orders
        moved = np.einsum("qab,qb->qa", model(line * tooth), force)
        found.append(Found(settled, _largest(line, np.linalg.norm(moved, axis=1))))
    said = (
        "Modes far above those that chatter act by their flexibility alone, which moves no depth by more than "
        f"{apart:.0e} of itself.",
    )
    return charted("collocation", found, cutting, speed, said if apart else ())


def _reduced(
    model: ToolModel, point: ToolPoint, cutting: Cutting, speed: float, resolved: Shape
) -> tuple[Crossing, ArcMap, float]:
    """The crossing by collocation of the modes that matter, and the share by which those left out move its depth.

    Harmonics of the whole tool find it; they also tell what the others do, whole and reduced beside each other.
    """
    axes = tuple("xy".index(axis) for axis in model.axes)
    tooth = cutting.cuts_per_revolution * speed / 60
    every = HarmonicLoop(spectrum(point, 2 * float(point.lines[-1])), cutting, axes, tooth, 0)
    whole = _harmonic(every, resolved, stiffest_direction(cutting, axes))
    if not whole.crossing.kind:
        return NONE, arc_map(model.up_to(resolved.highest), cutting, speed), 0.0
    highest = max(whole.line * tooth, resolved.reaching(_STRONG * resolved.largest))
    for more in range(_RAISES):
        few = model.up_to(_FAR * highest * 1.5**more)
        harmonics = int(np.ceil(2 * highest / tooth)) + PAST
        beside = [near(HarmonicLoop(one, cutting, axes, tooth, harmonics), whole.crossing) for one in (model, few)]
        change = abs(beside[1].depth / beside[0].depth - 1) if beside[1].kind else np.inf
        if change > _REDUCED:
            continue
        before, finer = (arc_map(few, cutting, speed, MORE + extra) for extra in (0, FINER))
        settled = near(before, whole.crossing)
        proved = near(finer, settled) if settled.kind else settled
        if proved.kind and abs(proved.depth / settled.depth - 1) <= _GUARD:
            return proved, finer, change
    raise CheckFailed(
        f"collocation: at {speed:g} rpm the depth still changes with the modes that are kept; use multi-frequency"
    )


def _collocated(model: ToolModel, cutting: Cutting, speed: float, fraction: Array) -> tuple[Crossing, ArcMap]:
    """The settled crossing at one speed; few nodes search, more settle the depth, four further ones prove it."""
    for more in range(0, _RAISES * FINER, FINER):
        search = first_crossings(arc_map(model, cutting, speed, MORE // 2 + more, 0.6), fraction)
        before, finer = (arc_map(model, cutting, speed, MORE + more + extra) for extra in (0, FINER))
        settled = min((near(before, one) for one in search), key=lambda one: one.depth, default=NONE)
        if not search and not first_crossings(before, fraction):
            return NONE, finer
        if settled.kind and abs(settled.depth / search[0].depth - 1) < _SAME:
            proved = near(finer, settled)
            if abs(proved.depth / settled.depth - 1) <= _GUARD:
                return proved, finer
    raise CheckFailed(
        f"collocation: at {speed:g} rpm the depth still changes with the number of nodes; use multi-frequency"
    )


def _harmonic(loop: HarmonicLoop, resolved: Shape, stiffest: float) -> Found:
    """The settled crossing at one speed; P grows until twice as many change nothing."""
    fraction = resolved.folded(loop.tooth_frequency)
    P = int(np.ceil(resolved.highest / loop.tooth_frequency)) + PAST
    while P <= _FEW:
        coarse, finer = replace(loop, harmonics=P), replace(loop, harmonics=2 * P)
        search = first_crossings(coarse, fraction)
        if not search and not first_crossings(finer, fraction):
            return Found(NONE)
        if search and left_out(resolved, coarse, stiffest * search[0].depth) < _GAIN:
            before, settled = search[0], min((near(finer, one) for one in search), key=lambda one: one.depth)
            if settled.kind and abs(settled.depth / before.depth - 1) < _SAME:
                first = replace(loop, harmonics=2 * P), settled
                while settled.kind and abs(settled.depth / before.depth - 1) > _AGREE and finer.harmonics < _MOST:
                    before, finer = settled, replace(loop, harmonics=2 * finer.harmonics)
                    settled = near(finer, before)
                if abs(settled.depth / before.depth - 1) <= _AGREE:
                    moved = coarse.motion(settled.fraction, eigenvector(coarse, settled))
                    line = _largest(settled.fraction + coarse.orders, moved)
                    return Found(settled, line, _doubt(*first, fraction))
        P *= 2
    return _strongest(loop, resolved, stiffest)


def _strongest(loop: HarmonicLoop, resolved: Shape, stiffest: float) -> Found:
    """The settled crossing where many teeth pass in a wave of the fastest mode: the strongest lines search.

    A line on which the gain round the loop stays below `_GAIN` at the depth found cannot chatter by itself, so that
    modes far above the band ask for no harmonics; lines weaker still are left out of the search, not of the result.
    """
    level = _STRONG * resolved.largest
    while level >= _FAINTEST * resolved.largest:
        P = int(np.ceil(resolved.reaching(level) / loop.tooth_frequency)) + PAST
        whole, finer = replace(loop, harmonics=P), replace(loop, harmonics=2 * P)
        if whole.size > _LARGEST:
            break
        search: list[Crossing] = []
        fraction, weak = resolved.folded(loop.tooth_frequency, level / 2), _WEAK_LINE * level
        for _ in range(_RAISES):
            coarse = replace(whole, kept=whole.strongest(weak))
            search = first_crossings(coarse, fraction)
            if not search:
                break
            before = min((near(whole, one) for one in search), key=lambda one: one.depth)
            if before.kind and abs(before.depth / search[0].depth - 1) < _SAME:
                break
            weak /= 4
        else:
            break
        if not search:
            level /= 4
            continue
        needed = _GAIN / (2 * stiffest * before.depth)
        if resolved.reaching(needed) > (P + 0.5) * loop.tooth_frequency:
            level = min(needed, level / 1.5)
            continue
        settled = near(finer, before)
        while settled.kind and abs(settled.depth / before.depth - 1) > _AGREE and finer.size < _LARGEST:
            before, finer = settled, replace(finer, harmonics=2 * finer.harmonics)
            settled = near(finer, before)
        if not settled.kind or abs(settled.depth / before.depth - 1) > _AGREE:
            break
        moved = whole.motion(settled.fraction, eigenvector(whole, settled))
        line = _largest(settled.fraction + whole.orders, moved)
        return Found(settled, line, _doubt(finer, settled, fraction))
    else:
        return Found(NONE)
    raise CheckFailed(
        f"multi-frequency: {P} harmonics of a tooth frequency of {loop.tooth_frequency:g} Hz would be needed, too many "
        "to compute; take a faster spindle, or zero-order, which is near the truth with that many waves between teeth"
    )


def left_out(resolved: Shape, loop: HarmonicLoop, cut: float) -> float:
    """Gain round the loop, at most, of lines past the harmonics kept; below 1 they cannot chatter by themselves."""
    beyond = resolved.size[resolved.lines > (loop.harmonics + 0.5) * loop.tooth_frequency]
    return 2 * cut * float(np.max(beyond, initial=0.0))


def stiffest_direction(cutting: Cutting, axes: tuple[int, ...]) -> float:
    """Largest stiffness of the cut per depth over a turn of the tool, N/m²."""
    angle = np.linspace(0, 2 * np.pi, 721)[:, None] + 2 * np.pi / cutting.cuts_per_revolution * np.arange(
        cutting.cuts_per_revolution
    )
    place = np.mod(angle, 2 * np.pi)
    u, v = (part[..., list(axes)] for part in cutting.tooth(place))
    u = u * ((place >= cutting.entry_angle) & (place <= cutting.exit_angle))[..., None]
    return float(np.max(np.linalg.norm(np.einsum("kja,kjb->kab", u, v), ord=2, axis=(1, 2))))


def _doubt(loop: HarmonicLoop, crossing: Crossing, fraction: Array) -> float:
    """Relative change of the depth if the receptance is zero above its last known line and constant below the first."""
    receptance = loop.receptance
    assert isinstance(receptance, Spectrum)
    if not np.isfinite(receptance.known[1]):
        return 0.0
    bare = replace(loop, receptance=replace(receptance, carried_on=False))
    without = near(bare, crossing)
    depth = (
        without.depth if without.kind else min((one.depth for one in first_crossings(bare, fraction)), default=np.inf)
    )
    return abs(depth / crossing.depth - 1)


def _refuse_resonant_ends(receptance: Spectrum, resolved: Shape) -> None:
    """Raise where the band ends on a resonance, so that nothing can be said of what follows."""
    if not np.isfinite(receptance.known[1]):
        return
    for word, end in (("starts", 0), ("ends", -1)):
        direct = np.einsum("ii->i", receptance.point(resolved.lines[[end]])[0])
        turned = bool(np.any(np.abs(direct.imag) > _TURNED * np.abs(direct)))
        if turned and resolved.size[end] > _RESONANT * np.max(resolved.size):
            raise InputError(
                f"multi-frequency: the band {word} at {resolved.lines[end]:g} Hz on a resonance; expected a wider band"
            )


def _largest(line: Array, moved: Array) -> float:
    """The line, in tooth frequencies, at which the tool moves most; of two alike the positive one."""
    return float(abs(line[np.argmax(moved)]))


def _band_said(receptance: Spectrum, found: list[Found], stiffest: float, speed: Array) -> tuple[str, ...]:
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


def charted(method: str, found: list[Found], cutting: Cutting, speed: Array, said: tuple[str, ...]) -> StabilityLobes:
    """The chart of what was found at each speed in rpm."""
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
