"""Values that lie outside what machines are made of, and the factor of a unit that would bring them back."""

from __future__ import annotations

_FACTORS = (1e3, 1e-3, 1e6, 1e-6, 1e9, 1e-9)


def outside(value: float, low: float, high: float, what: str, unit: str, scale: float = 1.0) -> str:
    """``is 7.85 kg/m³, expected 400 to 20 000 kg/m³; …`` after what it is, or nothing where it lies inside.

    Values are given in SI and told times ``scale`` in ``unit``.
    """
    if low <= value <= high:
        return ""
    fits = [factor for factor in _FACTORS if low <= value * factor <= high]
    hint = ""
    if fits:
        more = f"{fits[0]:g}" if fits[0] > 1 else f"1/{1 / fits[0]:g}"
        hint = f"; times {more} it would lie there: is its unit right?"
    return (
        f"{what} is {value * scale:.4g} {unit}, expected {low * scale:.4g} to {high * scale:.4g} {unit}"
        f"{hint or ', is its unit right?'}"
    )
