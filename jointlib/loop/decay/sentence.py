"""What a trace of free decays found, in a sentence."""

from __future__ import annotations

from collections.abc import Sequence

from jointlib.loop.answer.naming import in_words
from jointlib.loop.answer.report import Candidate, Rival, Verdict, figures
from jointlib.loop.decay.fitted import Folds
from jointlib.loop.decay.search import Search


def sentence_of(
    verdict: Verdict, found: Search, chosen: Candidate | None, rivals: Sequence[Rival], folds: Folds, left: float
) -> tuple[str, str]:
    """The finding in a sentence, and what to do next."""
    another = "Repeat at three levels or more, from the smallest that can be measured to the largest that is safe."
    if verdict is Verdict.NOTHING_MISSING:
        return "What the joint leaves of frequency and damping over amplitude is noise.", "Nothing; use the joint."
    if chosen is None:
        said = (
            "Frequency and damping change over amplitude in a way that the joint does not have and no effect explains."
        )
        return said, "Look at where over amplitude they differ; measure the force along a path, or on a rig."
    names = " and ".join(in_words(r.effect.family, member=r.effect.member) for r in found.terms)
    share = f"It explains {100 * min(found.explained, 0.9999):.3g} % of what frequency and damping "
    share += "over amplitude have beyond the joint"
    text = f"The joint lacks {names}: {figures(chosen.parameters)}. {share}"
    text += f", and {100 * left:.2g} % of the force is left."
    if verdict is Verdict.PARTIAL:
        return f"{text} {_more(found)}", "Measure the force along a path, or on a rig, to name the rest."
    if rivals:
        listed = ", ".join(dict.fromkeys(r.family for r in rivals))
        return f"{text} These decays cannot rule out {listed}.", rivals[0].separating_experiment
    if not folds.several:
        return f"{text} One level alone: the shape is not tested on another.", another
    return text, "Trace again with the mended joint."


def _more(found: Search) -> str:
    """Why effects that explain much are not all."""
    if found.rounded is not None:
        return (
            f"But this friction turns over {100 * found.rounded:.2g} % of the largest speed, and dry friction at once: "
            "it stands in for damping that saturates with the speed."
        )
    power = found.unnamed
    if power is None or not power.clear:
        return "More is missing."
    return (
        f"But {power.words} leaves {100 * power.lost / power.joint:.2g} % of what they leave of the damping, with no "
        "more numbers: they stand in for something else."
    )
