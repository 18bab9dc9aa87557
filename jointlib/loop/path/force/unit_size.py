"""A law as a size in newtons times a law of unit size: forces of one shape are evaluated once."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.effect import Path
from jointlib.law import JointLaw, Motion
from jointlib.parameter import parameters_of

_NEWTON = re.compile(r"N(?![A-Za-z])")
_PROBE = np.array([0.0, 0.4, 1.0, -0.2, -0.9, -0.1, 0.8])
_TIMES = 3.0


def form_of(law: JointLaw) -> object:
    """What kind of law it is, with how many elements or coefficients, whatever their values."""
    return type(law), tuple(np.shape(getattr(law, p.name)) for p in parameters_of(law))


@dataclass(frozen=True, eq=False)
class Sizes:
    """Sizes of laws that do along a path like this one what the units of their parameters say."""

    path: Path
    _known: dict[object, bool] = field(default_factory=dict)

    def __call__(self, law: JointLaw) -> tuple[JointLaw, float]:
        """A law with all parameters that have newtons in them over the first of them that is not 0, and that one.

        A force is a newton, so what it is proportional to are those parameters together. A law with newtons elsewhere
        (m/N^(2/3)), or with parameters that follow an input, is left as it is.
        """
        if not self.proportional(law):
            return law, 1.0
        values = _newtons(law)
        first = next(x for x in values.values() if np.any(x))
        size = abs(float(first.flat[int(np.flatnonzero(first)[0])]))
        return (law, 1.0) if size == 1.0 else (_times(law, values, 1 / size), size)

    def proportional(self, law: JointLaw) -> bool:
        """True if a force is proportional to the parameters that have newtons in them, and is not 0."""
        values, form = _newtons(law), form_of(law)
        if not any(np.any(x) for x in values.values()):
            return False
        if form not in self._known:
            self._known[form] = self._proportional(law, values)
        return self._known[form]

    def _proportional(self, law: JointLaw, values: Mapping[str, Array]) -> bool:
        z, v = (_PROBE * float(np.max(np.abs(x))) for x in (self.path.displacement, self.path.velocity))
        once, more = (_along(one, z, v, self.path.time_step) for one in (law, _times(law, values, _TIMES)))
        return np.allclose(_TIMES * once, more, rtol=1e-9, atol=1e-9 * float(np.max(np.abs(more)) + 1e-300))


def _newtons(law: JointLaw) -> dict[str, Array]:
    """The parameters in newtons, or newtons over something; none where other ones hold newtons or follow an input."""
    found: dict[str, Array] = {}
    for p in parameters_of(law):
        if _NEWTON.search(p.unit):
            values = np.asarray(getattr(law, p.name), dtype=float)
            if not p.unit.startswith("N") or (values.ndim and not (p.listed or p.table)):
                return {}
            found[p.name] = values
    return found


def _along(law: JointLaw, z: Array, v: Array, time_step: float) -> Array:
    with np.errstate(all="ignore"):
        return law.along(z, v, time_step) if law.states else law.step(Motion(z, v), np.empty((len(z), 0)))[0]


def _times(law: JointLaw, values: Mapping[str, Array], size: float) -> JointLaw:
    """A law with some parameters times a number; listed and tabled ones stay tuples."""
    moved = {name: _plain((x * size).tolist()) for name, x in values.items()}
    return replace(law, **moved)  # type: ignore[type-var]


def _plain(x: Any) -> Any:
    return tuple(map(_plain, x)) if isinstance(x, list) else x
