"""Lines of the revolution that are none of the teeth: run-out, a flip, or chatter that keeps step with the spindle.

A flip of an even number of teeth repeats with the revolution. So does chatter that has locked to it (period-n motion,
Honeycutt & Schmitz 2016), or by chance falls on one of its harmonics. What run-out makes of such lines is known from
the other cuts with the tool, within a factor by which a mode may raise it. Of one cut alone, a flip is told where it is
larger than every line of the teeth.
"""

from __future__ import annotations

from dataclasses import dataclass

from jointlib.cuts.sound import Sound

_RUN_OUT, _FLIP = 3.0, 10.0
"""Times the other harmonics of the revolution that a line halfway is: to the one run-out, from the other on a flip."""
_USUAL, _UNUSUAL = 3.0, 30.0
"""Times what it is in other cuts that a line is: to the one run-out, from the other on chatter. Of 318 stable cuts of
simulated mills with a run-out of a tenth of the feed one in ten was over 3.3 times, none over 12."""
CHATTER = 0.3
"""Share of the vibration from which on lines that are none of the teeth, nor run-out, are chatter."""
_SHALLOWER = "a shallower cut at this speed would tell: run-out stays, chatter goes"
_STEP = "chatter that keeps step with the revolution"


@dataclass(frozen=True)
class KeptStep:
    """What the largest of such lines is.

    Parameters
    ----------
    kind
        ``"hopf"`` or ``"flip"`` of chatter, ``"either"`` where nobody can tell it from run-out, else empty.
    frequency, power
        In Hz and as in `Sound`.
    said
        Half a sentence, or nothing.
    """

    kind: str
    frequency: float
    power: float
    said: str = ""


def kept_step(sound: Sound, run_out: float | None) -> KeptStep:
    """What lines of the revolution that are none of the teeth are.

    ``run_out`` is how large they are in other cuts with the tool, over those of the teeth; None where nobody knows.
    """
    power, frequency = max((sound.half, sound.half_frequency), (sound.others, sound.other_frequency))
    kind, said = _alone(sound) if run_out is None else _beside_others(sound, power, run_out)
    place = f"the line at {frequency:.5g} Hz, {round(frequency / (sound.turning or 1.0))} per revolution,"
    return KeptStep(kind, frequency, power, f"{place} {said}" if said else "")


def _alone(sound: Sound) -> tuple[str, str]:
    if sound.others > _RUN_OUT**2 * max(sound.tooth, sound.half):
        return "either", f"is over three times those of the teeth: run-out, or {_STEP}; {_SHALLOWER}"
    if sound.half <= sound.tooth:
        return "", ""
    if sound.half < _RUN_OUT**2 * sound.others:
        return "", "is run-out: others are more than a third of it"
    # Every harmonic of the revolution of two teeth is one of the teeth or halfway.
    if sound.half < _FLIP**2 * sound.others or sound.teeth == 2:
        return "either", f"is run-out or a flip; {_SHALLOWER}"
    return "flip", ""


def _beside_others(sound: Sound, power: float, run_out: float) -> tuple[str, str]:
    usual = run_out**2 * sound.tooth
    if sound.in_step < CHATTER**2 * sound.repeated:
        return "", ""
    if power < _USUAL**2 * usual:
        return "", "is run-out: other cuts have it too" if power > sound.tooth else ""
    flip = sound.half > _FLIP**2 * sound.others
    if power < _UNUSUAL**2 * usual:
        other = "a flip" if flip else _STEP
        return "either", f"is over {_USUAL:.0f} times what it is in the other cuts: run-out or {other}; {_SHALLOWER}"
    return ("flip", "") if flip else ("hopf", f"is far more than in the other cuts: {_STEP}")
