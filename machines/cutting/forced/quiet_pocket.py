"""A quieter setting beside a recommended pocket whose teeth meet a resonance.

The best pocket lies where the tooth frequency is near a natural frequency, so it is there that the teeth shake the tool
most (Schmitz and Smith, Machining Dynamics, ch. 5: surface location error).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import CheckFailed, InputError

from ...harmonic_balance.assembly import is_linear
from ...model.machine import Machine
from ..amplitude.pocket import RESERVE, Limit, Pocket, best_pocket, deepest, removal_rate, worst_near
from ..process.cutting import Cutting
from .forced_vibration import forced_vibration, too_many
from .held_at_rest import held_if_many
from .shaken_limits import SteadyCut, steady_cut
from .surface_error import surface_errors, worst_error

LOUD = 0.5
"""Vibration of the teeth over the feed per tooth above which a quieter setting is named."""
_LONG = 3.0
"""Diameters that the edges of few end mills reach beyond."""
_MOST = 24
"""Settings looked at where joints depend on amplitude."""


def quiet_pocket(
    machine: Machine, speeds: Array, safe: Array, limit: Limit | None, best: Pocket, amplitude: float
) -> Pocket | None:
    """The setting that removes most among those whose teeth move the tool by less than `LOUD` times the feed.

    ``speeds`` in rpm, ascending, ``safe`` the limits there in m, ``limit`` that at others, and ``amplitude`` (m) what
    the teeth make of the tool in the recommended pocket, ``best``. None where that is below `LOUD` already, or no
    setting is quieter.
    """
    cutting = Cutting(**dict(machine.cutting or {}))
    if cutting.feed is None or too_many(machine) or not amplitude > LOUD * cutting.feed:
        return None
    (worst,), inside = worst_near(speeds, np.minimum(safe, deepest(cutting))[None])
    chosen = np.flatnonzero(inside & np.isfinite(worst))
    if not len(chosen):
        return None
    if not all(map(is_linear, machine.joints())):
        chosen = chosen[np.unique(np.linspace(0, len(chosen) - 1, _MOST).round().astype(int))]
    depth = (1 - RESERVE) * worst[chosen]
    try:
        found = forced_vibration(machine, speeds[chosen], depth)
    except (CheckFailed, InputError):
        return None
    quiet = found.settled & (np.nan_to_num(found.amplitude, nan=np.inf) <= LOUD * cutting.feed)
    if not np.any(quiet):
        return None
    at = int(np.argmax(np.where(quiet, speeds[chosen] * depth, 0.0)))
    settled = best_pocket(speeds, safe, cutting, limit, int(chosen[at]))
    if settled is None:
        return None
    b = min(settled.depth, float(depth[at]))  # the depth for which the vibration is known
    return replace(settled, depth=b, removal_rate=removal_rate(cutting, settled.speed, b))


def pocket_in_cut(
    machine: Machine, speeds: Array, safe: Array, limit: Limit | None, best: Pocket
) -> tuple[SteadyCut | None, Pocket | None, list[str]]:
    """The cut in the recommended pocket, a setting with less of its vibration, and both told; see `quiet_pocket`.

    Told are the vibration of the teeth, where that leaves the finished wall, and the quieter setting; joints that are
    too many to be shaken are held as at rest, which is told first.
    """
    cutting = Cutting(**dict(machine.cutting or {}))
    far = _beyond_edges(cutting, best)
    machine, said = held_if_many(machine, best.speed)
    cut = steady_cut(machine, best.speed, best.depth)
    if cut is None:
        return None, None, far
    said = [*far, *said]
    said += [cut.words(), *_wall(cutting, cut)]
    quiet = quiet_pocket(machine, speeds, safe, limit, best, float(cut.forced.amplitude[0]))
    if quiet is not None:
        said.append(f"With a tooth-passing vibration of less than half the feed: {quiet.words()}.")
    return cut, quiet, said


def _beyond_edges(cutting: Cutting, best: Pocket) -> list[str]:
    """A recommended depth that few cutters have the edges for, in a sentence."""
    D = cutting.diameter
    if cutting.process != "milling" or cutting.flute_length is not None or D is None or best.depth <= _LONG * D:
        return []
    return [
        f"That is {best.depth / D:.1f} diameters deep, and few cutters have edges so long: with flute_length in "
        "[cutting] no deeper cut is recommended than they reach."
    ]


def _wall(cutting: Cutting, cut: SteadyCut) -> list[str]:
    """Where the finished wall stands, in a sentence; none where that is not known."""
    error = float(worst_error(surface_errors(cutting, cut.forced))[0])
    if not np.isfinite(error):
        return []
    where = "too far in, beyond what is to be cut" if error > 0 else "short of it, with material left"
    return [f"There the finished wall stands {1e6 * abs(error):.3g} µm {where} (surface location error)."]
