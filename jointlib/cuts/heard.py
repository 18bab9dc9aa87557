"""What the record of a cut tells: stable or chatter, and at which frequency.

A stable cut repeats with the revolution, run-out and all, so what it holds beside the harmonics of the revolution is
background. Chatter stands there in narrow lines; noise does not. Chatter that repeats with the revolution as well is
told from run-out, where it can be, by `kept_step`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array
from jointlib.cuts.kept_step import CHATTER, kept_step
from jointlib.cuts.sound import Line, Sound, listen

_STABLE = 0.1
"""Share of the vibration in lines that do not repeat below which a cut is stable."""
_NOISY = 0.3
"""Share of noise from which on it is told."""
_ALL = 0.95
"""Share of noise from which on nobody can tell whether it is chatter without a period."""
_MAINS = (50.0, 60.0)
_MULTIPLES = 6
_OFF = 0.002
"""Share by which the mains may be off."""
WOULD_TELL = 'a record of the spindle turning without cutting (role = "quiet") would tell'


@dataclass(frozen=True)
class Heard:
    """What a record tells of its cut.

    Parameters
    ----------
    verdict
        ``"stable"``, ``"chatter"`` or ``"marginal"``; ``"unknown"`` where noise hides it.
    chatter_frequency
        Hz of the strongest line away from those of the spindle, or of a flip; None where none stands out.
    kind
        ``"hopf"`` or ``"flip"``; empty without chatter.
    share
        Effective value of the lines that do not repeat with the revolution, over that of all lines but background.
    speed
        rpm as the record has it.
    said
        Half sentences: what was left out, and why nothing more can be told.
    """

    verdict: str
    chatter_frequency: float | None
    kind: str
    share: float
    speed: float
    said: tuple[str, ...] = ()


def heard(signal: Array, rate: float, speed: float, teeth: int, where: str) -> Heard:
    """Judge a cut by its record, (samples,), at a nominal speed in rpm, of a tool that runs true.

    ``where`` begins what is refused.
    """
    return told_by(listen(signal, rate, speed, teeth, where), run_out=0.0)


def told_by(sound: Sound, background: Sequence[Line] = (), run_out: float | None = None, rises: bool = False) -> Heard:
    """Judge a cut by its spectrum, without the lines of the background.

    ``run_out`` is how large lines of the revolution that are none of the teeth are in other cuts with the tool, over
    those of the teeth; None where nobody knows. ``rises`` where the hump of the noise is that of this cut alone.
    """
    said = list(sound.said)
    if sound.useless:
        return Heard("unknown", None, "", 0.0, 60 * sound.turning, (*said, sound.useless))
    lines = [line for line in sound.lines if line.loud and line not in background]
    weak = [line for line in lines if _of_mains(line, sound) and _share(sound, line.power) < CHATTER]
    if weak:
        part = _share(sound, sum(line.power for line in weak))
        if part >= _STABLE / 2:
            hum = ", ".join(f"{line.frequency:.1f}" for line in weak)
            said.append(f"{hum} Hz is the mains, {100 * part:.0f} % of the vibration: left out")
        lines = [line for line in lines if line not in weak]
    power = sum(line.power for line in lines)
    share, speed = _share(sound, power), 60 * sound.turning
    everything = sound.repeated + power + sound.noise
    hump = sound.hump if sound.hump and _share(sound, sound.hump.power) >= CHATTER else None
    noisy = f"{100 * np.sqrt(sound.noise / everything):.0f} % of the vibration"
    if hump is None and _NOISY**2 * everything < sound.noise <= _ALL**2 * everything:
        said.append(f"{noisy} is noise, which is no chatter")
    strongest = max(lines, key=lambda line: line.power, default=None)
    step = kept_step(sound, run_out)
    said += [step.said] if step.said else []
    if step.kind in ("hopf", "flip") and step.power > (strongest.power if strongest else 0.0):
        # Chatter that keeps step sings where the spindle does and not where the tool would.
        frequency = step.frequency if step.kind == "flip" else None
        return Heard("chatter", frequency, step.kind, share, speed, tuple(said))
    if strongest is not None and share >= _STABLE:
        if _of_mains(strongest, sound):
            said.append(f"{strongest.frequency:.1f} Hz is the mains or chatter; {WOULD_TELL}")
            return Heard("unknown", None, "", share, speed, tuple(said))
        order = strongest.frequency / sound.turning / sound.teeth - 0.5
        near = abs(order - round(order)) * sound.teeth * sound.turning < sound.width
        verdict = "chatter" if share >= CHATTER else "marginal"
        return Heard(verdict, strongest.frequency, "flip" if near else "hopf", share, speed, tuple(said))
    if hump is not None:
        irregular = f"{noisy} is irregular, most of it about {hump.frequency:.0f} Hz"
        why = "other records do not have that" if rises else f"chatter, or a mode that noise shakes; {WOULD_TELL}"
        said.append(f"{irregular}: {why}")
        verdict = "chatter" if rises else "unknown"
        return Heard(verdict, None, "", _share(sound, power + hump.power), speed, tuple(said))
    unknown = _hidden(sound, sound.repeated + power)
    if not unknown and sound.noise > _ALL**2 * everything:
        unknown = f"{noisy} is irregular, most of it noise or all of it chatter; {WOULD_TELL}"
    said += [unknown] if unknown else []
    return Heard("unknown" if step.kind or unknown else "stable", None, "", share, speed, tuple(said))


def _hidden(sound: Sound, told: float) -> str:
    """Why nobody can tell whether a cut without lines is stable, ``told`` the power of all lines; or nothing."""
    if sound.faintest > CHATTER**2 * (told + sound.faintest):
        return "noise hides whether the cut repeats; a longer record, or a microphone closer to it, would tell"
    if sound.beside > CHATTER**2 * (told + sound.beside):
        return "something stands too close beside lines of the spindle to be told; a longer record would tell"
    return ""


def _share(sound: Sound, power: float) -> float:
    """Effective value of some lines over that of them and the lines of the spindle."""
    return float(np.sqrt(power / (sound.repeated + power))) if power > 0 else 0.0


def _of_mains(line: Line, sound: Sound) -> bool:
    """Whether a line stands at the frequency of the mains or a multiple of it."""
    for mains in _MAINS:
        multiple = round(line.frequency / mains)
        off = abs(line.frequency - multiple * mains)
        if 1 <= multiple <= _MULTIPLES and off < 0.25 * sound.width + _OFF * line.frequency:
            return True
    return False
