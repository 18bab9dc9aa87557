"""What jointlib raises on misuse, and how a computation says how it ended."""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Iterable
from enum import Enum

from jointlib.meanings import meant

MOST = 20
"""Faults that are told at once in words."""
LONGEST = 290
"""Letters of a sentence, behind the name of the program 300."""
_QUOTED = 60
_UNBROKEN = re.compile(rf"\S{{{_QUOTED + 1},}}|'[^']{{{_QUOTED + 1},}}'")
_NEAREST = 5
"""Words of a list that are told where it holds more."""
_PLACE = re.compile(r"\[\[\w+\]\] \d+(?: \([^)]*\))?|\b(?:connection|component) '[^']*'(?=: )")
_QUOTE = re.compile(r" \(line \d+: .*\)$", re.DOTALL)
"""What names the place of a fault in a file, and what quotes it."""
_ABSENT = re.compile(r"no component '|which does not exist")
"""What one wrong name does at every place that refers to it."""


class InputError(ValueError):
    """Input that cannot be used; each sentence says where, what was found and what was expected.

    One sentence is the text; of several, as of a file with several faults, each has a line of its own below their
    number, the first twenty; what several places refer to and is not there is told once. The command line prints them,
    with ``--json`` all as data, and exits with status 2.
    """

    @property
    def sentences(self) -> tuple[str, ...]:
        """What is wrong, one thing each."""
        return tuple(str(said) for said in self.args)

    def __str__(self) -> str:
        return self._listed(escaped)

    def shortened(self) -> str:
        """The text as the command line prints it: no sentence longer than it can be taken in."""
        return self._listed(told)

    def _listed(self, form: Callable[[str], str]) -> str:
        said = _once(self.sentences)
        more = (f"and {len(said) - MOST} more",) if len(said) > MOST else ()
        return "\n".join(map(form, said) if len(said) < 2 else (f"{len(said)} faults", *map(form, said[:MOST]), *more))


class FrequencyMismatch(InputError):
    """Two receptances stand on different frequency lines; nothing is interpolated in silence."""


class CheckFailed(RuntimeError):
    """A verification compared two independent results and they differ (exit status 1)."""


class Outcome(Enum):
    """How a computation ended; the value says what to do next and is empty where nothing is to be done."""

    CONVERGED = ""
    OUT_OF_RANGE = "A joint left the amplitude range it was identified on. Lower the force or identify it further up."
    PAST_FORCE_PEAK = "The joint force falls with displacement there, an artefact of the fit. Lower the force."
    NEGATIVE_DAMPING = "The joint feeds energy in at this amplitude, an artefact of the fit. Lower the force."
    FRF_TOO_SHORT = "A receptance ends below the harmonics that are needed. Extend its frequency range."
    STALLED = "The joint amplitudes did not settle. Follow the branch by arc length, or lower the force."
    NO_EQUILIBRIUM = "The mean force of a joint cannot balance the static load at this amplitude. Lower the force."
    STEP_TOO_SMALL = "Arc length cannot follow the branch further. Narrow the range or lower the force."
    HARMONICS_SIGNIFICANT = "Harmonics that were not solved for matter there. Ask for more of them or lower the force."
    UNSTABLE = (
        "The motion is unstable: a disturbance grows, the machine beats or jumps. Lower the force or add damping."
    )
    PEAK_AT_EDGE = "The largest response lies at the edge of the frequency range. Widen the range."


def together(*checks: Callable[[], object]) -> None:
    """Run checks that do not need one another; all that they refuse is raised as one."""
    said: dict[str, None] = {}
    for check in checks:
        try:
            check()
        except InputError as error:
            said |= dict.fromkeys(error.sentences)
    if said:
        raise InputError(*said)


def _once(said: tuple[str, ...]) -> list[str]:
    """Sentences, those of a thing that is not there as the first of them with the number of the others."""
    groups: dict[str, list[str]] = {}
    for one in said:
        groups.setdefault(_QUOTE.sub("", _PLACE.sub("", one)) if _ABSENT.search(one) else one, []).append(one)
    return [
        same[0] if len(same) == 1 else _PLACE.sub(rf"\g<0> and {len(same) - 1} more", same[0], count=1)
        for same in groups.values()
    ]


def nearest(word: str, valid: Iterable[str]) -> str:
    """Half a sentence that names the valid word nearest to ``word``, in letters or in meaning, or all of them."""
    words = sorted(valid)
    if not words:
        return "there is none"
    word = word[:_QUOTED]
    same = [valid for valid in words if valid.casefold() == word.casefold()]
    other = meant(word, words)
    close = same or ([other] if other else difflib.get_close_matches(word, words, n=1, cutoff=0.5))
    return f"did you mean {close[0]!r}?" if close else "expected one of " + few(words, word)


def few(words: Iterable[str], near: str = "") -> str:
    """Words as a list; of more than six the five nearest to one in letters, and how many others there are."""
    every = list(words)
    if len(every) <= _NEAREST + 1:
        return ", ".join(every)
    close = difflib.get_close_matches(near[:_QUOTED], every, n=_NEAREST, cutoff=0.0) if near else every[:_NEAREST]
    return f"{', '.join(sorted(close, key=every.index))} or {len(every) - len(close)} others"


def escaped(text: str) -> str:
    """A text on one line, what cannot be printed as an escape."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)


def _shortened(word: str) -> str:
    """The end of a path, which names the file; of anything else the begin and the end."""
    return f"…{word[-_QUOTED // 2 :]}" if "/" in word else f"{word[: _QUOTED - 20]}…{word[-16:]}"


def told(text: str, most: int = LONGEST) -> str:
    """A sentence as it is printed: one line, what cannot be printed escaped, long quotations and then the rest cut."""
    line = escaped(text)
    if len(line) > most:
        line = _UNBROKEN.sub(lambda match: _shortened(match[0]), line)
    tail = most // 3
    return line if len(line) <= most else f"{line[: most - tail - 3]} … {line[-tail:]}"
