"""The limiting depth at one speed from the harmonics of the tooth frequency, settled with twice as many."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import CheckFailed

from ...tool.bounded_band import Shape, Spectrum
from .beside_half import flips_known
from .critical_depth import eigenvector, first_crossings, lowest_near, near
from .iterated_loop import IteratedLoop
from .loop_branches import NONE, Crossing
from .multi_frequency import HarmonicLoop
from .strong_lines import FoldedLines, StrongLines, folded, strong_lines

PAST = 3
"""Harmonics beyond the highest frequency that matters, in the search; the depth itself is settled with more."""
MOST_SEARCHED, _MOST = 128, 512
AGREE = 1e-4
SAME = 0.05
GAIN = 0.5
"""Gain round the loop below which a line cannot chatter by itself."""
_ONE = 1e-7
"""Share of a depth, and of a tooth frequency, within which two crossings are one."""
_FEW = 24
"""Harmonics up to which all lines take part in the search."""
_LARGEST = 240
"""Rows of the matrices of a loop up to which all its eigenvalues are computed."""
_ALONE = 1.0
"""Gain round the loop below which no lines together chatter without stronger ones."""
_STRONG, _FAINTEST = 0.3, 1e-3
"""Shares of the largest receptance: where the search begins, and below which nothing chatters."""


@dataclass(frozen=True)
class Found:
    """A crossing with its chatter line (in tooth frequencies) and the relative error in depth that the band leaves.

    ``harmonics`` are those of the loop that settled it.
    """

    crossing: Crossing
    line: float = np.nan
    doubt: float = 0.0
    harmonics: int = 0


def harmonic_crossing(loop: HarmonicLoop, resolved: Shape, stiffest: float, about: float = np.inf) -> Found:
    """The settled crossing at one speed; P grows until twice as many change nothing.

    ``about`` which depth (m) it is, where something tells that, spares a search; it decides nothing.
    """
    fraction = resolved.folded(loop.tooth_frequency)
    P = _fewest(resolved, loop.tooth_frequency)
    while P <= _FEW:
        coarse, finer = replace(loop, harmonics=P), replace(loop, harmonics=2 * P)
        search = first_crossings(coarse, fraction)
        if not search and not first_crossings(finer, fraction):
            return Found(NONE)
        if search and left_out(resolved, coarse, stiffest * search[0].depth) < GAIN:
            before, settled = search[0], lowest_near(finer, search, fraction, coarse)
            agree = settled.kind and abs(settled.depth / before.depth - 1) < SAME
            if agree and flips_known(coarse, finer, SAME, settled.depth):
                first = replace(loop, harmonics=2 * P), settled
                while settled.kind and abs(settled.depth / before.depth - 1) > AGREE and finer.harmonics < _MOST:
                    before, finer = settled, replace(loop, harmonics=2 * finer.harmonics)
                    settled = lowest_near(finer, search, fraction, coarse)
                if abs(settled.depth / before.depth - 1) <= AGREE:
                    moved = coarse.motion(settled.fraction, eigenvector(coarse, settled))
                    line = largest_line(settled.fraction + coarse.orders, moved)
                    return Found(settled, line, _doubt(*first, fraction), finer.harmonics)
        P *= 2
    return _strongest(loop, resolved, stiffest, about)


def slow(resolved: Shape, tooth_frequency: float) -> bool:
    """Whether so many teeth pass in a wave of the fastest mode that its strongest lines are looked at first."""
    return _fewest(resolved, tooth_frequency) > _FEW


def _fewest(resolved: Shape, tooth_frequency: float) -> int:
    return int(np.ceil(resolved.highest / tooth_frequency)) + PAST


def _strongest(loop: HarmonicLoop, resolved: Shape, stiffest: float, about: float) -> Found:
    """The settled crossing where many teeth pass in a wave of the fastest mode: the strongest lines first.

    A line on which the gain round the loop stays below `GAIN` at the depth found cannot chatter by itself, so that
    modes far above the band ask for no harmonics.
    """
    level, faintest = _STRONG * resolved.largest, _FAINTEST * resolved.largest

    def reaching(level: float) -> int:
        return int(np.ceil(resolved.reaching(max(level, faintest)) / loop.tooth_frequency)) + PAST

    told = (1 - SAME) * GAIN / (2 * stiffest * about)
    # What lies much deeper than the limit would ask for more lines than the limit does.
    level, about = (min(level, told), about) if reaching(told) <= _MOST else (level, np.inf)
    while True:
        P = reaching(level)
        if level < faintest:
            P = max(P, min(2 * P, _MOST))  # nothing chatters where twice as many find nothing either
        if P > _MOST:
            break
        whole = resolving(loop, P)
        fraction = resolved.folded(loop.tooth_frequency, level / 2)
        strong = _strong(replace(loop, harmonics=P), resolved, level, about)
        narrowed = strong.size <= whole.size / 2
        looked = strong if narrowed else whole
        search = first_crossings(looked, fraction)
        if not search and level < faintest:
            return Found(NONE)
        if not search:
            level, about = level / 4, np.inf
            continue
        needed = GAIN / (2 * stiffest * search[0].depth)
        lacking = level > needed if narrowed else resolved.reaching(needed) > (P + 0.5) * loop.tooth_frequency
        if level >= faintest and lacking:
            asked, about = (1 - SAME) * needed, search[0].depth
            # Few lines may put the depth so high that too many would be asked for; some more tell better.
            level = asked if reaching(asked) <= _MOST else max(asked, level / 4)
            continue
        P = min(P, reaching((1 - SAME) * needed))
        if narrowed and not (search := _of_all_lines(IteratedLoop(replace(loop, harmonics=P)), search)):
            level, about = level / 2, about if level > needed / 2 else np.inf
            continue
        finer = resolving(loop, 2 * P)
        before, settled = search[0], lowest_near(finer, search, fraction, looked)
        while settled.kind and abs(settled.depth / before.depth - 1) > AGREE and P < _MOST:
            P *= 2
            before, finer = settled, resolving(loop, 2 * P)
            settled = lowest_near(finer, search, fraction, looked)
        if not settled.kind or abs(settled.depth / before.depth - 1) > AGREE:
            raise CheckFailed(
                f"multi-frequency: at a tooth frequency of {loop.tooth_frequency:g} Hz the depth still changes with "
                f"{P} harmonics, expected less than {AGREE:g} of itself; use collocation"
            )
        orders = np.arange(-2.0 * P - 1, 2.0 * P + 1)
        lines = loop.receptance((settled.fraction + orders) * loop.tooth_frequency)
        moved = np.einsum("qab,qb->qa", lines, finer.force(eigenvector(finer, settled)))
        line = largest_line(settled.fraction + orders, np.linalg.norm(moved, axis=1))
        return Found(settled, line, _doubt(replace(loop, harmonics=P), settled, fraction), 2 * P)
    raise CheckFailed(
        f"multi-frequency: {P} harmonics of a tooth frequency of {loop.tooth_frequency:g} Hz would be needed, expected "
        f"at most {_MOST}; take a faster spindle, or zero-order, near the truth with so many waves between teeth"
    )


def _strong(
    loop: HarmonicLoop, resolved: Shape, level: float, about: float
) -> StrongLines | FoldedLines | IteratedLoop:
    """The lines of a loop that reach a level (m/N); of those the ones that cannot chatter alone at a depth (m)
    ``about`` are folded into the others.
    """
    strong = strong_lines(loop, resolved, level)
    lines = folded(strong, resolved, _ALONE / GAIN * level, about) if np.isfinite(about) else strong
    return lines if lines.size <= _LARGEST else IteratedLoop(strong)


def _of_all_lines(whole: IteratedLoop, found: list[Crossing]) -> list[Crossing]:
    """Crossings of the strong lines with all others beside them, those that twice as many lines may find the lowest;
    none where one moves far, or onto another.
    """
    found = [one for i, one in enumerate(found) if not any(_alike(one, other) for other in found[:i])]
    settled = [near(whole, one) for one in found]
    far = any(not at.kind or abs(at.depth / one.depth - 1) >= SAME for one, at in zip(found, settled, strict=True))
    if far or any(_alike(*two) for two in combinations(settled, 2)):
        return []
    lowest = min((one.depth for one in settled), default=0.0)
    return sorted((one for one in settled if one.depth <= (1 + SAME) * lowest), key=lambda one: one.depth)


def _alike(one: Crossing, other: Crossing) -> bool:
    """Whether two crossings are one."""
    return abs(one.depth / other.depth - 1) < _ONE and abs(one.fraction - other.fraction) < _ONE


def resolving(loop: HarmonicLoop, harmonics: int) -> HarmonicLoop | IteratedLoop:
    """The loop with so many harmonics, as suits its size."""
    resolved = replace(loop, harmonics=harmonics)
    return IteratedLoop(resolved) if resolved.size > _LARGEST else resolved


def left_out(resolved: Shape, loop: HarmonicLoop, cut: float) -> float:
    """Gain round the loop, at most, of lines past the harmonics kept; below 1 they cannot chatter by themselves."""
    beyond = resolved.size[resolved.lines > (loop.harmonics + 0.5) * loop.tooth_frequency]
    return 2 * cut * float(np.max(beyond, initial=0.0))


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


def largest_line(line: Array, moved: Array) -> float:
    """The line, in tooth frequencies, at which the tool moves most; of two alike the positive one."""
    return float(abs(line[np.argmax(moved)]))
