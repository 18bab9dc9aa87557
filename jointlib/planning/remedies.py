"""What else could be measured where a campaign leaves effects confused: each is tried before it is advised."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from jointlib.planning.campaign import Campaign, longer, on_heavier
from jointlib.planning.setup import Setup
from jointlib.planning.simulated import Bench

_LONGER, _QUIETER, _FURTHER, _LOWEST = 3, 10.0, 1.5, 0.03


@dataclass(frozen=True)
class Remedy:
    """Another campaign, or another rig, and what it is in words."""

    word: str
    """"longer", "levels", "further", "quieter" or "mass"."""
    words: str
    bench: Bench


def remedies(bench: Bench) -> Iterator[Remedy]:
    """Those that can be tried from a campaign."""
    c, s = bench.campaign, bench.setup
    periods = _LONGER * c.periods
    yield Remedy("longer", f"records {_LONGER} times as long ({periods} periods)", _on(bench, longer(c, _LONGER)))
    if min(c.levels) > 2 * _LOWEST:
        low = (_LOWEST, *c.levels)
        yield Remedy("levels", f"one more record at {_LOWEST:g} of the top level", _on(bench, replace(c, levels=low)))
    reach = _FURTHER * c.reach
    yield Remedy(
        "further",
        f"a top level that moves the joint by {1e6 * reach:.3g} µm, which is further than it may be moved now",
        _on(bench, replace(c, reach=reach)),
    )
    quieter = {n: x / _QUIETER for n, x in bench.sigma.items()}
    yield Remedy(
        "quieter", f"sensors with a tenth of the noise ({_said(quieter)})", _on(bench, c, replace(s, noise=quieter))
    )
    heavier = replace(s, m1=2 * s.m1, noise=bench.sigma)
    yield Remedy(
        "mass",
        f"{s.m1:.3g} kg bolted to the driven body, which moves the resonance to {heavier.resonance:.4g} Hz",
        _on(bench, on_heavier(c, s, heavier), heavier),
    )


def _said(noise: dict[str, float]) -> str:
    return ", ".join(f"{n} {x:.2g} {'N' if n == 'P' else 'm/s²'}" for n, x in noise.items())


def _on(bench: Bench, campaign: Campaign, setup: Setup | None = None) -> Bench:
    """The same joint under another campaign; the noise stays what it was unless it is what changes."""
    return Bench(setup or replace(bench.setup, noise=bench.sigma), bench.joint, campaign, bench.seed)
