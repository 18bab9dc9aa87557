"""What no cut has: numbers in another unit than they were written in, told with what they would be in that."""

from __future__ import annotations

DEEPEST, DIAMETERS = 0.2, 10.0
"""m, and diameters, that no flute is long."""
LARGEST_FEED = {"milling": 5e-3, "turning": 20e-3}
"""m a tooth (mills for high feed take 3.5 mm) and a revolution (peeling takes 15 mm)."""
_BARE = "; a number without a unit is in m"


def impossible(
    process: str,
    *,
    speed: float | None = None,
    depth: float | None = None,
    feed: float | None = None,
    teeth: int = 1,
    immersion: float | None = None,
    diameter: float | None = None,
) -> list[str]:
    """Sentences on what cannot be, of a cut in SI with the speed in rpm; None is not looked at.

    Depth above `DEEPEST` or `DIAMETERS` diameters, a feed above `LARGEST_FEED` or the diameter, a/D above 1, a diameter
    that is not above 0.
    """
    said = []
    if immersion is not None and not 0 < immersion <= 1:
        said.append(f"immersion is {immersion:g}, expected a/D above 0 and at most 1{_as_share(immersion, diameter)}")
    if diameter is not None and not diameter > 0:
        said.append(f"diameter is {diameter:g} m, expected more than 0")
        diameter = None
    longest = DEEPEST if diameter is None else min(DEEPEST, DIAMETERS * diameter)
    if depth is not None and depth > longest:
        of = "" if longest == DEEPEST else f", {DIAMETERS:g} diameters"
        said.append(f"depth is {1e3 * depth:g} mm, expected at most {1e3 * longest:g} mm{of}{_BARE}")
    most = LARGEST_FEED[process] if diameter is None or process == "turning" else min(LARGEST_FEED[process], diameter)
    if feed is not None and feed > most:
        per = "tooth" if process == "milling" else "revolution"
        said.append(
            f"feed is {1e3 * feed:g} mm a {per}, expected at most {1e3 * most:g} mm{_a_minute(feed, speed, teeth, per)}"
        )
    return said


def _as_share(immersion: float, diameter: float | None) -> str:
    """What a width in mm or a percentage would be."""
    if diameter is not None and 1 < immersion <= 1e3 * diameter:
        return f"; a width of {immersion:g} mm is {immersion / (1e3 * diameter):.3g}"
    return "; a width of cut is divided by the diameter, a percentage by 100" if immersion > 1 else ""


def _a_minute(feed: float, speed: float | None, teeth: int, per: str) -> str:
    """What a feed in m a minute would be."""
    if speed is None or not speed > 0 or not 5e-6 < feed / (teeth * speed) < 1e-3:
        return _BARE
    return f"; {1e3 * feed:g} mm a minute are {1e3 * feed / (teeth * speed):.3g} mm a {per} at {speed:g} rpm"
