"""The flank of a worn edge: a land that rubs on the waves just cut, and a face behind it that meets steep ones.

The land, L long, is pressed into the work throughout and pushes back with K_sp times the work that it displaces
(Chiou & Liang 1998); behind it the flank falls off by the clearance γ and pushes only where it meets the surface. For a
motion y along the chip thickness at cutting speed v, per depth of cut,

    V(t) = ∫₀^L [y(t) − y(t − s/v)] ds + ∫_L^∞ max(0, y(t) − y(t − s/v) − (s − L)·tan γ) ds.

Waves that are long against the land and flat against the clearance are damped by C/v with C = K_sp·L²/2. Of a harmonic
motion A cos ωt the force takes the energy of a damper

    C(A)/v = −K_sp/(π·A·ω)·∫₀^2π V·sin θ dθ,

the land's share of it K_sp·(1 − cos kL)/k², k = ω/v (an equivalent damper, as Ahmadi & Ismail 2012 take one): less than
the linear one for short waves, and more for waves so high that the face meets them.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError

from .given import positive

if TYPE_CHECKING:
    from .cutting import Cutting

_ANGLES, _PLACES = 256, 400
_LARGEST = 89.0


def flank_damping(cutting: Cutting, amplitude: float, frequency: float, speed: float) -> float:
    """C in N/m of a harmonic motion of an amplitude in m along the chip thickness, 0 for a vanishing one.

    At ``frequency`` in Hz and a spindle ``speed`` in rpm; `Cutting.process_damping` where the flank has no shape.
    """
    if cutting.wear_land is None or cutting.indentation is None or not np.isfinite(frequency):
        return cutting.process_damping or 0.0
    assert cutting.diameter is not None
    k = 2 * np.pi * frequency / (np.pi * cutting.diameter * speed / 60)
    found = cutting.indentation * (1 - np.cos(k * cutting.wear_land)) / k**2
    if amplitude > 0 and cutting.clearance is not None:
        slope = math.tan(math.radians(cutting.clearance))
        found += cutting.indentation * _face(k, cutting.wear_land, amplitude, slope)
    return float(found)


def _face(k: float, land: float, amplitude: float, slope: float) -> float:
    """What the face behind the land adds, over K_sp: −v·∫V·sin θ dθ/(π·A·ω)."""
    theta = 2 * np.pi * np.arange(_ANGLES) / _ANGLES
    behind = 2 * amplitude / slope * (np.arange(_PLACES) + 0.5) / _PLACES
    lag = k * (land + behind)
    overlap: Array = amplitude * (np.cos(theta)[:, None] - np.cos(theta[:, None] - lag)) - slope * behind
    V = np.sum(np.maximum(overlap, 0.0), axis=1) * (2 * amplitude / slope / _PLACES)
    return float(-2 * np.mean(V * np.sin(theta)) / (amplitude * k))


def linear_down_to(cutting: Cutting, frequency: float, share: float) -> float:
    """rpm below which the linear form C = K_sp·L²/2 is more than what waves at a frequency (Hz) feel, by a share of it.

    2·(1 − cos kL)/(kL)² = 1 − share, near kL = √(12·share); 0 where the flank has no shape.
    """
    if cutting.wear_land is None or cutting.diameter is None or not np.isfinite(frequency):
        return 0.0
    turned = np.sqrt(12 * share)
    for _ in range(100):
        turned = np.sqrt(2 * (1 - np.cos(turned)) / (1 - share))
    return float(2 * np.pi * frequency * cutting.wear_land / turned * 60 / (np.pi * cutting.diameter))


def checked_flank(cutting: Cutting) -> None:
    """Refuse a flank of half a shape, with another damping beside it, or with no cutting speed."""
    given = (cutting.indentation, cutting.wear_land)
    if cutting.clearance is not None and None in given:
        raise InputError("[cutting]: clearance is that of a worn flank, expected 'indentation' and 'wear_land' with it")
    if given == (None, None):
        return
    if None in given:
        raise InputError("[cutting]: 'indentation' (N/m^3) and 'wear_land' (m) make a flank together, one is missing")
    for key in ("indentation", "wear_land", "clearance"):
        value = getattr(cutting, key)
        if value is not None:
            positive(key, value)
    if cutting.clearance is not None and cutting.clearance > _LARGEST:
        raise InputError(f"[cutting]: clearance is {cutting.clearance:g} degrees, expected below {_LARGEST:g}")
    assert cutting.indentation is not None
    assert cutting.wear_land is not None
    follows = cutting.indentation * cutting.wear_land**2 / 2
    if cutting.process_damping is not None and not math.isclose(cutting.process_damping, follows, rel_tol=1e-9):
        raise InputError(
            f"[cutting]: process_damping is {follows:g} N/m by indentation and wear_land; give one or the other"
        )
    if cutting.diameter is None:
        raise InputError("[cutting]: wear_land needs 'diameter', for the cutting speed; it is missing")
