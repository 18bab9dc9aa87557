"""Charts by the methods that keep the tooth frequency: multi-frequency and collocation."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import CheckFailed, InputError, Outcome
from jointlib.system.processes import each_on_every_core

from ...tool.bounded_band import Shape, Spectrum, shape, spectrum
from ...tool.tool_model import ToolModel
from ...tool.tool_point import ToolPoint
from ..loops import crossing
from ..loops.collocation import FINER, MORE, MOST_SETTLED, ArcMap, arc_map, node_count
from ..loops.critical_depth import eigenvector, first_crossings, lowest_near, near
from ..loops.harmonic_crossing import (
    AGREE,
    GAIN,
    PAST,
    SAME,
    Found,
    harmonic_crossing,
    largest_line,
    resolving,
    slow,
)
from ..loops.loop_branches import NONE, Crossing
from ..loops.multi_frequency import HarmonicLoop, stiffest_direction
from ..loops.regeneration import Loops, Trace, trace
from ..process import zero_order
from ..process.chart import StabilityLobes
from ..process.cutting import Cutting

AT_SPEEDS = "The minimum depth is the lowest at the speeds given."
NOTES = (
    "Not covered: helix, uneven tooth pitch, runout, process damping, axial and torsional motion, loss of contact.",
    AT_SPEEDS,
)
_UNBOUNDED = 1.0
_WORTH_TELLING = 1e-4
_DOUBTFUL = 0.05
"""Share of a depth that the ends of the band may cost, from which on it is no advice."""
_RESONANT, _TURNED = 0.5, 0.3
_UNSEEN_PEAK = 50.0
"""Height over its flexibility of a mode beyond the band, with a damping ratio of 0.01."""
FAR = 2.0
"""Times the highest mode that matters from which on one is far above it."""
MANY_NODES = 300
"""Nodes beyond which harmonics search and collocation settles."""
JOINED = 3e-5
_DEEPER = 1.1
"""Times the limit of the mean cut that hardly a cut is deeper at low speeds, where that is used."""
_RAISES = 6
_GUARD = 1e-6


def by_harmonics(point: ToolPoint, cutting: Cutting, speed: Array) -> StabilityLobes:
    """Multi-frequency chart; P harmonics are settled when 2·P change the depth by less than 10⁻⁴."""
    cuts, resolved = cutting.cuts_per_revolution, shape(point)
    highest = max(float(point.lines[-1]), (resolved.highest + PAST * cuts * float(np.max(speed)) / 60) * 2)
    receptance = spectrum(point, highest)
    axes = tuple("xy".index(axis) for axis in point.axes)
    stiffest = stiffest_direction(cutting, axes)
    refuse_resonant_ends(receptance, resolved)
    tooth, about = cuts * speed / 60, np.full(len(speed), np.inf)
    if np.any(low := [slow(resolved, f) for f in tooth.tolist()]):
        about[low] = _DEEPER * _of_mean_cut(point, cutting, speed[low])

    def crossing_at(tooth_and_guess: tuple[float, float]) -> Found:
        loop = HarmonicLoop(receptance, cutting, axes, tooth_and_guess[0], 0)
        return harmonic_crossing(loop, resolved, stiffest, tooth_and_guess[1])

    guessed = list(zip(tooth.tolist(), about.tolist(), strict=True))
    found = each_on_every_core("speeds", crossing_at, guessed)
    said = _band_said(receptance, found, stiffest, speed)
    chart = charted("multi-frequency", found, cutting, speed, said)
    doubt = np.array([one.doubt for one in found])
    return replace(chart, known_below=np.where(doubt > _DOUBTFUL, (1 - doubt) * chart.depth, np.inf))


def _of_mean_cut(point: ToolPoint, cutting: Cutting, speed: Array) -> Array:
    """Limits in m of the mean of the cut, near the truth where many waves lie between teeth, at speeds in rpm."""
    period = 60 / (cutting.cuts_per_revolution * speed)
    return np.asarray(crossing.first_crossings(*_mean_cut(point, cutting), period[None]).depth[0])


@lru_cache(maxsize=8)
def _mean_cut(point: ToolPoint, cutting: Cutting) -> tuple[Loops, Trace]:
    loops = Loops.of(point, zero_order.loop_stiffness(cutting, point.axes))
    return loops, trace(loops)


def by_collocation(model: ToolModel, point: ToolPoint, cutting: Cutting, speed: Array) -> StabilityLobes:
    """Collocation chart; n nodes are settled when n + 4 change the depth by less than 10⁻⁶ of itself."""
    resolved = shape(point)
    far = model.fastest > FAR * 2 * np.pi * resolved.highest

    def crossing_at(rpm: float) -> tuple[Found, float]:
        tooth, apart = cutting.cuts_per_revolution * rpm / 60, 0.0
        if (far or cutting.process == "milling") and node_count(model, cutting, rpm) > MANY_NODES:
            if cutting.process == "milling":
                settled, finer, apart = _reduced(model, point, cutting, rpm, resolved)
            else:
                settled, finer, apart = _turned(model, cutting, rpm, resolved)
        else:
            settled, finer = _collocated(model, cutting, rpm, resolved.folded(tooth))
        if not settled.kind:
            return Found(NONE), apart
        reach = int(np.ceil(2 * resolved.highest / tooth)) + 1
        orders = np.arange(-reach - 1.0, reach + 1.0)
        force = finer.force(settled.fraction, eigenvector(finer, settled), orders)
        line = settled.fraction + orders
        moved = np.einsum("qab,qb->qa", model(line * tooth), force)
        return Found(settled, largest_line(line, np.linalg.norm(moved, axis=1))), apart

    every = each_on_every_core("speeds", crossing_at, speed.tolist())
    apart = max((change for _, change in every), default=0.0)
    said = (joined_words(apart),) if apart else ()
    return charted("collocation", [found for found, _ in every], cutting, speed, said)


def joined_words(share: float) -> str:
    """What is said of modes that act together and move depths by up to a share of themselves."""
    return (
        "Modes far above those that chatter act together, by their flexibility and inertia, which moves no depth by "
        f"more than {share:.0e} of itself."
    )


def _reduced(
    model: ToolModel, point: ToolPoint, cutting: Cutting, speed: float, resolved: Shape
) -> tuple[Crossing, ArcMap, float]:
    """The crossing by collocation of the modes that matter, and the share by which those left out move its depth.

    Harmonics of the whole tool find it; they also tell what the others do, whole and reduced beside each other. What
    far modes do to lines beyond all those is seen in the depth itself, so that the two methods have to agree.
    """
    axes = tuple("xy".index(axis) for axis in model.axes)
    tooth = cutting.cuts_per_revolution * speed / 60
    every = HarmonicLoop(spectrum(point, 2 * float(point.lines[-1])), cutting, axes, tooth, 0)
    stiffest = stiffest_direction(cutting, axes)
    whole = harmonic_crossing(every, resolved, stiffest)
    if not whole.crossing.kind:
        return NONE, arc_map(model.up_to(resolved.highest), cutting, speed), 0.0
    highest = max(whole.line * tooth, resolved.reaching(GAIN / (2 * stiffest * whole.crossing.depth)))
    for more in range(_RAISES):
        few = model.up_to(highest * FAR**more)
        if few is model:
            change = 0.0
        else:
            loop = HarmonicLoop(model, cutting, axes, tooth, 0)
            pair = [resolving(replace(loop, receptance=one), whole.harmonics) for one in (model, few)]
            beside = [near(one, whole.crossing) for one in pair]
            change = abs(beside[1].depth / beside[0].depth - 1) if beside[1].kind else np.inf
        if change > JOINED:
            continue
        before, finer = (arc_map(few, cutting, speed, MORE + extra, most=MOST_SETTLED) for extra in (0, FINER))
        settled = near(before, whole.crossing)
        proved = near(finer, settled) if settled.kind else settled
        parted = abs(proved.depth / whole.crossing.depth - 1) if proved.kind else np.inf
        if parted <= AGREE and abs(proved.depth / settled.depth - 1) <= _GUARD:
            return proved, finer, max(change, parted)
    raise CheckFailed(
        f"collocation: at {speed:g} rpm the depth still changes with the modes that are kept; use multi-frequency"
    )


def _turned(model: ToolModel, cutting: Cutting, speed: float, resolved: Shape) -> tuple[Crossing, ArcMap, float]:
    """The same in turning, where a line stands by itself: what is left out moves the depth by its share of G there."""
    tooth = cutting.cuts_per_revolution * speed / 60
    share = cutting.rotation[0][["xy".index(axis) for axis in model.axes]]
    for more in range(_RAISES):
        few = model.up_to(resolved.highest * FAR**more)
        settled, finer = _collocated(few, cutting, speed, resolved.folded(tooth))
        if not settled.kind:
            return settled, finer, 0.0
        line = tooth * (np.arange(int(2 * resolved.highest / tooth) + 2) + np.array([[1], [-1]]) * settled.fraction)
        closed = np.einsum("a,qab,b->q", share, few(line.ravel()), share)
        at = int(np.argmin(np.abs(cutting.mean_stiffness[0, 0] * closed - settled.eigenvalue)))
        whole = complex(share @ model(line.ravel()[at : at + 1])[0] @ share)
        change = abs(whole / complex(closed[at]) - 1)
        if change <= JOINED:
            return settled, finer, change
    raise CheckFailed(
        f"collocation: at {speed:g} rpm the depth still changes with the modes that are kept; use the method turning"
    )


def _collocated(model: ToolModel, cutting: Cutting, speed: float, fraction: Array) -> tuple[Crossing, ArcMap]:
    """The settled crossing at one speed; few nodes search, more settle the depth, four further ones prove it."""
    for more in range(0, _RAISES * FINER, FINER):
        coarse = arc_map(model, cutting, speed, MORE // 2 + more, 0.6)
        search = first_crossings(coarse, fraction)
        before, finer = (arc_map(model, cutting, speed, MORE + more + extra) for extra in (0, FINER))
        settled = lowest_near(before, search, fraction, coarse) if search else NONE
        if not search and not first_crossings(before, fraction):
            return NONE, finer
        if settled.kind and abs(settled.depth / search[0].depth - 1) < SAME:
            proved = near(finer, settled)
            if abs(proved.depth / settled.depth - 1) <= _GUARD:
                return proved, finer
    raise CheckFailed(
        f"collocation: at {speed:g} rpm the depth still changes with the number of nodes; use multi-frequency"
    )


def refuse_resonant_ends(receptance: Spectrum, resolved: Shape) -> None:
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
        known_below=np.full(depth.shape, np.inf),
        minimum_depth=float(depth[lowest]),
        minimum_frequency=float(line[lowest] * tooth[lowest]) if some else np.nan,
        minimum_phase=float(line[lowest] % 1) if some else np.nan,
        cuts_per_revolution=cutting.cuts_per_revolution,
        branches=(),
        outcome=Outcome.CONVERGED,
        notes=NOTES,
        warnings=said,
    )
