"""Lines that a shop makes and no cut: those that stand at one frequency whatever the speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.cuts.sound import Line, Sound

_APART = 0.01
"""Share by which speeds differ that are two."""
_SAME, _SAME_SHARE = 0.25, 2e-4
"""What lines of two records at one frequency differ by at most: widths of a line plus a share of the frequency."""
_SPEEDS = 3
"""At which a line must stand."""
_ALIKE, _GROWN = 1.2, 3.0
"""Factors of amplitude: to the one lines of two records alone are alike, from the other on one is more than others."""
_HIGHER, _OTHERS = 10.0, 2
"""Power of noise over that of other records that makes it one of its cut, and the records that takes."""


@dataclass(frozen=True)
class Background:
    """A line of the shop, and where it stands.

    Parameters
    ----------
    frequency
        Hz, the middle of the records.
    held, could
        Records in which it stands, and those in which it would be told from the lines of the spindle.
    quiet
        Whether it stands in a record without a cut.
    """

    frequency: float
    held: int
    could: int
    quiet: bool

    def sentence(self) -> str:
        """What is left out of every record, and why."""
        if self.quiet:
            why = "also stands in the record without a cut"
        else:
            why = f"stands in {self.held} of {self.could} records, whatever the speed"
        return f"The line at {self.frequency:.1f} Hz {why}: left out as background."


def background_of(k: int, sounds: Sequence[Sound], quiet: Sequence[Sound]) -> dict[Line, Background]:
    """The lines of record ``k`` that are none of its cut."""
    found = {}
    for line in sounds[k].lines:
        told = _in_quiet(line, sounds[k], quiet) or _in_others(line, k, sounds)
        if told is not None:
            found[line] = told
    return found


def rises(k: int, sounds: Sequence[Sound], quiet: Sequence[Sound]) -> bool:
    """Whether the hump in the noise of record ``k`` is missing where nothing is cut, or in other cuts."""
    hump = sounds[k].hump
    if hump is None:
        return False
    level, over = sounds[k].over(hump.frequency)
    if quiet:
        return all(one.over(hump.frequency)[0] < level / _HIGHER for one in quiet)
    others = [one.over(hump.frequency)[1] for i, one in enumerate(sounds) if i != k]
    return len(others) >= _OTHERS and float(np.median(others)) < over / _HIGHER


def _there(frequency: float, width: float, sound: Sound) -> Line | None:
    """The line of another record at a frequency."""
    off = _SAME * max(width, sound.width) + _SAME_SHARE * frequency
    near = [line for line in sound.lines if abs(line.frequency - frequency) < off]
    return max(near, key=lambda line: line.power, default=None)


def _in_quiet(line: Line, sound: Sound, quiet: Sequence[Sound]) -> Background | None:
    for one in quiet:
        other = _there(line.frequency, sound.width, one)
        if other is not None and line.power < _GROWN**2 * other.power:
            return Background(other.frequency, 1, 1, quiet=True)
    return None


def _in_others(line: Line, k: int, sounds: Sequence[Sound]) -> Background | None:
    """A line that stands in most records, at several speeds, and is no larger in this one than it is elsewhere.

    Recorders set their gain by the record, so that its size counts as such or over the noise, whichever is more alike.
    """
    could = [one for i, one in enumerate(sounds) if i == k or not one.hides(line.frequency)]
    others = [(one, _there(line.frequency, sounds[k].width, one)) for one in could if one is not sounds[k]]
    held = [(one, other) for one, other in others if other is not None]
    speeds: list[float] = [sounds[k].turning]
    for one, _ in held:
        if all(abs(one.turning / speed - 1) > _APART for speed in speeds):
            speeds.append(one.turning)
    if len(speeds) < 2 or 2 * (len(held) + 1) < len(could):
        return None
    by_power = np.sqrt(line.power / np.median([other.power for _, other in held]))
    by_noise = line.above / np.median([other.above for _, other in held])
    if len(speeds) < _SPEEDS:
        alike = any(1 / _ALIKE < ratio < _ALIKE for ratio in (by_power, by_noise))
        if not alike or len(held) + 1 < len(could):
            return None
    elif min(by_power, by_noise) > _GROWN:
        return None
    middle = float(np.median([line.frequency, *(other.frequency for _, other in held)]))
    return Background(middle, len(held) + 1, len(could), quiet=False)
