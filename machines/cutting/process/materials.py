"""Coefficients of cutting forces by material: measured ones, from the literature, to begin with.

They are those of one tool, feed and speed each and differ by a third and more from shop to shop; a chart that matters
takes measured ones.
"""

from __future__ import annotations

from dataclasses import dataclass

from jointlib.errors import InputError, nearest


@dataclass(frozen=True)
class Material:
    """K_tc and K_rc in N/m², K_te and K_re in N/m, milled dry with cemented carbide, and where they were published."""

    tangential: float
    normal: float
    edge_tangential: float
    edge_normal: float
    source: str


_REVIEW = "collected in a review of force models, Chinese Journal of Mechanical Engineering 34 (2021) 18, table 5"

MATERIALS = {
    "al-6082-t6": Material(631e6, 99e6, 13e3, 10e3, _REVIEW),
    "al-7075-t6": Material(767.01e6, 168.8e6, 27.7e3, 26.6e3, _REVIEW),
    "al-6061-t6": Material(243.77e6, 113.5e6, 7.53e3, 7.83e3, _REVIEW),
}
"""Keys of ``material`` in ``[cutting]``."""


def material_of(name: object) -> Material:
    """A material by its name."""
    found = MATERIALS.get(str(name))
    if found is None:
        raise InputError(f"[cutting]: material is {name!r}, {nearest(str(name), tuple(MATERIALS))}")
    return found
