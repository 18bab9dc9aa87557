"""Whether the record of a cut is one steady cut at the speed it is said to have: silence, a spindle that runs up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from jointlib.arrays import Array
from jointlib.cuts.sound import FEWEST, Sound, listen

_TURNS = 3.0
"""Revolutions whose level is taken together."""
_LOUD, _SILENT = 0.9, 0.2
"""The level of a cut is that which so many of its stretches stay below; of that, the share up to which it is silent."""
_CHANGED, _SETTLED = 0.09, 0.1
"""Share of the power beside the lines of the spindle from which on a record is looked at, and the share of that up to
which its second half is another thing."""
_ELSEWHERE = 0.1
"""Share of the nominal speed within which another one is looked for."""
_OURS, _THEIRS, _ONE = 0.05, 0.9, 0.98
"""Shares of the power up to which the lines of the spindle are missing at the nominal speed, and from which on those of
the teeth are there at another one; and the share of these that one of them holds at most, or else it is chatter."""


def listen_to_cut(signal: Array, rate: float, speed: float, teeth: int, where: str) -> Sound:
    """The spectrum of the part of a record, (samples,), in which the tool cuts, at a nominal speed in rpm.

    Silence before and after the cut is left out. Where the spindle runs at another speed, or did not run steadily at
    first, the sound says why it tells nothing.
    """
    x = np.asarray(signal, dtype=float) - np.mean(signal)
    first, last = _cutting(x, rate, speed)
    x = x[first:last]
    sound = listen(x, rate, speed, teeth, where)
    if last - first < len(signal):
        sound = replace(sound, said=(f"silent but from {first / rate:.3g} to {last / rate:.3g} s, of which it tells",))
    other = _other_speed(x, rate, speed, teeth, where, sound)
    if other:
        return replace(sound, useless=other)
    late = x[len(x) // 2 :]
    if len(late) / rate * speed / 60 >= FEWEST and _beside(sound, x) > _CHANGED:
        later = listen(late, rate, speed, teeth, where)
        if _beside(later, late) < _SETTLED * _beside(sound, x):
            return replace(
                sound,
                useless="its first half does not repeat with the revolution and its second does: the spindle ran up, "
                "or chatter died out; a record of the steady cut would tell",
            )
    return sound


def _cutting(x: Array, rate: float, speed: float) -> tuple[int, int]:
    """The samples between the silences at both ends; all of them where too little would be left."""
    size = int(np.ceil(_TURNS * 60 / speed * rate))
    count = len(x) // size
    if count < 2:
        return 0, len(x)
    level = np.sqrt(np.mean(x[: count * size].reshape(count, size) ** 2, axis=1))
    loud = np.flatnonzero(level > _SILENT * np.quantile(level, _LOUD))
    if not len(loud):
        return 0, len(x)
    # The stretch at either end of the cut is half silent.
    first = 0 if loud[0] == 0 else (int(loud[0]) + 1) * size
    last = len(x) if loud[-1] == count - 1 else int(loud[-1]) * size
    return (first, last) if (last - first) / rate * speed / 60 >= FEWEST else (0, len(x))


def _beside(sound: Sound, x: Array) -> float:
    """Share of the power that is not in the lines of the spindle."""
    return max(1 - sound.repeated / max(float(np.mean((x - np.mean(x)) ** 2)), 1e-300), 0.0)


def _other_speed(x: Array, rate: float, speed: float, teeth: int, where: str, sound: Sound) -> str:
    """That the lines of the record are those of a spindle at another speed; empty where they are not."""
    if 1 - _beside(sound, x) > _OURS:
        return ""
    tried = speed * np.arange(1 - _ELSEWHERE, 1 + _ELSEWHERE, 0.01)
    # Harmonics of the teeth alone: those of the revolution are so close that any line is near one.
    found = max((listen(x, rate, float(n) * teeth, 1, where) for n in tried), key=lambda one: one.repeated)
    if 1 - _beside(found, x) < _THEIRS or found.tooth > _ONE * found.repeated:
        return ""
    true = 60 * listen(x, rate, 60 * found.turning / teeth, teeth, where).turning
    return f"its lines are those of a spindle at {true:.4g} rpm, the file says {speed:.4g}: expected that of the record"
